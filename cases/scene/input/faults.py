"""Faults of a scene: where its keys were written, sentences about them, errors that hold them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from catenary.base.errors import Fault, InputError
from catenary.base.options import option
from catenary.cases.scene.input.plain_text import escaped, plain, steers

_SHOWN, _SOME, _DEEP = 60, 8, 3
COMMAND_LINE = "on the command line (--set)"


@dataclass(frozen=True)
class Origin:
    """Origin of a scene's keys: its file, pairs of a key that was assigned and the place
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


def shown_word(word: str) -> str:
    """A word as `shown`, without its quotes unless it is empty."""
    return shown(word)[1:-1] or shown(word)


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


# More sentences than these nobody reads; the rest is counted.
MOST_TOLD = 50


class SceneError(InputError):
    """A scene with faults. As text it is the first one's sentence and how many there are more.

    Attributes
    ----------
    faults : at least one, the most likely cause first, at most ``MOST_TOLD``
    more : how many others there are
    """

    def __init__(self, faults: Sequence[Fault], more: int = 0) -> None:
        self._of_scene = tuple(faults[:MOST_TOLD])
        self.more = more + max(0, len(faults) - MOST_TOLD)
        others = len(self.faults) - 1 + self.more
        text = self.faults[0].sentence
        listed = option(": `catenary check` lists them", ", in the attribute faults")
        super().__init__(f"{text} (and {others} more{listed})" if others else text)

    def __reduce__(self) -> tuple[type[SceneError], tuple[tuple[Fault, ...], int]]:
        """Ranks send it to each other."""
        return type(self), (self.faults, self.more)

    def lines(self) -> list[str]:
        """One sentence for each fault, and one that counts the rest."""
        sentences = [fault.sentence for fault in self.faults]
        return sentences + ([f"there are {self.more} more faults"] if self.more else [])


class UnfitScene(SceneError):
    """A scene whose values are allowed one by one, and do not fit together or are implausible."""


# Keys whose text may have several lines and tabs.
_PROSE = ("description", "source", "reason")


def text_faults(raw: Any, origin: Origin) -> list[Fault]:
    """A fault for each key and each text with a control character, ``MOST_TOLD`` at most."""
    found: list[Fault] = []
    for fault in _texts(raw, "", origin):
        found.append(fault)
        if len(found) == MOST_TOLD:
            break
    return found


def _texts(value: Any, key: str, origin: Origin) -> Iterator[Fault]:
    if isinstance(value, str):
        prose = key.rsplit(".", 1)[-1] in _PROSE
        for letter in "" if value.isprintable() else value:
            if steers(letter) and not (prose and letter in "\n\t\r"):
                yield Fault(
                    key,
                    f'{plain(key)} is "{plain(value, _SHOWN)}" {origin.of(key)}; it must not hold '
                    f"the control character {escaped(letter)}",
                )
                return
    elif isinstance(value, dict):
        for name, inner in value.items():
            below = f"{key}.{name}" if key else str(name)
            if not str(name).isprintable() and any(map(steers, str(name))):
                yield Fault(
                    below, f"{plain(below, 200)} {origin.of(key)} is a key with a control character"
                )
            else:
                yield from _texts(inner, below, origin)
    elif isinstance(value, list):
        for number, inner in enumerate(value):
            if isinstance(inner, str | dict | list):
                yield from _texts(inner, f"{key}.{number}", origin)
