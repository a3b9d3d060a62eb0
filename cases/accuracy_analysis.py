"""What runs of different settings say of accuracy: errors, orders, Pareto front, advice.

Pure functions on figures that are there already; ``cases/accuracy.py`` makes the runs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from catenary.solver.errors import InputError


class Quantity(NamedTuple):
    """A figure whose error is looked at: its key in a summary, its unit, and the figure of the
    reference that makes 100 %."""

    key: str
    unit: str
    scale: str


HISTORY = "history"
QUANTITIES = {
    "mean": Quantity("mean_N", "N", "mean_N"),
    "std": Quantity("std_N", "N", "std_N"),
    "std_0_5": Quantity("std_0_5_N", "N", "std_0_5_N"),
    "std_5_20": Quantity("std_5_20_N", "N", "std_5_20_N"),
    "max": Quantity("max_N", "N", "std_N"),
    "min": Quantity("min_N", "N", "std_N"),
    "uplift": Quantity("max_uplift_mm", "mm", "max_uplift_mm"),
    HISTORY: Quantity("", "N", "std_N"),
}
WORDS = {"std": "the standard deviation (0-20 Hz)", HISTORY: "the force history (rms, 0-20 Hz)"}


@dataclass(frozen=True)
class Found:
    """What one run found.

    Attributes
    ----------
    pantographs : a table of figures of each, keys as in ``summary.json``
    uplift : largest at a steady arm [mm], None if there is none
    histories : force below 20 Hz at common positions of each pantograph, (n,) [N]
    """

    pantographs: Sequence[dict[str, Any]]
    uplift: float | None
    histories: Sequence[np.ndarray]


@dataclass(frozen=True)
class Row:
    """A level of an axis beside what it is compared with.

    Attributes
    ----------
    axis, level : names
    outcome : "done", or what broke or is not possible
    sizes : what is refined, by name
    errors : quantity -> difference from the reference in its unit, of the pantograph where it is
        largest, signed (``HISTORY``: rms)
    percent : quantity -> its magnitude in percent of the reference's scale
    cost : wall time of the march per simulated second, median [s/s]
    timings : how many runs that median is of
    estimate : the run's own estimate of the error of the history [N]
    iterations : rounds a step takes: of its small problem, or corrections (whole solves)
    """

    axis: str
    level: str
    outcome: str
    sizes: dict[str, float] = field(default_factory=dict)
    errors: dict[str, float] = field(default_factory=dict)
    percent: dict[str, float] = field(default_factory=dict)
    cost: float = math.nan
    timings: int = 0
    estimate: float = math.nan
    iterations: float = math.nan

    @property
    def done(self) -> bool:
        """Whether the run came to its end and could be compared."""
        return self.outcome == "done" and bool(self.errors)


def compare(found: Found, reference: Found) -> tuple[dict[str, float], dict[str, float]]:
    """Errors in units and in percent, see ``Row``; what either run does not have is left out."""
    errors: dict[str, float] = {}
    percent: dict[str, float] = {}
    for name, quantity in QUANTITIES.items():
        for own, other, scale in _pairs(name, quantity, found, reference):
            if scale <= 0.0 or math.isnan(own - other):
                continue
            share = 100.0 * abs(own - other) / scale
            if name not in percent or share > percent[name]:
                errors[name], percent[name] = own - other, share
    return errors, percent


def _pairs(
    name: str, quantity: Quantity, found: Found, reference: Found
) -> list[tuple[float, float, float]]:
    """Own value, the reference's and the scale, of each pantograph or of the line."""
    if name == "uplift":
        if found.uplift is None or reference.uplift is None:
            return []
        return [(found.uplift, reference.uplift, reference.uplift)]
    pairs = []
    together = zip(found.pantographs, reference.pantographs, strict=True)
    for p, (own, other) in enumerate(together):
        if own.get("std_N") is None or other.get("std_N") is None:
            continue
        if name == HISTORY:
            difference = found.histories[p] - reference.histories[p]
            rms = float(np.sqrt(np.mean(difference**2)))
            pairs.append((rms, 0.0, float(other[quantity.scale])))
        else:
            figures = own[quantity.key], other[quantity.key], abs(other[quantity.scale])
            pairs.append((float(figures[0]), float(figures[1]), float(figures[2])))
    return pairs


def observed_orders(rows: Sequence[Row], size: str, quantity: str) -> list[tuple[float, float]]:
    """Size and observed order towards the next finer level, coarsest first.

    The order between sizes a > b with errors e and f is log(e / f) / log(a / b). Levels that
    broke, and errors of zero, have none.
    """
    known = [r for r in rows if r.done and size in r.sizes and r.errors.get(quantity, 0.0) != 0.0]
    known.sort(key=lambda row: -row.sizes[size])
    result = []
    for coarse, fine in zip(known[:-1], known[1:], strict=True):
        refined = math.log(coarse.sizes[size] / fine.sizes[size])
        smaller = math.log(abs(coarse.errors[quantity] / fine.errors[quantity]))
        result.append((coarse.sizes[size], smaller / refined))
    return result


def pareto(rows: Sequence[Row], quantity: str = HISTORY) -> list[Row]:
    """The rows that no other beats in both cost and error, cheapest first."""
    known = [row for row in rows if row.done and quantity in row.percent and row.cost > 0.0]
    known.sort(key=lambda row: (row.cost, row.percent[quantity]))
    front: list[Row] = []
    for row in known:
        if not front or row.percent[quantity] < front[-1].percent[quantity]:
            front.append(row)
    return front


def cheapest(rows: Sequence[Row], quantity: str, target: float) -> Row | None:
    """The cheapest row within ``target`` [%] that is not there by chance, None if none is.

    Errors of statistics change their sign as settings grow finer, and are small where they do. A
    row counts only if all rows that are at least as fine in every size are within the target, too.
    """
    known = [row for row in rows if row.done and quantity in row.percent and row.cost > 0.0]

    def finer(row: Row, than: Row) -> bool:
        return all(row.sizes[size] <= than.sizes[size] * (1 + 1e-9) for size in than.sizes)

    within = [
        row
        for row in known
        if all(other.percent[quantity] <= target for other in known if finer(other, row))
    ]
    return min(within, key=lambda row: row.cost, default=None)


def advice(rows: Sequence[Row], quantity: str, target: float) -> str:
    """What to take for an error of at most ``target`` [%], as a sentence."""
    what = WORDS.get(quantity, f"the {quantity}")
    row = cheapest(rows, quantity, target)
    if row is None:
        known = [r.percent[quantity] for r in rows if r.done and quantity in r.percent]
        best = f"; the smallest error among them is {min(known):.2g} %" if known else ""
        return f"No setting tried is reliably within {target:g} % in {what}{best}."
    parts = []
    if "dt" in row.sizes:
        parts.append(f"dt = {1e3 * row.sizes['dt']:g} ms")
    if "h" in row.sizes:
        parts.append(f"elements per gap = {round(1.0 / row.sizes['h'])}")
    speed = 1.0 / row.cost
    times = f"{speed:.3g} times {'faster' if speed >= 1 else 'the speed'}"
    times += " than real time" if speed >= 1 else " of real time"
    return (
        f"For {target:g} % in {what}: {', '.join(parts)}; error {row.percent[quantity]:.2g} %, "
        f"{times}."
    )


def parse_target(text: str) -> float:
    """Percent of ``1%`` or ``1``.

    Raises
    ------
    InputError
        If it is no number above 0 and up to 100.
    """
    try:
        value = float(text.strip().removesuffix("%"))
    except ValueError:
        value = math.nan
    if not 0.0 < value <= 100.0:
        raise InputError(f"--target {text} must be a percentage above 0 and up to 100, e.g. 1%")
    return value
