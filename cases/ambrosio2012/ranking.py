"""Which open input moves what: the variations with one pantograph, in the order of their effect."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from catenary.cases.ambrosio2012.statements import (
    AVERAGE,
    LIGHT,
    MEAN,
    MEAN_WITHIN,
    STD_RATIO,
    UPLIFT,
    Run,
)
from catenary.postproc.report.study_report import StudyTable

_NAMED = 4  # variations that a reason names


class Row(NamedTuple):
    """A variation beside the case as it stands; ``title`` is empty for the latter."""

    title: str
    light: Run
    average: Run


class _Asked(NamedTuple):
    """A statement's criterion for one pantograph, and whether a variation would satisfy it."""

    what: str
    unit: str
    digits: int
    value: Callable[[Run], float]
    damping: str
    meets: Callable[[Run, Run], bool]


def rank(
    base: Mapping[str, Run | None], varied: Mapping[str, Mapping[str, Run | None]]
) -> list[Row]:
    """The case, then the variations by how much they move the deviations; broken ones left out.

    The effect is the larger of both dampings' changes. Empty if the case itself broke.
    """
    light, average = base.get(LIGHT), base.get(AVERAGE)
    if light is None or average is None:
        return []
    rows = []
    for title, runs in varied.items():
        own_light, own_average = runs.get(LIGHT), runs.get(AVERAGE)
        if own_light is not None and own_average is not None:
            rows.append(Row(title, own_light, own_average))
    start = Row("", light, average)
    return [start, *sorted(rows, key=lambda row: _effect(row, start), reverse=True)]


def _effect(row: Row, start: Row) -> float:
    return max(abs(change) for change in _changes(row, start))


def _changes(row: Row, start: Row) -> tuple[float, float]:
    """Changes of the standard deviation against the case, light and average [N]."""
    return (
        row.light.forces[0].std - start.light.forces[0].std,
        row.average.forces[0].std - start.average.forces[0].std,
    )


def table(ranked: Sequence[Row]) -> StudyTable:
    """The ranking for the report; no rows if the case itself broke."""
    rows = []
    for row in ranked:
        light, average = row.light.forces[0], row.average.forces[0]
        change = _changes(row, ranked[0])
        rows.append([
            row.title or "the case as it stands",
            f"{light.std:.1f}", f"{average.std:.1f}",
            f"{change[0]:+.1f}" if row.title else "", f"{change[1]:+.1f}" if row.title else "",
            f"{light.std_0_5:.0f} / {average.std_0_5:.0f}",
            f"{light.std_5_20:.0f} / {average.std_5_20:.0f}",
            f"{light.mean:.0f} / {average.mean:.0f}",
            f"{light.maximum:.0f} / {average.maximum:.0f}",
            f"{light.minimum:.0f} / {average.minimum:.0f}",
            f"{light.loss_percent:.1f} / {average.loss_percent:.1f}",
            f"{1e3 * row.light.uplift:.0f} / {1e3 * row.average.uplift:.0f}",
            f"{row.light.slack.leading} / {row.average.slack.leading} of {row.light.slack.of}",
        ])  # fmt: skip
    return StudyTable(
        "What the open inputs decide",
        "One input at a time, one pantograph, in the order of their effect on the standard "
        "deviation; light / average damping.",
        ["input", "std light [N]", "std average [N]", "change light [N]", "change average [N]",
         "0-5 Hz [N]", "5-20 Hz [N]", "mean [N]", "max [N]", "min [N]", "loss [%]",
         "arm uplift [mm]", "slack at mid-span"],
        rows,
    )  # fmt: skip


def movers(number: int, ranked: Sequence[Row]) -> str:
    """The variations that move a statement's criterion most, as sentences; "" without any."""
    asked = _ASKED.get(number)
    if asked is None or len(ranked) < 2:
        return ""

    def of(row: Row) -> float:
        return asked.value(row.light if asked.damping == LIGHT else row.average)

    start, rows = of(ranked[0]), ranked[1:]
    most = sorted(rows, key=lambda row: abs(of(row) - start), reverse=True)[:_NAMED]
    listed = "; ".join(
        f"{row.title}: {of(row):.{asked.digits}f}"
        for row in most
        if abs(of(row) - start) >= 0.5 * 10**-asked.digits
    )
    text = (
        f"One pantograph, {asked.what}: {start:.{asked.digits}f}{asked.unit} in the case; "
        + (f"moved most by {listed}" if listed else "moved by no variation")
        + ". "
    )
    holds = asked.meets(ranked[0].light, ranked[0].average)
    turned = [row.title for row in rows if asked.meets(row.light, row.average) != holds]
    if holds:
        text += "It satisfies the statement: the second pantograph makes the difference. "
        return text + (f"Alone it fails with {_some(turned)}." if turned else "").strip()
    if not turned:
        return text + f"None of the {len(rows)} variations alone makes the statement hold for it."
    return text + f"The statement holds for it with {_some(turned)}."


def _some(titles: Sequence[str]) -> str:
    """The first titles, and how many more there are."""
    more = len(titles) - _NAMED
    return "; ".join(titles[:_NAMED]) + (f" and {more} more" if more > 0 else "")


def _ratio(run: Run) -> float:
    return run.forces[0].std / run.forces[0].mean


_ASKED = {
    1: _Asked(
        "mean force, light damping", " N", 1, lambda run: run.forces[0].mean, LIGHT,
        lambda light, average: all(
            abs(r.forces[0].mean - MEAN) <= MEAN_WITHIN for r in (light, average)
        ),
    ),
    2: _Asked(
        "standard deviation, average damping", " N", 1, lambda run: run.forces[0].std, AVERAGE,
        lambda light, average: _ratio(light) > STD_RATIO > _ratio(average),
    ),
    6: _Asked(
        "loss of contact, light damping", " %", 1, lambda run: run.forces[0].loss_percent, LIGHT,
        lambda light, average: not any(r.forces[0].loss_percent for r in (light, average)),
    ),
    7: _Asked(
        "uplift, light damping", " mm", 1, lambda run: 1e3 * run.uplift, LIGHT,
        lambda light, average: max(light.uplift, average.uplift) < UPLIFT,
    ),
    8: _Asked(
        "slack droppers at mid-span, average damping", "", 0, lambda run: run.slack.leading,
        AVERAGE,
        lambda light, average: light.slack.leading > 0 == average.slack.leading,
    ),
}  # fmt: skip
