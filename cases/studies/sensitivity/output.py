"""Sensitivities of a case as a table, ranked, and as text."""

from __future__ import annotations

from typing import Any

import numpy as np

from catenary.cases.studies.sensitivity.study import Sensitivity
from catenary.postproc.report.study_table import Column, StudyTable

_MM = 1e3
# Half of the last digit of the last column, which has one more than others.
_SEEN = 0.5e-4
_BY_PERCENT = "std_change_by_percent_N"
_FORCES = {
    "mean_change_N": ("mean", "mean [N]"),
    "std_change_N": ("std", "sigma [N]"),
    "stat_max_change_N": ("stat_max", ""),
    "stat_min_change_N": ("stat_min", "stat. min [N]"),
    "max_change_N": ("maximum", ""),
    "min_change_N": ("minimum", "least [N]"),
}


def table_of(found: Sensitivity) -> StudyTable:
    """A row for each parameter and pantograph; first what changes the standard deviation most.

    Figures are changes of the statistics under ``change`` of the parameter, in the unit of its key;
    the last one is that of the standard deviation under a hundredth of the parameter. Both decide
    the order: the latter, or the former of a parameter that is zero.
    """
    several = len(found.names) > 1
    columns = [
        Column("parameter", "parameter"),
        Column("shown", "value", ">", in_files=False),
        Column("value"),
        Column("unit", "unit"),
        Column("pantograph", "pantograph" if several else ""),
        Column("change", "change", ".4g"),
        *(Column(name, head, "+.3f") for name, (_, head) in _FORCES.items()),
        Column("max_uplift_change_mm", "uplift [mm]", "+.3f"),
        Column(_BY_PERCENT, "sigma by 1 % [N]", "+.4f"),
    ]

    def weight(number: int) -> float:
        ranked = _BY_PERCENT if found.parameters[number].size else "std_change_N"
        return max(abs(row[ranked]) for row in _rows(found, number))

    order = sorted(range(len(found.parameters)), key=weight, reverse=True)
    return StudyTable(columns, [row for number in order for row in _rows(found, number)])


def _rows(found: Sensitivity, number: int) -> list[dict[str, Any]]:
    parameter = found.parameters[number]
    change, uplift = parameter.change, found.by_uplift[number]
    rows = []
    for name, own in zip(found.names, found.by_force[number], strict=True):
        row: dict[str, Any] = {
            "parameter": parameter.key,
            "shown": parameter.text,
            "value": parameter.values[0] if len(parameter.values) == 1 else [*parameter.values],
            "unit": parameter.unit,
            "pantograph": name,
            "change": change,
        }
        row |= {column: change * float(getattr(own, of)) for column, (of, _) in _FORCES.items()}
        row["max_uplift_change_mm"] = None if np.isnan(uplift) else change * uplift * _MM
        row[_BY_PERCENT] = 0.01 * parameter.size * float(own.std) if parameter.size else None
        rows.append(row)
    return rows


def as_text(found: Sensitivity) -> str:
    """Text for the terminal: the statistics, the table, and the limits of the derivatives."""
    lines = []
    for name, own in zip(found.names, found.statistics, strict=True):
        lines.append(
            f"{name}: mean {own['mean']:.2f} N, sigma {own['std']:.2f} N, "
            f"statistical minimum {own['mean'] - 3.0 * own['std']:.1f} N, "
            f"least {own['min']:.1f} N, largest {own['max']:.1f} N"
        )
    if not np.isnan(found.max_uplift):
        lines.append(f"largest uplift {found.max_uplift * _MM:.1f} mm")
    lines += ["", "Changes of these under a change of each parameter:", table_of(found).text(), ""]
    lines += _idle(found)
    lines += [_kinks(found), *_early(found)]
    for key, why in found.left_out.items():
        lines.append(f"{key} is left out: {why}")
    return "\n".join(lines)


def _idle(found: Sensitivity) -> list[str]:
    """A sentence on the parameters whose rows have nothing but zeros."""
    figures = [*_FORCES, "max_uplift_change_mm", _BY_PERCENT]
    idle = [
        parameter.key
        for number, parameter in enumerate(found.parameters)
        if all(abs(row[name] or 0.0) < _SEEN for row in _rows(found, number) for name in figures)
    ]
    return [f"Without effect in the digits above: {', '.join(idle)}.\n"] if idle else []


def _kinks(found: Sensitivity) -> str:
    contacts, links = found.contact_switches, found.link_switches
    return (
        f"In {found.n_steps} steps contacts opened or closed {contacts} times and droppers or "
        f"other links switched {links} times. Derivatives hold for changes that leave all of these "
        "in their steps; those of least and largest values also require that these stay at their "
        "step and arm. Larger changes add the effect of the switches that move."
    )


def _early(found: Sensitivity) -> list[str]:
    """Sentences on parameters that move the train along the track, and so all switches at once."""
    sentences = []
    for one in found.parameters:
        # By so much the train is a step farther at the end of the march.
        if one.key == "train.speed_km_h":
            least = one.size / found.n_steps
        elif one.key == "train.start_m":
            least = found.step_m
        else:
            continue
        sentences.append(
            f"{one.key} already moves some of these by {least:.1g} {one.unit}: for larger "
            "changes its derivative may be wrong in size and even in sign. Run variants of it "
            "(`catenary sweep`)."
        )
    return sentences
