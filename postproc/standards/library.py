"""The shipped rule books: TOML files in ``books``, found from the folder."""

from __future__ import annotations

import difflib
import functools
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from catenary.base.errors import InputError
from catenary.postproc.standards.book import RuleBook, book_of

_FOLDER = Path(__file__).with_name("books")
# By which a run is judged whose scene names no book: the newest edition of it.
DEFAULT = "en50367"


@functools.cache
def shipped() -> dict[str, RuleBook]:
    """All shipped books by ``name:edition``, editions in their order."""
    books = (
        book_of(tomllib.loads(path.read_text(encoding="utf-8")), str(path))
        for path in sorted(_FOLDER.glob("*.toml"))
    )
    return {book.key: book for book in books}


def book_named(name: str) -> RuleBook:
    """The shipped book that ``name:edition`` names; the newest edition of ``name`` alone.

    Raises
    ------
    InputError
        If there is none.
    """
    known = shipped()
    if name in known:
        return known[name]
    editions = [book for book in known.values() if book.name == name]
    if editions:
        return max(editions, key=lambda book: book.edition)
    near = difflib.get_close_matches(name[:100].lower(), known, n=1)
    meant = f"did you mean {near[0]}? It" if near else "it"
    raise InputError(
        f"there is no rule book of that name; {meant} must be one of {', '.join(known)}"
    )


def editions_of(name: str) -> Sequence[str]:
    """Editions of a book, the newest last."""
    return sorted(book.edition for book in shipped().values() if book.name == name)


def books_of_entries(entries: Sequence[str | dict[str, Any]]) -> list[RuleBook]:
    """Books of names, and of whole tables.

    Raises
    ------
    InputError
        If a name is unknown, a table no book, or two books have the same name and edition.
    """
    books = [
        book_named(entry) if isinstance(entry, str) else book_of(entry, "the book of the scene")
        for entry in entries
    ]
    keys = [book.key for book in books]
    twice = next((key for key in keys if keys.count(key) > 1), None)
    if twice is not None:
        raise InputError(f"the rule book {twice} is named twice")
    return books
