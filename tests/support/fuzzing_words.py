"""Words of a random scene: keys and their values as they are assigned."""

from __future__ import annotations

Words = dict[str, object]
# Share of the scenes that have each of the parts that are drawn now and then.
NOW_AND_THEN = 0.2


def as_assignments(words: Words) -> tuple[str, ...]:
    """``key=value`` each."""
    return tuple(
        f"{key}={value if isinstance(value, str) else repr(value)}" for key, value in words.items()
    )
