"""Text as wide as the terminal that shows it; files, pipes and programs get whole lines."""

from __future__ import annotations

import os
import re
import sys
import textwrap
from typing import TextIO

# Columns of which a terminal has at least so many: narrower text is harder to read than torn lines.
_FEWEST = 40
# Blanks that stay within a line: before a unit, and before a mark at the end.
_KEPT = re.compile(r"(?<=\d) (?=(?:%|°|\w{1,2}(?:/\w+)?)(?!\w))| (?=\*$)")


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
    return columns if columns >= _FEWEST else None


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
        _KEPT.sub("\N{NO-BREAK SPACE}", line),
        width,
        subsequent_indent=below,
        break_long_words=False,
        break_on_hyphens=False,
        drop_whitespace=True,
        replace_whitespace=False,
    )
    return kept.replace("\N{NO-BREAK SPACE}", " ")
