"""Who holds a lock: host, process and boot, and whether that process is still there."""

from __future__ import annotations

import json
import os
import socket
import time
from dataclasses import asdict, dataclass
from pathlib import Path

_PROC = Path("/proc")
_LARGEST_PID = 2**31


@dataclass(frozen=True)
class Owner:
    """The process that holds a lock.

    Attributes
    ----------
    host, machine : name of the machine, and its number from ``/etc/machine-id``
    boot : number of the machine's last start
    space : the namespace of process numbers, which containers have of their own
    pid, started : process, and its start by the kernel's clock
    command : work of the process in words, for the user
    since : when the lock was taken, in the machine's local time
    """

    host: str
    machine: str
    boot: str
    space: str
    pid: int
    started: str
    command: str
    since: str

    def text(self) -> str:
        """Text of the lock file: the owner as JSON."""
        return json.dumps(asdict(self), indent=1) + "\n"

    @property
    def in_words(self) -> str:
        """The process in words."""
        return f"process {self.pid} on {self.host} (`{self.command}`, since {self.since})"

    def same_boot(self, other: Owner) -> bool:
        """Whether both run under the same kernel since its last start."""
        return bool(self.boot) and self.boot == other.boot

    def same_processes(self, other: Owner) -> bool:
        """Whether process numbers of both mean the same processes."""
        return self.same_boot(other) and self.space == other.space

    def before_restart(self, other: Owner) -> bool:
        """Whether ``other`` ran on this machine before its last start, and is no more."""
        same = self.host == other.host and bool(self.machine) and self.machine == other.machine
        return same and bool(other.boot) and self.boot != other.boot

    @property
    def alive(self) -> bool:
        """Whether the process is there; only for those of the same process numbers.

        One that has ended and whose parent has not taken its exit code yet (a zombie) is not.
        """
        try:
            os.kill(self.pid, 0)
        except ProcessLookupError:
            return False
        except OSError:  # of another user
            pass
        return _started(self.pid) in ("", self.started) and _stat(self.pid)[:1] != ["Z"]


def myself(command: str) -> Owner:
    """This process, as an owner. Not collective."""
    return Owner(
        host=socket.gethostname(),
        machine=_line(Path("/etc/machine-id")),
        boot=_line(_PROC / "sys/kernel/random/boot_id"),
        space=_namespace(),
        pid=os.getpid(),
        started=_started(os.getpid()),
        command=command,
        since=time.strftime("%Y-%m-%d %H:%M:%S"),
    )


def read_owner(text: str) -> Owner | None:
    """The owner that a lock file names, None if it is no whole lock file."""
    try:
        found = json.loads(text)
        owner = Owner(**{**found, "pid": int(found["pid"])})
    except (ValueError, TypeError, KeyError, RecursionError):
        return None
    words = (value for name, value in asdict(owner).items() if name != "pid")
    sound = all(isinstance(word, str) and (word.isprintable() or not word) for word in words)
    return owner if sound and 0 < owner.pid < _LARGEST_PID else None


def _line(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8").strip()
    except (OSError, ValueError):  # not Linux
        return ""


def _namespace() -> str:
    try:
        return os.readlink(_PROC / "self/ns/pid")
    except OSError:
        return ""


def _started(pid: int) -> str:
    """When a process was started, in the kernel's ticks since the machine's; empty if unknown."""
    words = _stat(pid)
    return words[19] if len(words) > 19 else ""


def _stat(pid: int) -> list[str]:
    """Fields of /proc/PID/stat from the state on; empty if unknown."""
    return _line(_PROC / f"{pid}/stat").rpartition(")")[2].split()
