"""Values of a scene by dotted keys."""

from __future__ import annotations

from typing import Any


def value_at(tables: Any, key: str) -> Any:
    """What nested tables have under a dotted key, in which numbers are entries of lists; else None.

    Parameters
    ----------
    tables : of a scene, as ``resolved`` gives them
    """
    here = tables
    for part in key.split("."):
        if isinstance(here, list) and part.isdigit() and int(part) < len(here):
            here = here[int(part)]
        else:
            here = here.get(part) if isinstance(here, dict) else None
    return here


def is_number(value: Any) -> bool:
    """Whether a value is a number, which true and false are not."""
    return isinstance(value, int | float) and not isinstance(value, bool)
