"""Numbers in sentences and tables: no negative zero, one rank and two ranks."""

from __future__ import annotations


def fixed(value: float, digits: int) -> str:
    """``value`` with so many decimals, without a sign where it is rounded to zero."""
    text = f"{value:.{digits}f}"
    return text.removeprefix("-") if not text.strip("-0.") else text


def counted(number: int, noun: str, plural: str = "") -> str:
    """``1 rank``, ``2 ranks``; ``plural`` where an s at the end does not make it."""
    return f"{number} {noun if number == 1 else plural or f'{noun}s'}"
