"""Options by name in sentences: those of the command line, or arguments of a Python program."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple, get_type_hints

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


class Bounds(NamedTuple):
    """Least and greatest value of an option of the command line."""

    least: float
    most: float


def flag_of(group: type, field: str) -> str:
    """The option of the command line that a field of a dataclass is. Not collective.

    It is a text in the annotation, ``Annotated[float, "--from"]``.
    """
    flag: str = get_type_hints(group, include_extras=True)[field].__metadata__[0]
    return flag


def named(asked: Any, field: str) -> str:
    """Name of a field of a dataclass as the user of this process writes it. Not collective."""
    return option(flag_of(type(asked), field), field)


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
