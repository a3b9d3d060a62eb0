"""Control characters in the keys and texts of a scene."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from catenary.cases.scene.input.faults import MOST_TOLD, Fault
from catenary.cases.scene.input.origin import Origin
from catenary.cases.scene.input.plain_text import escaped, plain, steers

# Where a text may have several lines and tabs.
_PROSE = ("description", "source", "reason")
_SHOWN = 60


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
        for letter in value:
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
            if any(steers(letter) for letter in str(name)):
                yield Fault(
                    below,
                    f"{plain(below, 200)} {origin.of(key)} is a key with a control character",
                )
            else:
                yield from _texts(inner, below, origin)
    elif isinstance(value, list):
        for number, inner in enumerate(value):
            if isinstance(inner, str | dict | list):
                yield from _texts(inner, f"{key}.{number}", origin)
