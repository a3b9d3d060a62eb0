"""Numbers in sentences and tables, and sentences as wide as the terminal that shows them.

No negative zero, one rank and two ranks, decimals that tell. Files, pipes and programs get whole
lines.
"""

from __future__ import annotations

import math
import os
import re
import sys
import textwrap
from typing import TextIO

# Stands behind a limit that was not compared with the text of its standard, and explains itself.
UNCOMPARED = "*"
UNCOMPARED_SAYS = f"{UNCOMPARED} limit not compared with the text of the standard"
# Verdicts on a criterion or a figure, None of one that is not judged.
VERDICTS = {True: "passed", False: "FAILED", None: "not judged"}
# Further digits after which two numbers are printed in full.
_MOST_MORE = 9
# Columns of which a terminal has at least so many: narrower text is harder to read than torn lines.
_NARROWEST = 40
# Blanks that stay within a line: before a unit, and before a mark at the end.
_UNBROKEN = re.compile(r"(?<=\d) (?=(?:%|°|\w{1,2}(?:/\w+)?)(?!\w))| (?=\*$)")


def fixed(value: float, digits: int) -> str:
    """``value`` with so many decimals, without a sign where it is rounded to zero."""
    return without_sign_of_zero(f"{value:.{digits}f}")


def without_sign_of_zero(text: str) -> str:
    """A number as ``text``, without a sign where it is zero."""
    return text.removeprefix("-") if not text.strip("-0.") else text


def of_digits(value: float, digits: int) -> str:
    """``value`` to so many digits, large ones without powers of ten: ``12600``, ``0.0087``."""
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text else text


def stiffness_words(value: float) -> str:
    """A stiffness [N/m] with its unit, without powers of ten: ``433 N/m``, ``82.3 kN/m``."""
    return f"{value:g} N/m" if value < 1e4 else f"{1e-3 * value:.9g} kN/m"


def with_minus(text: str) -> str:
    """``text`` with a minus sign before its negative numbers, where it had a hyphen."""
    return re.sub(r"(?<!\S)-(?=\d)", "\u2212", text)


def wire_words(name: str) -> str:
    """A wire's name as words; those of the second section of an overlap are marked as such."""
    words = name.replace("_", " ")
    of_first = words.removesuffix(" next")
    return words if of_first == words else f"{of_first} (next section)"


def capital(text: str) -> str:
    """``text`` with a capital first letter, the others as they are."""
    return text[:1].upper() + text[1:]


def counted(number: int, noun: str) -> str:
    """``1 rank``, ``2 ranks``: a number with a noun whose plural ends in s."""
    return f"{number} {noun if number == 1 else f'{noun}s'}"


def duration(seconds: float) -> str:
    """A time in words, of some two digits: ``0.83 s``, ``42 s``, ``3.3 min``, ``2.1 h``."""
    if seconds < 90.0:
        return f"{seconds:.2g} s"
    return f"{seconds / 60.0:.2g} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


def decimals_that_tell(value: float | None, limit: float | None, fewest: int) -> int:
    """Decimals of a value and its limit with which different numbers print differently.

    Parameters
    ----------
    value, limit : float or None
        Numbers in one unit; NaN and None are printed with ``fewest``.
    fewest : int
        Decimals where the two differ by enough [-].
    """
    if value is None or limit is None or not math.isfinite(value) or not math.isfinite(limit):
        return fewest
    if value == limit:
        return fewest
    for decimals in range(fewest, fewest + _MOST_MORE):
        if f"{value:.{decimals}f}" != f"{limit:.{decimals}f}":
            return decimals
    return fewest + _MOST_MORE


def terminal_width(stream: TextIO | None = None) -> int | None:
    """Columns of the terminal that a stream writes to; None if it is none, or none that says so.

    Not collective.

    Parameters
    ----------
    stream : TextIO, optional
        Standard output if not given.
    """
    stream = sys.stdout if stream is None else stream
    try:
        if not stream.isatty():
            return None
        columns = os.get_terminal_size(stream.fileno()).columns
    except (AttributeError, OSError, ValueError):
        return None
    return columns if columns >= _NARROWEST else None


def folded(text: str, width: int | None) -> str:
    """Sentences in lines of at most ``width`` columns, whole ones without it.

    Rows of tables stay whole, and so do lines with options of a command, which are to be copied.
    """
    if width is None or max(map(len, text.splitlines()), default=0) <= width:
        return text
    return "\n".join(_folded(line, width) for line in text.split("\n"))


def _folded(line: str, width: int) -> str:
    if len(line) <= width or " --" in line:
        return line
    indent = len(line) - len(line.lstrip())
    gaps = [gap.end() for gap in re.finditer(r"\S {2,}(?=\S)", line)]
    # A word or two before a sentence, as ``REMARK``, leave it room beside; more are a row.
    if len(gaps) > 2 or (gaps and gaps[-1] > width // 2):
        return line
    below = " " * (gaps[-1] if gaps else indent + 2)
    kept = textwrap.fill(
        _UNBROKEN.sub("\N{NO-BREAK SPACE}", line),
        width,
        subsequent_indent=below,
        break_long_words=False,
        break_on_hyphens=False,
        drop_whitespace=True,
        replace_whitespace=False,
    )
    return kept.replace("\N{NO-BREAK SPACE}", " ")
