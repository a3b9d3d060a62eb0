"""Numbers that stand in CSV files, and rule books, put into the scene in place of the files' names.

A result then holds the numbers themselves, and does not change with the file. Courses and curves
are pairs of numbers. Tables of spans and of droppers, and surveys of a line, have columns with
names, as planners export them: separated by commas, or by semicolons or tabs with decimal points or
decimal commas.
"""

from __future__ import annotations

import csv
import difflib
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from catenary.base.errors import InputError
from catenary.cases.scene.input.case_files import read_toml, value_at
from catenary.cases.scene.input.faults import Fault, Origin, shown
from catenary.cases.scene.input.plain_text import read_text
from catenary.postproc.standards.rule_books import book_of

_LONGEST_NAME = 1000
_QUOTED_COMMA = re.compile(r'"[^",]*,[^"]*"')
# Of a number in a table whose columns stand between commas.
DECIMAL_COMMAS = "write decimal points, or semicolons or tabs between columns"
# A line whose largest pre-sag is smaller has none: such a table was written in metres [mm].
LEAST_PRE_SAG = 0.2


def take_in_files(
    raw: dict[str, Any], origin: Origin, folder: Path | None
) -> tuple[Origin, list[Fault]]:
    """Replace keys ``..._file`` of a raw scene by the numbers that the files hold, in place.

    Returns where all keys were written then, and faults: a file is not there, holds something else,
    or stands beside the numbers themselves.

    Names in the case file are relative to its ``folder``, those of the command line to the working
    directory.
    """
    taken, faults = list(origin.taken_in), []
    most: int | None = None  # spans of a file, of which the scene may take the first ones alone
    for where, table, named, key, read in _files_of(raw):
        name = table.pop(named)
        file_key, pairs_key = f"{where}.{named}", f"{where}.{key}"
        base = Path.cwd() if folder is None or origin.is_overridden(file_key) else folder
        path, begin = base / name, f"{file_key} is {_named(name)} {origin.of(file_key)}"
        try:
            if read is _book:
                _refuse_outside(path, base, begin)
            if key in table:
                raise InputError(
                    f"{file_key} is {shown(name)} {origin.of(file_key)}; {pairs_key} is given too: "
                    "take one of them away"
                )
            if read is _patterns:
                table[key] = _patterns(path, begin, raw, most)
            else:
                table[key] = read(path, begin, raw)
            if read is _spans:
                most = len(span_table(path))
            taken.append((pairs_key, str(path)))
        except InputError as error:
            faults.append(Fault(where, str(error)))
            if read is _spans:  # nothing more is said of what the file would have given
                table.update(span_m=[50.0], n_spans=1000)
    return replace(origin, taken_in=tuple(taken)), faults


def absolute_names(raw: dict[str, Any], folder_of: Callable[[str], Path]) -> None:
    """Write every name of a file with numbers as a path from the root, in place; by its key
    ``folder_of`` says to which folder it is relative. A rule book takes the place of its name: it
    stands in that folder and in no other.

    Raises
    ------
    InputError
        If a rule book does not stand there, or is none.
    """
    for where, table, named, key, read in _files_of(raw):
        base, name = folder_of(f"{where}.{named}"), table[named]
        if read is _book:
            sentence = f"{where}.{named} is {_named(name)}"
            _refuse_outside(base / name, base, sentence)
            table[key] = read(base / table.pop(named), sentence, raw)
        else:
            table[named] = str(base / name)


def file_key_of(key: str, origin: Origin) -> str | None:
    """The key that named the file from which a scene has the numbers of a dotted ``key``.

    None if no file gave them. ``origin`` is that of the scene. Who gives the numbers anew takes
    the name of the file away.
    """
    if key not in dict(origin.taken_in):
        return None
    above, _, last = key.rpartition(".")
    pattern = re.sub(r"\.\d+(?=\.)", ".*", f"{above}.")[:-1]
    named = (name for where, name, own, _ in _files() if (where, own) == (pattern, last))
    return f"{above}.{next(named)}"


# Reader of a file, called with its path, the begin of a sentence about it, and the raw scene.
_Read = Callable[[Path, str, dict[str, Any]], Any]


def _files() -> Iterator[tuple[str, str, str, _Read]]:
    """Tables that may name files, the key of the name, the key of the numbers, and what reads the
    file. Spans come before the droppers in them."""
    for where in ("vehicle.vertical", "vehicle.lateral"):
        yield where, "by_time_file", "by_time", _pairs
        yield where, "by_place_file", "by_place", _pairs
    yield "evaluation", "rules_file", "own_rules", _book
    yield "line", "spans_file", "span_m", _spans
    for where in ("line.dropper", "line.auxiliary_wire.dropper", "line.links.*"):
        yield where, "curve_file", "curve", _pairs
        yield where, "patterns_file", "patterns", _patterns
    yield "irregularities.contact_wire_height", "by_place_file", "by_place", _heights
    yield "irregularities.running_surface", "by_place_file", "by_place", _heights
    yield "irregularities.dropper_lengths", "by_dropper_file", "by_dropper", _lengths


def _files_of(raw: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any], str, str, _Read]]:
    """As ``_files``, those that a raw scene names, behind the key of each table the table."""
    links = value_at(raw, "line.links")
    n_links = len(links) if isinstance(links, list) else 0
    for pattern, named, key, read in _files():
        one_each = range(n_links) if "*" in pattern else (0,)
        for where in (pattern.replace("*", str(number)) for number in one_each):
            table = value_at(raw, where)
            name = table.get(named) if isinstance(table, dict) else None
            if isinstance(name, str) and name:
                yield where, table, named, key, read


def _refuse_outside(path: Path, base: Path, where: str) -> None:
    try:
        inside = path.resolve().is_relative_to(base.resolve())
    except (OSError, ValueError, RuntimeError):  # names too long, null bytes, links in a circle
        inside = False
    if not inside:
        raise InputError(f"{where}; it must stand in the folder of its scene")


def _book(path: Path, where: str, raw: dict[str, Any]) -> dict[str, Any]:
    """The table of a rule book, which is one."""
    table = read_toml(path)
    book_of(table, f"{where}, which")
    return table


def span_table(path: Path, where: str = "") -> list[float]:
    """Lengths of all spans of a file [m]; ``where`` begins sentences about it.

    Raises
    ------
    InputError
        If it is no such table.
    """
    where = where or f"the table of spans is {_named(str(path))}"
    rows = _rows(path, where, {"span_m": True, "span": False})
    for count, (number, row) in enumerate(rows, start=1):
        if row.get("span", count) != count:
            raise InputError(f"{where}; its line {number} must be about span {count}")
    return [row["span_m"] for _, row in rows]


def _spans(path: Path, where: str, raw: dict[str, Any]) -> list[float]:
    """Lengths of all spans [m]; their number if the scene does not say it, the first ones if it
    says fewer."""
    lengths = span_table(path, where)
    wanted = raw["line"].setdefault("n_spans", len(lengths))
    if isinstance(wanted, int) and wanted > len(lengths):
        raise InputError(
            f"{where}; it has {len(lengths)} spans, and line.n_spans is {wanted}: leave that out"
        )
    return lengths[:wanted] if isinstance(wanted, int) and wanted > 0 else lengths


# Columns of a table of droppers, and whether they must be there.
DROPPER_COLUMNS = {"span": True, "position_m": True, "pre_sag_mm": False}


def dropper_table(
    path: Path, where: str, columns: dict[str, bool]
) -> dict[int, list[dict[str, float]]]:
    """Droppers of each span by its number, each by names of columns; ``where`` begins sentences.

    Raises
    ------
    InputError
        If it is no table with these columns, in the order of spans and positions.
    """
    hung: dict[int, list[dict[str, float]]] = {}
    before, last = 0.0, 0.0
    for number, row in _rows(path, where, columns):
        span, position = row["span"], row["position_m"]
        if span < 1 or span != int(span) or span < before:
            raise InputError(
                f"{where}; its line {number} must have the number of a span, from 1 on in "
                f"ascending order, and has {span:g}"
            )
        if span == before and position <= last:
            raise InputError(
                f"{where}; its line {number} must have a position greater than the {last:g} m of "
                f"the dropper before it in span {span:g}, and has {position:g}"
            )
        before, last = span, position
        hung.setdefault(int(span), []).append(row)
    return hung


def _patterns(
    path: Path, where: str, raw: dict[str, Any], n_in_file: int | None = None
) -> list[dict[str, Any]]:
    """Droppers of all spans, like spans together; spans beyond the line are left out.

    Those of ``n_in_file`` spans, if their lengths stand in a file: other spans are another line's.
    """
    hung = dropper_table(path, where, DROPPER_COLUMNS)
    if n_in_file is not None and max(hung) > n_in_file:
        raise InputError(
            f"{where}; it has droppers of span {max(hung)}, and line.spans_file has {n_in_file} "
            "spans: do both belong to this line?"
        )
    n = raw["line"].get("n_spans")
    most = n if isinstance(n, int) else max(hung)
    like: dict[tuple[tuple[float, ...], ...], list[int]] = {}
    most_sag = max(abs(row.get("pre_sag_mm", 0.0)) for own in hung.values() for row in own)
    if 0.0 < most_sag < LEAST_PRE_SAG:
        raise InputError(
            f"{where}; its largest pre_sag_mm is {most_sag:g}: is it {most_sag:g} m? write "
            f"{1e3 * most_sag:g}"
        )
    first = next(iter(hung.values()))[0]
    names = [name for name in ("position_m", "pre_sag_mm") if name in first]
    for span, own in hung.items():
        if span <= most:
            columns = tuple(tuple(row[name] for row in own) for name in names)
            like.setdefault(columns, []).append(span)
    keys = ("positions_m", "pre_sag_mm")
    return [
        {"spans": spans} | {key: list(own) for key, own in zip(keys, columns, strict=False)}
        for columns, spans in like.items()
    ]


def _heights(path: Path, where: str, raw: dict[str, Any]) -> list[list[float]]:
    """Pairs of place and height [m] of a survey."""
    rows = _rows(path, where, {"place_m": True, "height_mm": True})
    return [[row["place_m"], row["height_mm"] / 1000.0] for _, row in rows]


def _lengths(path: Path, where: str, raw: dict[str, Any]) -> list[list[float]]:
    """Span, number of the dropper and error [mm] of a survey."""
    found: list[list[float]] = []
    lines: dict[tuple[float, float], int] = {}
    for number, row in _rows(path, where, {"span": True, "dropper": True, "error_mm": True}):
        for name in ("span", "dropper"):
            if row[name] < 1 or row[name] != int(row[name]):
                raise InputError(
                    f"{where}; its line {number} must have a {name} from 1 on, a whole number, "
                    f"and has {row[name]:g}"
                )
        own = row["span"], row["dropper"]
        if (first := lines.setdefault(own, number)) != number:
            raise InputError(
                f"{where}; its line {number} is about dropper {own[1]:g} of span {own[0]:g}, as "
                f"line {first} is: give one error of each"
            )
        found.append([*own, row["error_mm"]])
    return found


def _rows(path: Path, where: str, columns: dict[str, bool]) -> list[tuple[int, dict[str, float]]]:
    """Lines of a table with their numbers in the file, by the names of its columns.

    ``columns`` says which there may be, and whether they must be there.
    """
    text = read_text(path, f"{where}; it")
    lines = [line.split("#")[0].strip() for line in text.splitlines()]
    first = next(filter(None, lines), "")  # with the names
    separator = next((one for one in ";\t" if one in first), ",")
    named: list[str] = []
    rows: list[tuple[int, dict[str, float]]] = []
    for number, line in enumerate(lines, start=1):
        cells = [cell.strip().strip('"') for cell in line.split(separator)]
        if not any(cells):
            continue
        if not named:
            named = cells
            _check_names(where, named, columns)
            continue
        if separator != ",":
            cells = [cell.replace(",", ".") for cell in cells]
        try:
            values = [float(cell) for cell in cells]
        except ValueError:
            values = []
        quoted = separator == "," and _QUOTED_COMMA.search(line) is not None
        if quoted or len(values) != len(named) or not all(map(math.isfinite, values)):
            more = quoted or (separator == "," and len(cells) > len(named))
            raise InputError(
                f"{where}; its line {number} must hold a number for each of {', '.join(named)}, "
                f"and is {shown(line)}" + (f": {DECIMAL_COMMAS}" if more else "")
            )
        rows.append((number, dict(zip(named, values, strict=True))))
    if not rows:
        raise InputError(f"{where}; it holds no line of numbers below the names of columns")
    return rows


def _check_names(where: str, named: list[str], columns: dict[str, bool]) -> None:
    takes = f"it takes {', '.join(columns)}"
    for name in named:
        if name == "length_m" and name not in columns and "position_m" in columns:
            raise InputError(
                f"{where}; droppers are cut for the pre-sag, so that it takes no length_m: give "
                "pre_sag_mm, which `catenary new --droppers` finds from lengths"
            )
        if name not in columns:
            near = difflib.get_close_matches(name, columns, n=1)
            meant = f"did you mean {near[0]}? " if near else ""
            raise InputError(f"{where}; its column {shown(name)} is unknown: {meant}{takes}")
        if named.count(name) > 1:
            raise InputError(f"{where}; it has several columns {name}")
    missing = [name for name, needed in columns.items() if needed and name not in named]
    if missing:
        raise InputError(
            f"{where}; it has no column {missing[0]}: its first line names the columns, and {takes}"
        )


def _pairs(path: Path, where: str, raw: dict[str, Any]) -> list[list[float]]:
    """Two columns of numbers; comments after #, and one line of names before the numbers."""
    text = read_text(path, f"{where}; it")
    pairs: list[list[float]] = []
    named = False
    for number, cells in enumerate(csv.reader(text.splitlines()), start=1):
        line = [cell.strip() for cell in ",".join(cells).split("#")[0].split(",")]
        if line == [""]:
            continue
        try:
            values = [float(cell) for cell in line]
        except ValueError:
            values = []
        if len(values) == 2:
            pairs.append(values)
        elif pairs or named:
            raise InputError(
                f"{where}; its line {number} must hold two numbers and a comma between"
                + (", each with a decimal point" if len(line) > 2 else "")
            )
        else:
            named = True
    if not pairs:
        raise InputError(f"{where}; it holds no pairs of numbers")
    return pairs


def _named(name: str) -> str:
    """A file's name, whole if it can be one, otherwise its end."""
    return f'"{name}"' if len(name) <= _LONGEST_NAME and name.isprintable() else shown(name)
