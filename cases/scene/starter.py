"""The text of a new case: that of a shipped one, made a beginning for somebody else's line."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from catenary.base.errors import InputError
from catenary.cases.scene.input.case_files import CASE_FILE, shipped
from catenary.cases.scene.input.csv_files import span_table
from catenary.cases.scene.input.plain_text import plain, read_whole
from catenary.cases.scene.input.toml_input import read_toml
from catenary.cases.scene.keys.usual_values import TYPICAL
from catenary.cases.scene.load import load_scene


@dataclass(frozen=True)
class Beginning:
    """A kind of line that a new case may begin with: the shipped case of it, and what differs.

    Attributes
    ----------
    case : name of the shipped case
    meaning : what the line is, for questions and help
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
    kind : a name of ``BEGINNINGS``, or of a shipped case
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
    if folder.exists():
        raise InputError(f"{folder} is there already: choose another name, or remove it")
    if droppers is not None and spans is None:
        raise InputError("--droppers needs --spans too: droppers hang in the spans of that file")
    copied = {SPANS_FILE: spans, DROPPERS_FILE: droppers}
    files = {name: read_whole(path, f"{path}") for name, path in copied.items() if path is not None}
    lengths = [] if spans is None else span_table(spans)
    text = starting_text(kind, folder.resolve().name, lengths, droppers is not None)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".new-case") as made:
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
            # The files are named by where they come from: the folder was never there.
            raise InputError(str(error).replace(str(inner), str(folder))) from error
        inner.rename(folder)
    return folder / CASE_FILE


def starting_text(kind: str, name: str, spans: Sequence[float] = (), droppers: bool = False) -> str:
    """The text of ``case.toml`` of a new case. Not collective.

    Parameters
    ----------
    kind : a name of ``BEGINNINGS``, or of a shipped case
    name : name of the new case, for its title
    spans : lengths of all spans [m], which stand in ``spans.csv`` beside the case; those of the
        shipped case if empty
    droppers : whether droppers stand in ``droppers.csv`` beside the case

    Raises
    ------
    InputError
        If there is no such kind, or if the spans are too few to run in, to judge and to run out.
    """
    begun = BEGINNINGS.get(kind) or (Beginning(kind, "") if kind in shipped() else None)
    if begun is None:
        raise InputError(
            f"there is no kind of line named {kind}: name one of {', '.join(BEGINNINGS)}, or a "
            f"shipped case ({', '.join(shipped())})"
        )
    path = shipped()[begun.case]
    text, source = path.read_text(encoding="utf-8"), read_toml(path)["case"].get("source", "")
    for old, new in begun.changes:
        assert text.count(old) == 1, f"{path} has {old!r} {text.count(old)} times"
        text = text.replace(old, new)
    head = (
        f"# {plain(name)}: a new case, begun from the shipped case {begun.case}. Change what is\n"
        "# otherwise on your line. `catenary list --keys WORD` explains keys.\n"
        '# Behind "usual" stands what other lines have, in the unit of the key.\n\n'
    )
    case = (
        f'[case]\ntitle = "{_quoted(name)}"\n'
        f'description = "Begun from the shipped case {begun.case}."\n'
        f'source = "to be replaced; values of {begun.case}: {_quoted(source)}"\n\n'
    )
    body = text[text.index("[line]") :]
    if spans:
        body = _with_files(body, spans, droppers)
    return head + case + _with_usual_values(body)


def _quoted(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ")


def _with_usual_values(body: str) -> str:
    """The text with a comment above each key of which usual values are known."""
    lines, table = [], ""
    for line in body.splitlines():
        heading = re.match(r"\[+([\w.]+)\]+", line)
        if heading:
            table = re.sub(r"^pantographs\.\w+", "pantographs.*", heading[1])
        key = re.match(r"(\w+) =", line)
        usual = TYPICAL.get(f"{table}.{key[1]}") if key else None
        if usual is not None:
            lines.append(f"# usual: {usual}")
        lines.append(line)
    return "\n".join(lines) + "\n"


def _with_files(body: str, spans: Sequence[float], droppers: bool) -> str:
    """The text with the planner's tables in place of its own spans and droppers."""
    body = _replaced(body, r"n_spans = .*\nspan_m = .*\n", f'spans_file = "{SPANS_FILE}"\n', 1)
    if droppers:
        own = r"(?:positions_m|pre_sag_mm|pre_sag_mid_mm) = .*\n"
        start = body.index("[line.dropper]")
        end = body.index("\n[", start) + 1
        table = re.sub(own, "", body[start:end]).rstrip()
        body = f'{body[:start]}{table}\npatterns_file = "{DROPPERS_FILE}"\n\n{body[end:]}'
        # Droppers of an auxiliary wire hang evenly: five of them, ten metres apart.
        even = r"\1count = 5\nspacing_m = 10.0\n"
        body = re.sub(r"(\[line\.auxiliary_wire\.dropper\].*\n.*\n)positions_m = .*\n", even, body)
    n, places = len(spans), [0.0]
    for span in spans:
        places.append(places[-1] + span)
    if n < _START + _SHORT_RUN_IN + _SHORT_JUDGED + _AFTER:
        least = _START + _SHORT_RUN_IN + _SHORT_JUDGED + _AFTER
        raise InputError(f"a new case needs {least} spans to run in, judge and run out, not {n}")
    first = min(_START + _RUN_IN, n // 3 + 1)
    last = min(first + _JUDGED, n - _AFTER)
    short = _START + _SHORT_RUN_IN
    body = _replaced(body, r"start_m = .*\n", f"start_m = {places[_START]:.10g}\n", 1)
    body = _replaced(body, r"from_m = .*\n", f"from_m = {places[first]:.10g}\n", 1)
    body = _replaced(body, r"to_m = .*\n", f"to_m = {places[last]:.10g}\n", 1)
    test = (
        f'[test]\n"line.n_spans" = {short + _SHORT_JUDGED + _AFTER}\n'
        f'"evaluation.from_m" = {places[short]:.10g}\n'
        f'"evaluation.to_m" = {places[short + _SHORT_JUDGED]:.10g}\n'
    )
    return body[: body.index("[test]")] + test


def _replaced(text: str, pattern: str, new: str, often: int) -> str:
    found, n = re.subn(f"^{pattern}", new, text, count=often, flags=re.MULTILINE)
    assert n == often, f"{n} times {pattern}"
    return found
