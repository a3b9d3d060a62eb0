"""Imported before the program: it examines files in a process that is forked from it, which HDF5
may crash as one of its own, and not in a new one, which imports as much again."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from pathlib import Path
from types import ModuleType
from typing import IO, NoReturn

from on_import import on_import


def _examine_in_forks(guard: ModuleType) -> None:
    def child(words: list[str], limit: float) -> subprocess.CompletedProcess[bytes]:
        with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
            process = os.fork()
            if process == 0:
                _become(guard, words, out, err)
            code = _ended(process, words, limit)
            out.seek(0)
            err.seek(0)
            return subprocess.CompletedProcess(words, code, out.read(), err.read())

    assert callable(guard._child)
    setattr(guard, "_child", child)  # noqa: B010


def _become(guard: ModuleType, words: list[str], out: IO[bytes], err: IO[bytes]) -> NoReturn:
    """Do what a process with these words does, and end."""
    code = 1
    try:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_DFL)
        os.dup2(err.fileno(), 2)
        option, what, path = words[:3]
        if (option, what) == ("-m", guard.__name__):
            out.write(guard.examine(Path(path)).encode())
        else:
            assert option == "-c", words
            sys.argv = ["-c", path]
            sys.stdout = open(os.devnull, "w")  # noqa: SIM115
            exec(what, {})
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 0
    except BaseException:
        os.write(2, traceback.format_exc().encode())
    finally:
        out.flush()
        os._exit(code)


def _ended(process: int, words: list[str], limit: float) -> int:
    """Exit code of a process; it is killed if it takes longer than ``limit`` [s]."""
    last = time.monotonic() + limit
    while True:
        ended, status = os.waitpid(process, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        if time.monotonic() > last:
            os.kill(process, signal.SIGKILL)
            os.waitpid(process, 0)
            raise subprocess.TimeoutExpired(words, limit)
        time.sleep(0.002)


on_import("catenary.postproc.read.guard", _examine_in_forks)
