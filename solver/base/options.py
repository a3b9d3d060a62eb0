"""Options by name in sentences: those of the command line, or arguments of a Python program."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

_on_command_line = False


def option(flag: str, argument: str) -> str:
    """Name of an option as the user of this process writes it, for sentences. Not collective.

    Parameters
    ----------
    flag : str
        The option of a verb, such as ``--force``.
    argument : str
        The argument of the function of ``catenary`` that does the same, such as ``force=True``.
    """
    return flag if _on_command_line else argument


def is_command_line() -> bool:
    """Whether sentences name options of the command line. Not collective."""
    return _on_command_line


@contextmanager
def command_line(names_options: bool = True) -> Iterator[None]:
    """While entered, sentences of this process name options of the command line. Not collective."""
    global _on_command_line
    before, _on_command_line = _on_command_line, names_options
    try:
        yield
    finally:
        _on_command_line = before
