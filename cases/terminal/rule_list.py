"""``catenary list --rules``: rule books, and the criteria of one."""

from __future__ import annotations

import textwrap

from catenary.base.errors import InputError
from catenary.postproc.standards.book import Rule, RuleBook
from catenary.postproc.standards.library import DEFAULT, book_named, shipped
from catenary.postproc.standards.quantities import QUANTITIES

_WIDTH = 96


def book_table() -> str:
    """All shipped books: what chooses each, its title, how many criteria it has."""
    default, rows = book_named(DEFAULT).key, []
    for key, book in shipped().items():
        note = " (where a scene names none)" if key == default else ""
        rows.append(f"{key:18} {len(book.criteria):2} criteria  {book.title}{note}")
    return "\n".join(rows)


def criteria_text(name: str) -> str:
    """The criteria of a book with their limits and clauses.

    Raises
    ------
    InputError
        If there is no such book.
    """
    try:
        book = book_named(name)
    except InputError as unknown:
        shown = "".join(c if c.isprintable() else "?" for c in name[:80])
        raise InputError(f'"{shown}": {unknown}') from None
    lines = [f"{book.key}: {book.title}", *_folded(f"source: {' '.join(book.source.split())}")]
    for rule in book.criteria:
        lines += ["", *_about(book, rule)]
    return "\n".join(lines)


def _about(book: RuleBook, rule: Rule) -> list[str]:
    quantity = QUANTITIES[rule.quantity]
    of = f" (each {quantity.per})" if rule.per_pantograph else ""
    lines = [f"{rule.id}: {rule.title}"]
    lines += _folded(f"{rule.quantity}{of}: {quantity.meaning} [{quantity.unit}]")
    lines += _folded(f"limit {rule.words()}")
    lines += _folded(f"clause: {rule.clause}; {comparison(book, rule)}")
    return lines + (_folded(f"note: {rule.note}") if rule.note else [])


def comparison(book: RuleBook, rule: Rule) -> str:
    """Whether a limit was compared with the text of the standard."""
    if book.is_compared(rule):
        return "compared with the text"
    return "not compared with the text of the standard"


def _folded(text: str) -> list[str]:
    return textwrap.wrap(text, _WIDTH, initial_indent="    ", subsequent_indent="      ")
