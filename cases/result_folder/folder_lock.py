"""The lock of a result folder: one process writes there, all others are refused in a sentence.

A lock is a file that is linked into place, which is one operation on local disks and over NFS. It
names its process; where the kernel has ``flock`` the process also holds that. A lock that a dead
process of this machine left is taken over, and that of a SLURM job that has ended. Whether another
process on another machine is dead cannot be found out: the message has its last sign of life, and
the user removes the file.

The package filelock is no replacement. Its flock says nothing on disks that keep locks to one host
(Lustre with localflock, NFS with local_lock), its soft lock stays after a kill on another host, and
neither names the process that holds it.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import json
import os
import re
import socket
import stat
import threading
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from catenary.base.errors import InputError
from catenary.base.parallel import on_root
from catenary.postproc.evaluate.wording import duration
from catenary.postproc.files.disk_errors import code_of, reason, remedy

_PROC = Path("/proc")
_LARGEST_PID = 2**31
# Numbers of the SLURM jobs that a job waited for the end of, in its environment.
JOBS_ENDED = "CATENARY_JOBS_ENDED"
_JOB = re.compile(r"[0-9]{1,18}\.[0-9]{1,9}", re.ASCII)


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
    job : number of the SLURM job, a point, how often SLURM had started it again; empty elsewhere
    """

    host: str
    machine: str
    boot: str
    space: str
    pid: int
    started: str
    command: str
    since: str
    job: str = ""

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

    def after_job_of(self, other: Owner) -> bool:
        """Whether the SLURM job of ``other`` has ended: this one waited for its end, or is the same
        one started again."""
        if not other.job:
            return False
        number, mine = other.job.split("."), self.job.split(".")
        again = number[0] == mine[0] and int(number[-1]) < int(mine[-1])
        return again or number[0] in os.environ.get(JOBS_ENDED, "").split()

    @property
    def alive(self) -> bool:
        """Whether the process is there; only for those of the same process numbers."""
        return is_alive(self.pid) and _started(self.pid) in ("", self.started)


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
        job=_slurm_job(),
    )


def _slurm_job() -> str:
    job = f"{os.environ.get('SLURM_JOB_ID', '')}.{os.environ.get('SLURM_RESTART_COUNT') or 0}"
    return job if _JOB.fullmatch(job) else ""


def read_owner(text: str) -> Owner | None:
    """The owner that a lock file names, None if it is no whole lock file."""
    try:
        found = json.loads(text)
        owner = Owner(**{**found, "pid": int(found["pid"])})
    except (ValueError, TypeError, KeyError, RecursionError):
        return None
    words = (value for name, value in asdict(owner).items() if name != "pid")
    sound = all(isinstance(word, str) and (word.isprintable() or not word) for word in words)
    sound = sound and (not owner.job or _JOB.fullmatch(owner.job) is not None)
    return owner if sound and 0 < owner.pid < _LARGEST_PID else None


def _line(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8").strip()
    except (OSError, ValueError):  # not Linux
        return ""


def is_alive(pid: int) -> bool:
    """Whether a process of this number is there.

    One that has ended and whose parent has not taken its exit code yet (a zombie) is not.
    """
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:  # of another user
        pass
    return _stat(pid)[:1] != ["Z"]


def _namespace() -> str:
    try:
        return os.readlink(_PROC / "self/ns/pid")
    except OSError:
        return ""


def _started(pid: int) -> str:
    """Start of a process in the kernel's ticks since that of the machine; empty if unknown."""
    words = _stat(pid)
    return words[19] if len(words) > 19 else ""


def _stat(pid: int) -> list[str]:
    """Fields of /proc/PID/stat from the state on; empty if unknown."""
    return _line(_PROC / f"{pid}/stat").rpartition(")")[2].split()


LOCK_FILE = ".catenary.lock"
# Time between two signs of life [s], and after how many of them a lock counts as left behind.
HEARTBEAT = 30.0
SILENT = 20
_TRIES = 20


class FolderLock:
    """A result folder held by this process, from the call on. Not collective.

    Parameters
    ----------
    folder : made if it is not there, with its parents
    command : work of this process in words, for the message to others

    Raises
    ------
    InputError
        If another process holds it, or if the folder cannot be made or written to.
    """

    def __init__(self, folder: Path, command: str) -> None:
        self._made = _make(folder)
        self._stop = threading.Event()
        try:
            self._directory = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        except OSError as error:
            _remove(self._made)
            raise refusal(folder, error) from error
        try:
            self._handle = self._take(folder, myself(command))
        except BaseException as error:
            os.close(self._directory)
            _remove(self._made)
            if isinstance(error, OSError):
                raise refusal(folder, error) from error
            raise
        self._beat = threading.Thread(target=self._live, name="catenary-lock", daemon=True)
        self._beat.start()

    def release(self) -> None:
        """Remove the lock, and the folders made for it if nothing was written into them."""
        self._stop.set()
        self._beat.join()
        # By the folder's descriptor: it may have been moved, with the lock in it.
        with contextlib.suppress(OSError):
            if os.path.samestat(self._stat(LOCK_FILE), os.fstat(self._handle)):
                os.unlink(LOCK_FILE, dir_fd=self._directory)
        os.close(self._handle)
        os.close(self._directory)
        _remove(self._made)

    def _take(self, folder: Path, me: Owner) -> int:
        """Put the lock in place; returns its descriptor."""
        name = f"{LOCK_FILE}.{me.host}.{me.pid}"
        with contextlib.suppress(FileNotFoundError):  # of a dead process of the same number
            os.unlink(name, dir_fd=self._directory)
        handle = os.open(name, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o644, dir_fd=self._directory)
        try:
            os.write(handle, me.text().encode())
            os.fsync(handle)
            with contextlib.suppress(OSError):
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            for _ in range(_TRIES):
                if self._put(name, handle):
                    return handle
                self._clear(folder, me, handle)
            raise InputError(f"{folder / LOCK_FILE} changes hands all the time; try again")
        except BaseException:
            os.close(handle)
            raise
        finally:
            with contextlib.suppress(OSError):
                os.unlink(name, dir_fd=self._directory)

    def _put(self, name: str, handle: int) -> bool:
        """Give the file its name as the lock; False if there is a lock."""
        here = self._directory
        try:
            os.link(name, LOCK_FILE, src_dir_fd=here, dst_dir_fd=here, follow_symlinks=False)
        except FileExistsError:
            # Over NFS the answer to a link that was made may get lost, and it is tried again.
            return os.fstat(handle).st_nlink == 2
        except OSError as error:
            if error.errno not in (errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK):
                raise
            return self._rename(name)  # a file system without links
        return True

    def _rename(self, name: str) -> bool:
        try:
            claim = os.open(LOCK_FILE, os.O_CREAT | os.O_EXCL, dir_fd=self._directory)
        except FileExistsError:
            return False
        os.close(claim)
        os.rename(name, LOCK_FILE, src_dir_fd=self._directory, dst_dir_fd=self._directory)
        return True

    def _clear(self, folder: Path, me: Owner, mine: int) -> None:
        """Remove the lock that is there if its process is dead, else refuse."""
        try:
            if not stat.S_ISREG(self._stat(LOCK_FILE).st_mode):
                raise InputError(
                    f"{folder / LOCK_FILE} is a link, a pipe or a folder, and no lock of Catenary; "
                    "remove it"
                )
            # Without O_NONBLOCK a pipe that came meanwhile would be waited for.
            flags = os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK
            old = os.open(LOCK_FILE, flags, dir_fd=self._directory)
        except FileNotFoundError:
            return
        try:
            owner = read_owner(os.read(old, 65536).decode(errors="replace"))
            if not _dead(old, owner, me):
                raise InputError(_in_use(folder, owner, self._silence(old, mine)))
            # A dead lock is removed by who holds flock on it, so that it stays what it is from here
            # on: who comes later finds another file under its name.
            if not os.path.samestat(self._stat(LOCK_FILE), os.fstat(old)):
                return
            # Without flock the name may still have changed hands: then it is given back.
            aside = f"{LOCK_FILE}.{me.host}.{me.pid}.dead"
            os.rename(LOCK_FILE, aside, src_dir_fd=self._directory, dst_dir_fd=self._directory)
            if not os.path.samestat(self._stat(aside), os.fstat(old)):
                here = self._directory
                try:
                    os.link(aside, LOCK_FILE, src_dir_fd=here, dst_dir_fd=here)
                except FileExistsError:
                    pass
                except OSError:  # a file system without links
                    os.rename(aside, LOCK_FILE, src_dir_fd=here, dst_dir_fd=here)
                    return
            os.unlink(aside, dir_fd=self._directory)
        except FileNotFoundError:
            return
        finally:
            os.close(old)

    @staticmethod
    def _silence(old: int, mine: int) -> float:
        """Time since a lock's last sign of life [s], by the clock of the disk."""
        os.utime(mine)
        return max(0.0, os.fstat(mine).st_mtime - os.fstat(old).st_mtime)

    def _live(self) -> None:
        while not self._stop.wait(HEARTBEAT):
            with contextlib.suppress(OSError):
                os.utime(self._handle)

    def _stat(self, name: str) -> os.stat_result:
        return os.stat(name, dir_fd=self._directory, follow_symlinks=False)


@contextlib.contextmanager
def held(folder: Path, comm: Any, command: str) -> Iterator[None]:
    """A context in which this run alone writes into a folder. Collective.

    Raises
    ------
    InputError
        As ``FolderLock``, on all ranks.
    """
    locks: list[FolderLock] = []
    on_root(comm, lambda: locks.append(FolderLock(folder, command)))
    try:
        yield
    finally:
        for lock in locks:
            lock.release()


def refusal(folder: Path, error: OSError) -> InputError:
    """The sentence for a folder that cannot be made or written to."""
    fault, advice = reason(error), remedy(error)
    if code_of(error) in (errno.ENOTDIR, errno.EEXIST):
        blocked = next(
            (one for one in (folder, *folder.parents) if os.path.lexists(one) and not one.is_dir()),
            folder,
        )
        broken_link = blocked.is_symlink() and not blocked.exists()
        fault = f"{blocked} is {'a link that leads nowhere' if broken_link else 'no folder'}"
        advice = "choose another output folder"
    return InputError(
        f"the folder {folder} for the results cannot be made or written to ({fault}): {advice}"
    )


def _make(folder: Path) -> list[Path]:
    """Make a folder; returns those that were made, the outermost first."""
    made: list[Path] = []
    try:
        missing = [folder]
        while not missing[-1].exists() and missing[-1] != missing[-1].parent:
            missing.append(missing[-1].parent)
        for path in reversed(missing[:-1]):
            path.mkdir(exist_ok=True)
            made.append(path)
        if not folder.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR))
    except OSError as error:
        _remove(made)
        raise refusal(folder, error) from error
    return made


def _remove(made: list[Path]) -> None:
    """Remove folders unless something was written into them, which is the rule."""
    for path in reversed(made):
        with contextlib.suppress(OSError):
            path.rmdir()


def _dead(old: int, owner: Owner | None, me: Owner) -> bool:
    """Whether the process of a lock is no more, as far as that can be known."""
    let_go = False
    try:
        fcntl.flock(old, fcntl.LOCK_EX | fcntl.LOCK_NB)
        let_go = True
    except BlockingIOError:
        return False
    except OSError:  # a file system without flock
        pass
    if owner is None:
        return False
    if owner.same_processes(me):
        return not owner.alive
    # flock covers all containers on one kernel, and no other machine.
    ended = me.before_restart(owner) or me.after_job_of(owner)
    return ended or (owner.same_boot(me) and let_go)


def _in_use(folder: Path, owner: Owner | None, silence: float) -> str:
    """The sentence for who is refused; ``silence`` since the last sign of life [s]."""
    lock = folder / LOCK_FILE
    sign = f"its last sign of life is {duration(silence)} old"
    if owner is None:
        return (
            f"{folder} seems to be in use: {lock} names no process, {sign}; if no run is writing "
            "there, remove that file"
        )
    advice = "wait for its end, or choose another folder"
    if silence > SILENT * HEARTBEAT:
        advice = f"if that process has ended, remove {lock}; else {advice}"
    return f"{folder} is in use by {owner.in_words}, {sign}: {advice}"
