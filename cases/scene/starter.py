"""A new case: the text of another one, made a beginning for somebody else's line."""

from __future__ import annotations

import itertools
import math
import os
import re
import tempfile
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from catenary.base.errors import InputError
from catenary.base.files import is_there
from catenary.cases.scene.input.case_files import CASE_FILE, find_case, read_toml
from catenary.cases.scene.input.csv_files import span_table
from catenary.cases.scene.input.faults import SceneError
from catenary.cases.scene.input.plain_text import plain, read_text, read_whole
from catenary.cases.scene.keys.units import USUAL, Usual, usual_range
from catenary.cases.scene.load import load_scene


@dataclass(frozen=True)
class Beginning:
    """A kind of line that a new case may begin with: the shipped case of it, and what differs.

    Attributes
    ----------
    case : name of the shipped case
    meaning : description of the line, for questions and help
    changes : pairs of a text in the case file and what stands there instead
    """

    case: str
    meaning: str
    changes: tuple[tuple[str, str], ...] = ()


# Tables of a planner beside a case.
SPANS_FILE, DROPPERS_FILE = "spans.csv", "droppers.csv"
_OF_TWO_MESSENGERS = (
    ('topology = "twin"', 'topology = "twin_messenger"'),
    ("# two of 120 mm2 as one", "# each, 120 mm2"),
    ("tension_N = 30000.0", "tension_N = 15000.0"),
    ("mass_kg_per_m = 2.1\n", "mass_kg_per_m = 1.05\n"),
    ("bending_stiffness_N_m2 = 260.0", "bending_stiffness_N_m2 = 130.0"),
)
BEGINNINGS: dict[str, Beginning] = {
    "simple": Beginning("ac_simple", "contact wire on droppers from a messenger wire"),
    "stitched": Beginning("re330_stitched", "the same with stitch wires at the supports"),
    "compound": Beginning("shinkansen_compound", "an auxiliary wire between the two"),
    "twin": Beginning("dc_twin", "two contact wires under one messenger wire"),
    "twin_messenger": Beginning(
        "dc_twin", "two simple catenaries side by side", _OF_TWO_MESSENGERS
    ),
    "single": Beginning("tramway", "a contact wire alone, without droppers"),
    "tramway": Beginning("tramway", "the same, as of tramways"),
    "conductor_rail": Beginning("conductor_rail", "an overhead conductor rail"),
}
# Places along the line in spans: the train starts, statistics begin and end; the same of --short.
_START, _RUN_IN, _JUDGED = 2, 8, 8
_SHORT_RUN_IN, _SHORT_JUDGED, _AFTER = 4, 2, 4


def write_case(
    folder: Path,
    kind: str,
    spans: Path | None = None,
    droppers: Path | None = None,
    complete: Callable[[Path], None] | None = None,
) -> Path:
    """Make a folder with a new case, and return its file. Not collective.

    Parameters
    ----------
    folder : the new folder, whose name is that of the case
    kind : a name of ``BEGINNINGS``, or a case: name of a shipped one, file or folder
    spans, droppers : CSV files of a planner, which are copied beside the case
    complete : is called with the folder in the making, and may write these tables anew

    Raises
    ------
    InputError
        If the folder is there already, if there is no such kind, or if a file does not fit. Nothing
        is written then.
    OSError
        If the folder cannot be made.
    """
    if is_there(folder):
        raise InputError(f"{folder} is there already: choose another name, or remove it")
    if droppers is not None and spans is None:
        raise InputError("--droppers needs --spans too: droppers hang in the spans of that file")
    copied = {SPANS_FILE: spans, DROPPERS_FILE: droppers}
    files = {name: read_whole(path, f"{path}") for name, path in copied.items() if path is not None}
    lengths = [] if spans is None else span_table(spans)
    text = starting_text(kind, Path(os.path.realpath(folder)).name, lengths, droppers is not None)
    there = next(path for path in folder.absolute().parents if path.is_dir())
    with tempfile.TemporaryDirectory(dir=there, prefix=".new-case") as made:
        inner = Path(made, "case")
        inner.mkdir()
        for name, content in files.items():
            (inner / name).write_bytes(content)
        (inner / CASE_FILE).write_text(text, encoding="utf-8")
        try:
            if complete is not None:
                complete(inner)
            load_scene(inner)
        except InputError as error:
            # Files are named by where they come from: those of the new folder were never there.
            sentence, n_more = error.faults[0].sentence, len(error.faults) - 1
            n_more += error.more if isinstance(error, SceneError) else 0
            for name, path in copied.items():
                sentence = sentence.replace(str(inner / name), str(path))
            sentence = sentence.replace(str(inner / CASE_FILE), f"the new case begun from {kind}")
            if spans is not None and droppers is None and "line.dropper" in sentence:
                sentence += ", or a planner's table by --droppers"
            raise InputError(sentence + f" (and {n_more} more)" * bool(n_more)) from error
        folder.parent.mkdir(parents=True, exist_ok=True)
        inner.rename(folder)
    return folder / CASE_FILE


def starting_text(kind: str, name: str, spans: Sequence[float] = (), droppers: bool = False) -> str:
    """The text of ``case.toml`` of a new case. Not collective.

    Parameters
    ----------
    kind : a name of ``BEGINNINGS``, or a case: name of a shipped one, file or folder
    name : name of the new case, for its title
    spans : lengths of all spans [m], as ``spans.csv`` beside the case has them; if empty the
        spans of the case that it begins as
    droppers : whether droppers stand in ``droppers.csv`` beside the case

    Raises
    ------
    InputError
        If there is no such kind, or if the spans are too few to run in, to judge and to run out.
    """
    begun = BEGINNINGS.get(kind, Beginning(kind, ""))
    try:
        path = find_case(begun.case)
    except InputError as error:
        raise InputError(
            f"there is no kind of line named {kind}: name one of {', '.join(BEGINNINGS)}, or a "
            f"case ({error})"
        ) from error
    of_case = read_toml(path).get("case", {})
    source = str(of_case.get("source", "") if isinstance(of_case, dict) else "")
    text = read_text(path, str(path))
    for old, new in begun.changes:
        assert text.count(old) == 1, f"{path} has {old!r} {text.count(old)} times"
        text = text.replace(old, new)
    body = re.sub(r"^# usual: .*\n", "", text[text.find("[line]") :], flags=re.MULTILINE)
    if not body.startswith("[line]"):
        raise InputError(f"{path} has no table [line], with which a new case begins; name another")
    if spans:
        body = _with_files(body, spans, droppers)
    origin = path.parent.name if path.name == CASE_FILE else path.stem
    head = (
        f"# {plain(name)}: a new case, begun from {origin}. Change what differs\n"
        "# on your line. `catenary list --keys WORD` explains keys.\n"
        '# Behind "usual" stands what other lines have, in the unit of the key.\n\n'
    )
    case = (
        f'[case]\ntitle = "{_quoted(name)}"\n'
        f'description = "Begun from {_quoted(origin)}."\n'
        f'source = "to be replaced; values of {_quoted(origin)}: {_quoted(source)}"\n\n'
    )
    return head + case + _with_usual_values(body)


def _quoted(text: str) -> str:
    return plain(text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " "))


def _with_usual_values(body: str) -> str:
    """The text with a comment above each key of which usual values are known."""
    lines, table = [], ""
    for line in body.splitlines():
        heading = re.match(r"\[+([\w.]+)\]+", line)
        if heading:
            table = re.sub(r"^pantographs\.\w+", "pantographs.*", heading[1])
        key = re.match(r"(\w+) =\s*([\d.e+-]*)", line)
        name = f"{table}.{key[1]}" if key else ""
        # What wires usually have says nothing of a rail, whose values are far from it.
        low, high = usual_range(name) or (-math.inf, math.inf)
        usual = USUAL.get(name, Usual()).words
        if usual and not (key and key[2] and not low <= float(key[2]) <= high):
            lines.append(f"# usual: {usual}")
        lines.append(line)
    return "\n".join(lines) + "\n"


def _with_files(body: str, spans: Sequence[float], droppers: bool) -> str:
    """The text with the planner's tables in place of its own spans and droppers."""
    n, places = len(spans), [0.0, *itertools.accumulate(spans)]
    # The last pantograph starts where a lone one does.
    begin = places[min(_START, n)] + _farthest_behind(body)
    start = next((i for i in range(_START, n) if places[i] >= begin), n)
    least = start + _SHORT_RUN_IN + _SHORT_JUDGED + _AFTER
    if n < least:
        raise InputError(
            f"--spans has {n} spans; a new case needs {least}, to run in, judge and run out"
        )
    body = _edited(body, "line", {"n_spans": None, "span_m": None, "spans_file": f'"{SPANS_FILE}"'})
    if "\n[line.transition]" in body:  # the file has their lengths, too
        body = _edited(body, "line.transition", {"span_m": None})
    if droppers:
        own = dict.fromkeys(("positions_m", "pre_sag_mm", "pre_sag_mid_mm", "count", "spacing_m"))
        body = _edited(body, "line.dropper", {**own, "patterns_file": f'"{DROPPERS_FILE}"'})
        if "\n[line.auxiliary_wire.dropper]" in body:  # hangs evenly, as spans differ
            even = {"positions_m": None, "count": "5", "spacing_m": "10.0"}
            body = _edited(body, "line.auxiliary_wire.dropper", even)
    first = min(start + _RUN_IN, start - _START + n // 3 + 1)
    last = min(first + _JUDGED, n - _AFTER)
    body = _edited(body, "train", {"start_m": f"{places[start]:.10g}"})
    judged = {"from_m": f"{places[first]:.10g}", "to_m": f"{places[last]:.10g}"}
    body = _edited(body, "evaluation", judged)
    short = start + _SHORT_RUN_IN
    overlap = f'"line.overlap.first_span" = {short}\n' if "\n[line.overlap]" in body else ""
    test = (
        f'[test]\n"line.n_spans" = {least}\n{overlap}'
        f'"evaluation.from_m" = {places[short]:.10g}\n'
        f'"evaluation.to_m" = {places[short + _SHORT_JUDGED]:.10g}\n'
    )
    return body.partition("[test]")[0].rstrip() + "\n\n" + test


def _farthest_behind(body: str) -> float:
    """Distance of the last pantograph behind the first one [m]."""
    train = tomllib.loads(body).get("train")
    listed = train.get("pantographs") if isinstance(train, dict) else None
    # What is no table or no number is refused when the new case is loaded.
    places = [place.get("behind_m") for place in listed or [] if isinstance(place, dict)]
    return max((float(x) for x in places if isinstance(x, int | float)), default=0.0)


def _edited(body: str, table: str, values: Mapping[str, str | None]) -> str:
    """The text with other values of keys of a table, as TOML; None takes a key away."""
    heading = re.search(rf"^\[{re.escape(table)}\].*\n", body, re.MULTILINE)
    if heading is None:
        raise InputError(f"the case that --topology names has no table [{table}]; name another")
    end = re.compile(r"^\[", re.MULTILINE).search(body, heading.end())
    stop = len(body) if end is None else end.start()
    own = body[heading.end() : stop]
    for key, value in values.items():
        new = "" if value is None else f"{key} = {value}\n"
        given = re.compile(rf"^{key} = (?:\[[^\]]*\])?.*\n", re.MULTILINE)
        own = given.sub(new, own) if given.search(own) else new + own
    return body[: heading.end()] + own + body[stop:]
