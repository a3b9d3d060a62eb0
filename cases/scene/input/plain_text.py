"""Files and texts from anybody: bounded in size and depth, and without control characters."""

from __future__ import annotations

import os
import stat
import unicodedata
from pathlib import Path
from typing import Any

from catenary.base.errors import InputError

MOST_BYTES = 10_000_000  # an input file is written by hand or is a table; more is some other file
DEEPEST = 32  # tables in tables; the schema has no more than eight
_BOM = b"\xef\xbb\xbf"
# First bytes of files in place of which people have a text to give.
_PACKED = {
    b"\x1f\x8b": "compressed with gzip: unpack it",
    b"PK\x03\x04": "a workbook of a spreadsheet or a ZIP archive: export it as CSV, or unpack it",
}
# What steers a terminal, a spreadsheet or the direction of reading: control characters, invisible
# formats (bidirectional overrides among them), separators of lines, halves of pairs, private use.
_STEERS = ("Cc", "Cf", "Zl", "Zp", "Cs", "Co")
# Invisible, but part of how some languages are written.
_WRITTEN = "\u00ad\u200c\u200d"


def read_whole(path: Path, name: str) -> bytes:
    """Content of a regular file, at most ``MOST_BYTES``; never waits for a pipe or a device.

    Raises
    ------
    InputError
        If it is none, is larger or cannot be read; the sentence begins with ``name``.
    """
    try:
        # Without O_NONBLOCK opening a pipe waits until somebody writes into it.
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except (OSError, ValueError) as error:
        raise InputError(f"{name} cannot be read: {_why(error)}") from error
    mode = os.fstat(handle).st_mode
    if not stat.S_ISREG(mode):
        os.close(handle)
        kind = "a folder" if stat.S_ISDIR(mode) else "no regular file"
        raise InputError(f"{name} cannot be read: it is {kind}")
    with os.fdopen(handle, "rb") as stream:
        try:
            content = stream.read(MOST_BYTES + 1)
        except OSError as error:
            raise InputError(f"{name} cannot be read: {_why(error)}") from error
    if content is None:  # nothing is there yet, as in some files of the kernel
        raise InputError(f"{name} cannot be read: it is no regular file")
    if len(content) > MOST_BYTES:
        raise InputError(f"{name} is too large for an input file ({MOST_BYTES} bytes allowed)")
    return content


def decode(content: bytes, name: str) -> str:
    """The text of a file in UTF-8, without a byte order mark.

    Raises
    ------
    InputError
        If it is something else; the sentence begins with ``name``.
    """
    for mark in (b"\xff\xfe", b"\xfe\xff"):
        if content.startswith(mark):
            raise InputError(f"{name} is a text file in UTF-16; save it in UTF-8")
    for mark, kind in _PACKED.items():
        if content.startswith(mark):
            raise InputError(f"{name} is {kind}")
    try:
        return content.removeprefix(_BOM).decode("utf-8")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError(
            f"{name} is not a text file in UTF-8 (byte {error.start}, in line {line}); "
            "save it in UTF-8"
        ) from None


def read_text(path: Path, name: str) -> str:
    """The text of a file in UTF-8, as ``read_whole`` and ``decode``."""
    return decode(read_whole(path, name), name)


def steers(letter: str) -> bool:
    """Whether a character does something else than to be seen."""
    if letter.isprintable() or letter in _WRITTEN:
        return False
    return unicodedata.category(letter) in _STEERS


def plain(text: str, most: int | None = None) -> str:
    """``text`` with what cannot be seen written as escapes, cut to ``most`` characters."""
    cut = text if most is None or len(text) <= most else text[: most - 3] + "..."
    return "".join(letter if letter.isprintable() else escaped(letter) for letter in cut)


def shown(text: str) -> str:
    """``text`` of several lines for a terminal, with what would steer it written as escapes."""
    return "".join(escaped(one) if one != "\n" and steers(one) else one for one in text)


def escaped(letter: str) -> str:
    """A character as an escape, such as those of TOML."""
    known = {"\n": "\\n", "\t": "\\t", "\r": "\\r"}
    code = ord(letter)
    return known.get(letter) or (f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}")


def refuse_deep(raw: Any, name: str) -> None:
    """Raise ``InputError`` if tables are nested deeper than ``DEEPEST``."""
    level = [raw]
    for _ in range(DEEPEST):
        level = [below for one in level for below in _below(one)]
        if not level:
            return
    raise InputError(f"{name} is nested too deeply: more than {DEEPEST} tables in each other")


def _below(one: Any) -> list[Any]:
    inner = one.values() if isinstance(one, dict) else one if isinstance(one, list) else ()
    return [value for value in inner if isinstance(value, dict | list)]


def _why(error: Exception) -> str:
    if isinstance(error, OSError):
        return (error.strerror or "no reason is given").lower()
    return "no file can have that name"
