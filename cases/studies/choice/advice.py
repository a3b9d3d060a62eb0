"""What an effect changes most, and a sentence of advice on it."""

from __future__ import annotations

import math
from typing import NamedTuple

from catenary.cases.studies.choice.study import FIGURES, UPLIFT, Costs, Measured

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
    """Changes of all figures of all pantographs, those that are known."""
    result = []
    for number, (before, after) in enumerate(zip(found.figures, row.figures, strict=False)):
        for name in (*FIGURES, UPLIFT):
            share = _share(before, after, name)
            if share is not None:
                result.append(Change(name, number, share))
    return result


def _share(
    before: dict[str, float | None], after: dict[str, float | None], name: str
) -> float | None:
    a, b = before[name], after[name]
    if a is None and b is None:
        return None
    of = before[name if name in ("std_N", UPLIFT) else "mean_N"]
    if a is None or b is None or not of:
        return 0.0 if a == b else math.inf
    return (b - a) / abs(of)


def largest(found: Costs, row: Measured) -> Change | None:
    """The largest change, None without figures."""
    return max(changes(found, row), key=lambda change: abs(change.share), default=None)


def advice(found: Costs, row: Measured) -> str:
    """One sentence on whether to simulate an effect."""
    verb = "leave it out" if row.switch.on else "switch it on"
    if not row.done:
        return f"it was not measured, for you cannot {verb} here: {row.outcome.rstrip('.')}."
    change = largest(found, row)
    if change is None:
        return f"it {_price(row.cost)}; the stretch gives no figures to compare."
    what = _words(found, change, row.switch.on)
    if abs(change.share) >= found.wish.tolerance:
        if row.switch.on:
            return f"it {_price(row.cost)}; without it {what}: keep it."
        return f"it {_price(row.cost)}, and with it {what}: switch it on if its data are sound."
    within = f"{_percent(found.wish.tolerance)}"
    if not row.switch.on:
        return f"it {_price(row.cost)}; with it {what}: leave it out for figures within {within}."
    if row.cost <= 1.0 + _SAME_COST:
        return f"it {_price(row.cost)}; without it {what}: keep it, or leave it out."
    return f"it {_price(row.cost)}; without it {what}: leave it out for figures within {within}."


def _price(cost: float) -> str:
    if abs(cost - 1.0) <= _SAME_COST:
        return "costs nothing that can be measured"
    return f"costs {cost:.2f} times" if cost > 1.0 else f"makes steps cheaper, {cost:.2f} times"


def _words(found: Costs, change: Change, on: bool) -> str:
    whose = f" of {found.names[change.pantograph]}" if len(found.names) > 1 else ""
    what = _WORDS[change.figure] + (whose if change.figure != UPLIFT else "")
    if math.isinf(change.share):
        return f"{what} comes or goes"
    if abs(change.share) < _NOTHING:
        return "no figure changes"
    of = " of the mean" if change.figure in ("max_N", "min_N") else ""
    percent = 100 * change.share
    number = f"{percent:+.0f}" if abs(percent) >= 10 else f"{percent:+.2g}"
    return f"{what} changes by {number} %{of}, most of all"


def _percent(share: float) -> str:
    return f"{100 * share:g} %"
