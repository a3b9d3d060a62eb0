"""Whether two sweeps are of one scene: the records of both have its tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

# Tables that no figure of a variant depends on.
_IDLE = ("case", "output", "test")


def other_value(
    one: Mapping[str, Any], two: Mapping[str, Any], varied: Sequence[str]
) -> tuple[str, Any, Any] | None:
    """The first value in which two scenes differ and on which figures may depend: its key and both
    values. None if they do not differ.

    Parameters
    ----------
    one, two : tables of the scenes, as records of sweeps have them
    varied : keys that variants set, so that it does not matter what the scenes have there
    """
    for key, here, there in differences(one, two):
        sets = any(f"{key}.".startswith(f"{own}.") for own in varied)
        # Files may stand in other folders of other machines.
        elsewhere = key.endswith("file") and Path(str(here)).name == Path(str(there)).name
        if key.split(".")[0] not in _IDLE and not sets and not elsewhere:
            return key, here, there
    return None


def differences(one: Any, two: Any, key: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Keys of tables, and of lists of one length, with the values in which they differ."""
    pairs: list[tuple[str, Any, Any]]
    if isinstance(one, Mapping) and isinstance(two, Mapping):
        pairs = [(name, one.get(name), two.get(name)) for name in dict.fromkeys([*one, *two])]
    elif isinstance(one, list) and isinstance(two, list) and len(one) == len(two):
        pairs = [(str(i), a, b) for i, (a, b) in enumerate(zip(one, two, strict=True))]
    else:
        if one != two:
            yield key, one, two
        return
    for name, a, b in pairs:
        yield from differences(a, b, f"{key}.{name}" if key else name)
