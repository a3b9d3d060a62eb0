"""Keeps Python's signal handlers where a library installs its own. A leaf module.

PETSc takes nearly all signals when it starts; Gmsh, which is linked with a PETSc of its own, sets
them back to the system's, under which SIGTERM and SIGHUP end the process without a word.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def python_signals_kept() -> Iterator[None]:
    """A context after which signals are handled as Python has it. Not collective.

    Signals that come meanwhile are handled at the end. Only the main thread can do so.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    kept = {}
    for number in signal.valid_signals():
        handler = signal.getsignal(number)
        if callable(handler) or handler == signal.SIG_IGN:
            kept[number] = handler
    before = signal.pthread_sigmask(signal.SIG_BLOCK, kept)
    try:
        yield
    finally:
        for number, handler in kept.items():
            signal.signal(number, handler)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
