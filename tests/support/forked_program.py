"""Command lines of the program by way of ``forking_server.py``."""

from __future__ import annotations

import atexit
import functools
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

SERVER = Path(__file__).with_name("forking_server.py")


class Forks:
    """A server, which lives as long as the tests of this process."""

    def __init__(self) -> None:
        self._server = subprocess.Popen(
            [sys.executable, "-W", "error", str(SERVER)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
        )
        atexit.register(self.close)

    def run(
        self,
        words: list[str],
        folder: Path,
        environment: dict[str, str],
        limit: float,
        pictures: bool,
    ) -> tuple[int, str, str]:
        """Exit code and output of a command line; its pictures are painted if they are wanted.

        Raises
        ------
        subprocess.TimeoutExpired
            If it takes longer than ``limit`` [s]; it is killed.
        """
        with tempfile.TemporaryDirectory() as place:
            files = {name: Path(place, name) for name in ("stdout", "stderr")}
            for file in files.values():
                file.touch()
            request = {
                "words": words,
                "folder": str(folder),
                "environment": environment,
                "pictures": pictures,
                **{name: str(file) for name, file in files.items()},
            }
            assert self._server.stdin is not None and self._server.stdout is not None
            self._server.stdin.write(json.dumps(request).encode() + b"\n")
            process = int(self._server.stdout.readline())
            if not select.select([self._server.stdout], [], [], limit)[0]:
                os.kill(process, signal.SIGKILL)
                self._server.stdout.readline()
                raise subprocess.TimeoutExpired(words, limit)
            code = int(self._server.stdout.readline())
            return code, files["stdout"].read_text(), files["stderr"].read_text()

    def close(self) -> None:
        """End the server."""
        self._server.communicate()


@functools.cache
def forks() -> Forks:
    """The server of this process, started when it is first needed."""
    return Forks()
