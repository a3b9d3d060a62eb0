"""Ways to break a scene of any topology: nonsense in any key that scenes may have, strange keys."""

from __future__ import annotations

import random
from functools import cache
from typing import NamedTuple

from scenes import Scene

from catenary.cases.scene.keys.keys import known_keys

# No value of any key, whatever its type.
_NO_VALUE = ("nan", "[nan]", "[[nan]]", "[[],3]", "{strange=nan}", "2026-01-01")
# Keys below which a scene may write nearly all it likes, until that is applied.
_FREE = ("test", "petsc")
_NAMES = {"pantographs": "reference", "per_component": "droppers", "weights_kg": "contact_wire"}


class Way(NamedTuple):
    """An assignment that breaks a scene, and a word that the sentence has to have."""

    assignment: str
    names: str


@cache
def all_keys() -> tuple[str, ...]:
    """Every key that scenes may have, with a name or the first entry where they choose."""
    return tuple(_named(key) for key in known_keys(Scene) if key.split(".")[0] not in _FREE)


def _named(key: str) -> str:
    parts = key.split(".")
    for i, part in enumerate(parts):
        if part == "*":
            parts[i] = _NAMES.get(parts[i - 1], "0")
    return ".".join(parts)


def nonsense(rng: random.Random) -> Way:
    """Nonsense in one of all keys, or a strange key beside one."""
    key = rng.choice(all_keys())
    if rng.random() < 0.75:
        return Way(f"{key}={rng.choice(_NO_VALUE)}", key.split(".")[0])
    return Way(f"{key}_{rng.randrange(100)}=1.0", key.split(".")[0])
