"""Costs of effects: a sentence of advice on each, a table for a terminal, as CSV and as JSON."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

from catenary.cases.studies.effect_cost.study import FIGURES, UPLIFT, Costs, Measured, Size
from catenary.postproc.evaluate.wording import counted, fixed
from catenary.postproc.report.study_table import Column, Content, StudyTable, remark_lines

TABLE, RECORD, TEXT = "cost.csv", "cost.json", "cost.txt"
# In the column "simulated": the scene simulates the effect.
LEFT_OUT = "left out"
# Heads of the figures in a table, and their names in sentences.
_HEADS = {"mean_N": "mean", "std_N": "sigma", "max_N": "max", "min_N": "min", UPLIFT: "uplift"}
# A ratio of times that is none: what clocks and caches make of equal steps.
_SAME_COST = 0.03
# A share of a figure below which digits are noise of no use to anybody.
_NOTHING = 5e-5
_WORDS = {
    "mean_N": "the mean",
    "std_N": "sigma",
    "max_N": "the maximum",
    "min_N": "the minimum",
    UPLIFT: "the uplift",
}


class Change(NamedTuple):
    """A figure of a pantograph that an effect changes.

    ``share`` is the change, switched against as it is: of sigma in sigma, of the uplift in the
    uplift, of the mean force in the others; infinite where a figure comes or goes.
    """

    figure: str
    pantograph: int
    share: float


def changes(found: Costs, row: Measured) -> list[Change]:
    """Changes of all figures of all pantographs by the switch of a ``row``; unknown figures are
    left out."""
    result = []
    pairs = zip(found.as_it_is.figures, row.figures, strict=False)
    for number, (before, after) in enumerate(pairs):
        for name in (*FIGURES, UPLIFT):
            share = _share(before, after, name)
            if share is not None:
                result.append(Change(name, number, share))
    return result


def _share(before: dict[str, Any], after: dict[str, Any], name: str) -> float | None:
    a, b = before[name], after[name]
    if a is None and b is None:
        return None
    of = before[name if name in ("std_N", UPLIFT) else "mean_N"]
    if a is None or b is None or not of:
        return 0.0 if a == b else math.inf
    return float((b - a) / abs(of))


def largest(found: Costs, row: Measured) -> Change | None:
    """The largest change by the switch of a ``row``, None without figures."""
    return max(changes(found, row), key=lambda change: abs(change.share), default=None)


def advice(found: Costs, row: Measured) -> str:
    """One sentence on whether to simulate the effect of a ``row``."""
    verb = "leave it out" if row.switch.on else "switch it on"
    if not row.done:
        return f"it was not measured, for you cannot {verb} here: {row.outcome.rstrip('.')}."
    change = largest(found, row)
    if change is None:
        return f"it {_price(row.cost)}; the stretch gives no figures to compare."
    what = _words(found, change)
    if abs(change.share) >= found.options.tolerance:
        if row.switch.on:
            return f"it {_price(row.cost)}; without it {what}: keep it."
        return f"it {_price(row.cost)}, and with it {what}: switch it on if its data are sound."
    within = f"{100 * found.options.tolerance:g} %"
    if not row.switch.on:
        return f"it {_price(row.cost)}; with it {what}: leave it out for figures within {within}."
    if row.cost <= 1.0 + _SAME_COST:
        return f"it {_price(row.cost)}; without it {what}: keep it, or leave it out."
    return f"it {_price(row.cost)}; without it {what}: leave it out for figures within {within}."


def _price(cost: float) -> str:
    if abs(cost - 1.0) <= _SAME_COST:
        return "has no measurable cost"
    return f"makes a step {cost:.2f} times as long"


def _words(found: Costs, change: Change) -> str:
    whose = f" of {found.names[change.pantograph]}" if len(found.names) > 1 else ""
    what = _WORDS[change.figure] + (whose if change.figure != UPLIFT else "")
    if math.isinf(change.share):
        return f"{what} comes or goes"
    if abs(change.share) < _NOTHING:
        return "no figure changes"
    of = " of the mean" if change.figure in ("max_N", "min_N") else ""
    percent = 100 * change.share
    number = f"{percent:+.0f}" if abs(percent) >= 10 else f"{percent:+.2g}"
    return f"{what} changes most, by {number} %{of}"


def width_text(size: Size) -> str:
    """Unknowns of a station: by planes, or of the smallest to the largest."""
    low, high = size.of_a_station
    if len(size.planes) > 1 and low == high:
        return "+".join(map(str, size.planes))
    return f"{low}" if low == high else f"{low} to {high}"


def as_text(found: Costs, *, whole: bool = False) -> str:
    """The table: switched against as it is, then advice, then what is not measured; ``whole``, for
    a file, whatever the width of the terminal."""
    (start, end), rounds = found.stretch, found.options.rounds
    table = table_of(found)
    mine = ("", found.names[0])
    leading = replace(table, rows=[row for row in table.rows if row["pantograph"] in mine])
    lines = [
        f"{found.case}: evaluated from {start:g} to {end:g} m; {counted(rounds, 'repetition')} of "
        f"{counted(found.n_steps, 'step')} in turns.",
        "Forces in N, uplift in mm; the row of an effect shows the changes when it is switched.",
        "cost: time of a step with the effect over that without, the median of the repetitions.",
    ]
    if len(found.names) > 1:
        lines.append(f"Forces are those of {found.names[0]}, which leads.")
    lines += ["", leading.text(whole=whole), "", "Advice:"]
    width = max(len(row.switch.name) for row in found.rows) if found.rows else 0
    lines += [f"  {row.switch.name:{width}}  {sentence(found, row)}" for row in found.rows]
    remarks = remark_lines((_run(one), one.remarks) for one in (found.as_it_is, *found.rows))
    lines += ["", *remarks] if remarks else []
    if found.options.only:
        return "\n".join(lines)
    if found.effects.always:
        lines += ["", f"Part of every scene: {', '.join(found.effects.always)}."]
    if found.effects.lacking:
        lines += ["", "Could be switched on with data that the scene lacks:"]
        wide = max(map(len, found.effects.lacking))
        lines += [f"  {name:{wide}}  {data}" for name, data in found.effects.lacking.items()]
    return "\n".join(lines)


def table_of(found: Costs) -> StudyTable:
    """A row of each switch and pantograph, the scene as it is first.

    People read rows of the leading pantograph, with changes of its figures.
    """
    names = (*FIGURES, UPLIFT)
    changed = [part for name in names for part in (name, f"change_of_{name}")]
    files = ["effect", "simulated", "together", "outcome", "n_unknowns", "unknowns_of_a_station"]
    files += ["pantograph", *changed, "us_per_step", "cost", "from_m", "to_m", "advice", "remarks"]
    people = [
        Column("run", "run"),
        Column("n_unknowns", "unknowns", "d"),
        Column("unknowns_of_a_station", "station", ">"),
        Column("us_per_step", "us/step", ".1f"),
        Column("cost", "cost", ".2f"),
        *(Column(f"shown_{name}", _HEADS[name], ">") for name in names),
    ]
    columns = [*map(Column, files), *(one._replace(in_files=False) for one in people)]
    rows = [row for one in (found.as_it_is, *found.rows) for row in _rows(found, one)]
    return StudyTable(columns, rows)


def _rows(found: Costs, one: Measured) -> list[dict[str, Any]]:
    """The rows of a switch, or of the scene as it is, one of each pantograph."""
    switch, size, step = one.switch, one.size, found.step * one.ratio
    simulated = "as it is"
    if switch.name:
        simulated = LEFT_OUT if switch.on else "switched on"
    head: dict[str, Any] = {
        "run": _run(one),
        "effect": switch.name,
        "simulated": simulated,
        "together": list(switch.together),
        "outcome": one.outcome,
        "n_unknowns": None if size is None else size.n_unknowns,
        "unknowns_of_a_station": "" if size is None else width_text(size),
        "us_per_step": None if math.isnan(step) else step,
        "cost": None if not (switch.name and one.done) else one.cost,
        "from_m": found.stretch[0],
        "to_m": found.stretch[1],
        "advice": sentence(found, one) if switch.name else "",
        "remarks": one.remarks,
    }
    rows = []
    for number, own in enumerate(one.figures or [{}]):
        row = {**head, "pantograph": found.names[number] if one.figures else ""}
        for name in (*FIGURES, UPLIFT):
            value, first = own.get(name), found.as_it_is.figures[number][name]
            change = None if value is None or first is None else value - first
            shown = None if change is None else f"{change:+.2f}"
            if not switch.name and value is not None:
                shown = fixed(value, 2)
            row |= {name: value, f"change_of_{name}": change, f"shown_{name}": shown}
        rows.append(row)
    return rows


def _run(row: Measured) -> str:
    """A run's name as in the table."""
    if not row.switch.name:
        return "as it is"
    return f"{'without' if row.switch.on else 'with'} {row.switch.name}"


def sentence(found: Costs, row: Measured) -> str:
    """The advice on the effect of a ``row``, and the effects that are switched with it."""
    text = advice(found, row)
    if not row.switch.together:
        return text
    others = ", ".join(row.switch.together)
    return f"{text} Switched with it, since one requires the other: {others}."


def record_of(found: Costs) -> dict[str, Any]:
    """Record of the study, for JSON."""
    return {
        "case": found.case,
        "assignments": list(found.options.overrides),
        "evaluation_m": list(found.stretch),
        "rounds": found.options.rounds,
        "steps_of_a_round": found.n_steps,
        "always": found.effects.always,
        "lacking_data": found.effects.lacking,
        "rows": table_of(found).records(),
    }


def files_of(found: Costs) -> dict[str, Content]:
    """Table, record and text. Not collective."""
    return {
        TABLE: table_of(found),
        RECORD: record_of(found),
        TEXT: as_text(found, whole=True) + "\n",
    }
