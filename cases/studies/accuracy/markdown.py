"""The tables of an accuracy study as a page of Markdown."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Mapping, Sequence

from catenary.cases.studies.accuracy.analysis import HISTORY, QUANTITIES, Row
from catenary.cases.studies.accuracy.axes import AXES
from catenary.cases.studies.accuracy.axis import DISCRETISATION, Axis
from catenary.cases.studies.accuracy.plan import PlannedAxis
from catenary.cases.studies.accuracy.runs import Measured
from catenary.cases.studies.told_remarks import remark_lines
from catenary.postproc.evaluate.wording import counted

_SEPARATE = ("history by step", "history by mesh")
_LAST_COLUMNS = ("est/true", "solves", "s/s", "remarks")
_USUAL_REPEATS = 3  # that of the command line


def page(
    found: Measured, sentences: Sequence[str], orders: dict[str, list[str]], picture: str
) -> str:
    """One table an axis, with what the study recommends first.

    Parameters
    ----------
    found : what was measured
    sentences : the recommendations
    orders : lines on observed orders by axis name
    picture : file of the work-precision diagram, empty for none
    """
    parts = [
        f"# Accuracy and cost: {found.plan.case}",
        f"`{_command(found)}`; {counted(len(found.rows), 'setting')}, "
        f"{counted(round(found.wall / 60.0), 'minute')}. Errors in percent: of the reference's own "
        "value for mean, deviations and uplift, of its standard deviation for maximum, minimum and "
        'the force "history" (rms). "est/true" is the error that a run estimates itself over the '
        'true one, "solves" those of the contact problem a step, "s/s" processor time of the '
        "march per simulated second, the least of those timed: only ratios within this page mean "
        "anything. Where step and mesh are refined together, errors of the history by the step and "
        "by the mesh alone stand beside the whole error, in which they may cancel.",
    ]
    if picture:
        parts.append(f"![work and precision]({picture})")
    parts.append("\n".join(f"- {sentence}" for sentence in sentences))
    for planned in found.plan.axes:
        axis = planned.axis
        parts.append(f"## {axis.title[0].upper()}{axis.title[1:]}")
        if axis.kind == DISCRETISATION:
            doubt = uncertainty_text(planned, found.uncertainty[axis.name])
            reference = run_in_words(planned.reference)
            parts.append(f"Reference: {reference}. {doubt[0].upper()}{doubt[1:]}.")
        else:
            parts.append("Differences from the case as it is: of models, not errors.")
        parts.append(_table(axis, found.rows_of(axis.name)))
        parts += [line.strip()[0].upper() + line.strip()[1:] + "." for line in orders[axis.name]]
    told = remark_lines(runs_with_remarks(found))
    if told:
        parts.append("## Remarks")
        parts.append("\n".join(f"- {line.split(maxsplit=1)[1]}" for line in told))
    return "\n\n".join(parts) + "\n"


def _command(found: Measured) -> str:
    """The words that make this study again, the folder left out."""
    names = list(found.plan.asked)
    some = "" if names == list(AXES) else f" --axes {','.join(names)}"
    quick = " --quick" if found.plan.quick else ""
    repeats = "" if found.plan.repeats == _USUAL_REPEATS else f" --repeats {found.plan.repeats}"
    changes = "".join(f" --set {shlex.quote(one)}" for one in found.plan.overrides)
    return f"catenary accuracy {found.plan.case}{some}{quick}{repeats}{changes}"


def runs_with_remarks(found: Measured) -> list[tuple[str, Sequence[str]]]:
    """All runs in words, by the levels that they are of, with their remarks.

    A run of several axes has the words of each; one that is of none, such as a reference, has its
    own.
    """
    words: dict[str, list[str]] = {}
    for planned in found.plan.axes:
        for level, name in planned.runs.items():
            words.setdefault(name, []).append(f"{planned.axis.name} {in_words(level)}")
    return [
        (" or ".join(words.get(name, [_whole_in_words(name)])), remarks)
        for name, remarks in found.remarks.items()
    ]


def _whole_in_words(name: str) -> str:
    """The name of a run as axis and level in words."""
    axis, _, level = name.rpartition("__")
    return f"{axis} {in_words(level)}".strip()


def uncertainty_text(planned: PlannedAxis, percent: Mapping[str, float]) -> str:
    """How far the reference itself may be wrong, and from which runs that is known."""
    chains = [", ".join(map(run_in_words, chain)) for chain in planned.chains]
    from_runs = " and from ".join(chains)
    known = {what: value for what, value in percent.items() if math.isfinite(value)}
    if not known:
        return f"the uncertainty of the reference is not known from {from_runs}"
    told = ", ".join(f"{what} {_short(value)}" for what, value in known.items())
    return f"uncertainty of the reference, from {from_runs} [%]: {told}"


def _table(axis: Axis, rows: Sequence[Row]) -> str:
    both = any(row.by_step for row in rows)
    names = [*QUANTITIES, *(_SEPARATE if both else ()), *_LAST_COLUMNS]
    figures = {row.level: _cells(axis, row, both) for row in rows if row.done}
    used = [i for i in range(len(names)) if any(cells[i] for cells in figures.values())] or [0]
    lines = [
        "| " + " | ".join([axis.name, *(names[i] for i in used)]) + " |",
        "|" + "---|" * (len(used) + 1),
    ]
    for row in rows:
        cells = [row.outcome] + [""] * (len(used) - 1)
        if row.done:
            cells = [figures[row.level][i] for i in used]
        lines.append("| " + " | ".join([in_words(row.level), *cells]) + " |")
    return "\n".join(lines)


def in_words(level: str) -> str:
    """A level's name as words: ``1_ms_1_elements`` is "1 ms 1 element"."""
    words = re.sub(r"\b1 elements\b", "1 element", level.replace("_", " "))
    return re.sub(r"\b([2-9]) mass\b", r"\1 masses", words)


def run_in_words(name: str) -> str:
    """The name of a run, axis and level, as that of its level alone."""
    return in_words(name.rpartition("__")[2])


def _cells(axis: Axis, row: Row, both: bool) -> list[str]:
    true = row.errors.get(HISTORY, math.nan)
    ratio = row.estimate / true if axis.refined == "dt" and true else math.nan
    figures = [row.percent.get(name, math.nan) for name in QUANTITIES]
    if both:
        figures += [row.by_step.get(HISTORY, math.nan), row.by_mesh.get(HISTORY, math.nan)]
    told = [_short(value) for value in (*figures, ratio, row.iterations, row.cost)]
    return [*told, str(len(row.remarks) or "")]


def _short(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.3g}"
