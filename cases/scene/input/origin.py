"""Where a scene's keys were written, and values as sentences show them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from catenary.cases.scene.input.plain_text import plain

_SHOWN, _SOME, _DEEP = 60, 8, 3
COMMAND_LINE = "on the command line (--set)"


@dataclass(frozen=True)
class Origin:
    """Where a scene's keys were written: its file, pairs of a key that was assigned and the place
    of that, and pairs of a key and the file that its value was read from. Of a scene that a result
    recorded every key is written, also what its author left to the defaults."""

    file: str
    overridden: tuple[tuple[str, str], ...] = ()
    taken_in: tuple[tuple[str, str], ...] = ()
    recorded: bool = False

    def of(self, key: str) -> str:
        """Place of a key, with its preposition, for use in a sentence."""
        for above, file in self.taken_in:
            if key == above or key.startswith(above + "."):
                return f"in {file}"
        for given, where in reversed(self.overridden):
            if key == given or key.startswith(given + ".") or given.startswith(key + "."):
                return where
        return f"in {self.file}"

    def is_overridden(self, key: str) -> bool:
        """Whether just this key was assigned."""
        return any(key == given for given, _ in self.overridden)


def shown(value: Any) -> str:
    """A value as a person would write it, shortened."""
    return plain(_as_toml(value), _SHOWN)


def _as_toml(value: Any, depth: int = 0) -> str:
    """A value as TOML has it; of what is long or deep, the beginning."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list | tuple | dict) and depth == _DEEP:
        return "..."
    if isinstance(value, list | tuple):
        some = ", ".join(_as_toml(one, depth + 1) for one in value[:_SOME])
        return f"[{some}{', ...' if len(value) > _SOME else ''}]"
    if isinstance(value, dict):
        pairs = [f"{key} = {_as_toml(one, depth + 1)}" for key, one in list(value.items())[:_SOME]]
        return f"{{{', '.join(pairs)}{', ...' if len(value) > _SOME else ''}}}"
    if value is None:
        return "nothing"
    try:
        return str(value)
    except ValueError:
        return "a number of thousands of digits"
