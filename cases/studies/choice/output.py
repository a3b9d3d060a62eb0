"""Costs of effects as a table for a terminal, as CSV and as JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from catenary.cases.studies.choice.advice import advice
from catenary.cases.studies.choice.study import FIGURES, UPLIFT, Costs, Measured, Size
from catenary.cases.studies.told_remarks import remark_lines
from catenary.postproc.evaluate.wording import counted, fixed
from catenary.postproc.files.csv_text import csv_text
from catenary.postproc.files.disk import plain, write_all

TABLE, RECORD, TEXT = "cost.csv", "cost.json", "cost.txt"
_HEADS = {"mean_N": "mean", "std_N": "sigma", "max_N": "max", "min_N": "min", UPLIFT: "uplift"}


def width_text(size: Size) -> str:
    """Unknowns of a station: by planes, or of the smallest to the largest."""
    low, high = size.of_a_station
    if len(size.planes) > 1 and low == high:
        return "+".join(map(str, size.planes))
    return f"{low}" if low == high else f"{low} to {high}"


def as_text(found: Costs) -> str:
    """The table: switched against as it is, then advice, then what is not measured."""
    start, end = found.stretch
    width = max([len("as it is"), *(len(row.switch.name) for row in found.rows)])
    several = len(found.names) > 1
    head = f"{'':10}{'':{width}}  {'unknowns':>9}{'station':>9}{'us/step':>9}{'cost':>7}" + "".join(
        f"{name:>9}" for name in _HEADS.values()
    )
    lines = [
        f"{found.wish.case}: evaluated from {start:g} to {end:g} m; "
        f"{counted(found.wish.rounds, 'repetition')} of {counted(found.n_steps, 'step')} in turns.",
        "Forces in N, uplift in mm; of an effect that is switched, what changes. cost: how many "
        "times as long",
        "a step takes with the effect as without, the median of the repetitions.",
        *([f"Forces are those of {found.names[0]}, which leads."] if several else []),
        "",
        head,
        _line("", "as it is", width, found.size, found.step, "", found.figures[0], None),
    ]
    for on, word in ((True, "without"), (False, "with")):
        for row in found.rows:
            if row.switch.on == on and row.done:
                assert row.size is not None
                cost, name = f"{row.cost:.2f}", row.switch.name
                shown = row.figures[0]
                lines.append(
                    _line(
                        word,
                        name,
                        width,
                        row.size,
                        found.step * row.ratio,
                        cost,
                        shown,
                        found.figures[0],
                    )
                )
    lines += ["", "Advice:"]
    lines += [f"  {row.switch.name:{width}}  {sentence(found, row)}" for row in found.rows]
    told = remark_lines([("as it is", found.remarks), *map(_told, found.rows)])
    lines += ["", *told] if told else []
    if found.wish.only:
        return "\n".join(lines)
    if found.choice.always:
        lines += ["", f"Part of every scene: {', '.join(found.choice.always)}."]
    if found.choice.lacking:
        lines += ["", "Could be switched on with data that the scene lacks:"]
        wide = max(map(len, found.choice.lacking))
        lines += [f"  {name:{wide}}  {data}" for name, data in found.choice.lacking.items()]
    return "\n".join(lines)


def _told(row: Measured) -> tuple[str, list[str]]:
    """A run's name as in the table, and its remarks."""
    return f"{'without' if row.switch.on else 'with'} {row.switch.name}", row.remarks


def sentence(found: Costs, row: Measured) -> str:
    """The advice on an effect, and what is switched with it."""
    text = advice(found, row)
    if not row.switch.together:
        return text
    others = ", ".join(row.switch.together)
    return f"{text} Switched with it, since one requires the other: {others}."


def _line(
    word: str,
    name: str,
    width: int,
    size: Size,
    step: float,
    cost: str,
    figures: dict[str, float | None],
    before: dict[str, float | None] | None,
) -> str:
    return (
        f"  {word:8}{name:{width}}  {size.n_unknowns:>9}{width_text(size):>9}{step:>9.1f}{cost:>7}"
        + "".join(f"{_figure(figures, before, key):>9}" for key in _HEADS)
    )


def _figure(
    figures: dict[str, float | None], before: dict[str, float | None] | None, name: str
) -> str:
    value = figures[name]
    if value is None:
        return "-"
    if before is None:
        return fixed(value, 2)
    first = before[name]
    return "-" if first is None else f"{value - first:+.2f}"


def rows_of(found: Costs) -> list[dict[str, Any]]:
    """A row of each switch and pantograph, the scene as it is first; plain values."""
    start, end = found.stretch
    rows: list[dict[str, Any]] = []

    def add(head: dict[str, Any], size: Size | None, figures: Any, tail: dict[str, Any]) -> None:
        of_size = {
            "n_unknowns": None if size is None else size.n_unknowns,
            "unknowns_of_a_station": "" if size is None else width_text(size),
        }
        for number, own in enumerate(figures or [{}]):
            before = found.figures[number]
            changed: dict[str, Any] = {}
            for name in (*FIGURES, UPLIFT):
                value, first = own.get(name), before[name]
                known = value is not None and first is not None
                changed[name] = value
                changed[f"change_of_{name}"] = value - first if known else None
            whose = {"pantograph": found.names[number] if figures else ""}
            rows.append({**head, **of_size, **whose, **changed, **tail})

    place = {"from_m": start, "to_m": end}
    add(
        {"effect": "", "simulated": "as it is", "together": [], "outcome": "done"},
        found.size,
        found.figures,
        {"us_per_step": found.step, "cost": None, **place, "advice": "", "remarks": found.remarks},
    )
    for row in found.rows:
        add(
            {
                "effect": row.switch.name,
                "simulated": "left out" if row.switch.on else "switched on",
                "together": list(row.switch.together),
                "outcome": row.outcome,
            },
            row.size,
            row.figures,
            {
                "us_per_step": found.step * row.ratio if row.done else None,
                "cost": row.cost if row.done else None,
                **place,
                "advice": sentence(found, row),
                "remarks": row.remarks,
            },
        )
    return rows


def as_csv(found: Costs) -> str:
    """The rows as CSV text; what is unknown is empty."""
    rows = rows_of(found)
    return csv_text(list(rows[0]), ([_cell(*item) for item in row.items()] for row in rows))


def _cell(name: str, value: Any) -> Any:
    if value is None:
        return ""
    if isinstance(value, list):
        return ("; " if name == "remarks" else " ").join(value)
    return f"{value:.9g}" if isinstance(value, float) else value


def as_json(found: Costs) -> str:
    """Everything as JSON text."""
    record = {
        "case": found.wish.case,
        "assignments": list(found.wish.overrides),
        "evaluation_m": list(found.stretch),
        "rounds": found.wish.rounds,
        "steps_of_a_round": found.n_steps,
        "always": found.choice.always,
        "lacking_data": found.choice.lacking,
        "rows": rows_of(found),
    }
    return json.dumps(plain(record), indent=1, ensure_ascii=False) + "\n"


def write(found: Costs, folder: Path) -> list[Path]:
    """Write table, record and text into a folder; returns the files. Not collective."""
    content = {TABLE: as_csv(found), RECORD: as_json(found), TEXT: as_text(found) + "\n"}
    return write_all(folder, content)
