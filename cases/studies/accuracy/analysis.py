"""Accuracy from runs of different settings: errors, orders, Pareto front, advice.

Pure functions on figures that are there already; ``cases/studies/accuracy/runs.py`` makes the runs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from catenary.base.errors import InputError


class Quantity(NamedTuple):
    """A figure whose error is measured: its key in a summary, its unit, and the key of the figure
    of the reference that percentages refer to."""

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
    """Result of one run.

    Attributes
    ----------
    pantographs : statistics of each, those of the line with each
    histories : force below 20 Hz at common positions of each pantograph, (n,) [N]
    """

    pantographs: Sequence[dict[str, Any]]
    histories: Sequence[np.ndarray]


@dataclass(frozen=True)
class Row:
    """A level of an axis beside what it is compared with.

    Attributes
    ----------
    axis, level : names
    outcome : "done", or the reason why there is no result
    sizes : refined sizes by name
    errors : quantity -> difference from the reference in its unit, signed (``HISTORY``: rms), of
        the pantograph with the largest one
    percent : quantity -> magnitude of the error in percent of the reference's scale
    cost : processor time of the march per simulated second, the least of all timings [s/s]
    timings : number of timings
    estimate : the run's own estimate of the error of the history [N]
    iterations : mean rounds in a step: of its small problem, or corrections (whole solves)
    by_step, by_mesh : quantity -> errors of the step alone and of the mesh alone in percent, if the
        axis refines both; they may cancel in ``percent``
    remarks : sentences on what decides the run's results
    """

    axis: str
    level: str
    outcome: str
    sizes: Mapping[str, float] = field(default_factory=dict)
    errors: dict[str, float] = field(default_factory=dict)
    percent: dict[str, float] = field(default_factory=dict)
    cost: float = math.nan
    timings: int = 0
    estimate: float = math.nan
    iterations: float = math.nan
    by_step: dict[str, float] = field(default_factory=dict)
    by_mesh: dict[str, float] = field(default_factory=dict)
    remarks: Sequence[str] = ()

    def worst(self, quantity: str) -> float:
        """The largest of the whole error and those of step and mesh alone [%]."""
        parts = (self.percent, self.by_step, self.by_mesh)
        return max((part[quantity] for part in parts if quantity in part), default=math.inf)

    @property
    def done(self) -> bool:
        """Whether the run came to its end and could be compared."""
        return self.outcome == "done" and bool(self.errors)


def compare(
    found: Found, reference: Found, scale_of: Found | None = None
) -> tuple[dict[str, float], dict[str, float]]:
    """Errors of ``found`` in units and in percent, see ``Row``; only of figures of both runs.

    ``scale_of`` is the run whose figures percentages refer to, the reference if it is not given.
    """
    errors: dict[str, float] = {}
    percent: dict[str, float] = {}
    for name, quantity in QUANTITIES.items():
        for own, other, scale in _pairs(quantity, found, reference, scale_of or reference):
            if scale <= 0.0 or math.isnan(own - other):
                continue
            share = 100.0 * abs(own - other) / scale
            if name not in percent or share > percent[name]:
                errors[name], percent[name] = own - other, share
    return errors, percent


def _pairs(
    quantity: Quantity, found: Found, reference: Found, scale_of: Found
) -> Iterator[tuple[float, float, float]]:
    """Own value, the reference's and the scale, of each pantograph; of the history its rms."""
    tables = found.pantographs, reference.pantographs, scale_of.pantographs
    for p, (own, other, whole) in enumerate(zip(*tables, strict=True)):
        if any(table[quantity.key or quantity.scale] is None for table in (own, other, whole)):
            continue
        scale = abs(float(whole[quantity.scale]))
        if quantity.key:
            yield float(own[quantity.key]), float(other[quantity.key]), scale
        else:
            difference = found.histories[p] - reference.histories[p]
            yield float(np.sqrt(np.mean(difference**2))), 0.0, scale


def uncertainties(
    reference: Found | None, chains: Sequence[Sequence[Found | None]]
) -> dict[str, float]:
    """Uncertainty of a reference itself, by quantity [%]; infinite if it is not known.

    Each of ``chains`` holds three runs; each run is twice as coarse in one size as the one before.
    With the differences d of the first two runs and D of the last two, the observed order is
    p = log2(D / d) and the error of the first run 1.25 d / (2^p - 1). Errors of all sizes are
    added. The order is taken as 2 at most, that of all schemes; if it is below 1/2, the error is
    three times the larger difference.

    Source: P. J. Roache, J. Fluids Eng. 116 (1994) 405-413, the grid convergence index.
    """
    errors = dict.fromkeys(QUANTITIES, 0.0)
    for fine, middle, coarse in chains:
        if reference is None or fine is None or middle is None or coarse is None:
            return dict.fromkeys(QUANTITIES, math.inf)
        near = compare(middle, fine, reference)[1]
        far = compare(coarse, middle, reference)[1]
        for name in errors:
            errors[name] += extrapolated_error(near.get(name, math.inf), far.get(name, math.inf))
    return errors


_SAFETY, _HIGHEST_ORDER, _LOWEST_ORDER, _WITHOUT_ORDER = 1.25, 2.0, 0.5, 3.0


def extrapolated_error(near: float, far: float) -> float:
    """Error of the finest of three runs, by Richardson's extrapolation, in the unit of ``near``.

    ``near`` is the difference of the finest and the middle run, ``far`` that of the middle and the
    coarsest.
    """
    if near == 0.0 or math.isinf(near) or math.isinf(far):
        return near
    order = math.log2(far / near) if far > 0.0 else -math.inf
    if order < _LOWEST_ORDER:
        return _WITHOUT_ORDER * max(near, far)
    return _SAFETY * near / (2.0 ** min(order, _HIGHEST_ORDER) - 1.0)


def separate(
    found: Found, step_alone: Found | None, reference: Found
) -> tuple[dict[str, float], dict[str, float]]:
    """Errors of the step and of the mesh alone [%], both empty where they are not known.

    ``step_alone`` has the mesh of ``found`` and the step of ``reference``.
    """
    if step_alone is None:
        return {}, {}
    by_step = compare(found, step_alone, reference)[1]
    return by_step, compare(step_alone, reference)[1]


def observed_orders(rows: Sequence[Row], size: str, quantity: str) -> list[tuple[float, float]]:
    """Size and observed order towards the next finer level, coarsest first.

    ``size`` is the size that varies, "dt" or "h", and ``quantity`` the one whose errors are
    compared. The order between sizes a > b with errors e and f is log(e / f) / log(a / b). Levels
    that broke, and errors of zero, have none.
    """
    known = [r for r in rows if r.done and size in r.sizes and r.errors.get(quantity, 0.0) != 0.0]
    known.sort(key=lambda row: -row.sizes[size])
    result = []
    for coarse, fine in zip(known[:-1], known[1:], strict=True):
        refined = math.log(coarse.sizes[size] / fine.sizes[size])
        smaller = math.log(abs(coarse.errors[quantity] / fine.errors[quantity]))
        result.append((coarse.sizes[size], smaller / refined))
    return result


def pareto(rows: Sequence[Row]) -> list[Row]:
    """The rows that no other beats in both cost and error of the force history, cheapest first."""
    known = [row for row in rows if row.done and HISTORY in row.percent and row.cost > 0.0]
    known.sort(key=lambda row: (row.cost, row.percent[HISTORY]))
    front: list[Row] = []
    for row in known:
        if not front or row.percent[HISTORY] < front[-1].percent[HISTORY]:
            front.append(row)
    return front


def cheapest(rows: Sequence[Row], quantity: str, target: float) -> Row | None:
    """The cheapest row whose error of ``quantity`` is reliably within ``target`` [%], or None.

    An error may be small by chance: as settings are refined it may change its sign, and errors of
    step and mesh may cancel. So the errors of step and mesh alone must be within the target, too,
    and the errors of all rows that are at least as fine in every size.
    """
    known = [row for row in rows if row.done and quantity in row.percent and row.cost > 0.0]

    def finer(row: Row, than: Row) -> bool:
        return all(row.sizes[size] <= than.sizes[size] * (1 + 1e-9) for size in than.sizes)

    within = [
        row
        for row in known
        if all(other.worst(quantity) <= target for other in known if finer(other, row))
    ]
    return min(within, key=lambda row: row.cost, default=None)


# The reference's own uncertainty is at most this share of the target, or nothing is recommended.
_SHARE = 1.0 / 3.0
# Beyond this error of the force history [%] an advice on another quantity says so.
_WRONG_COURSE = 10.0


def advice(
    rows: Sequence[Row], quantity: str, target: float, uncertainty: float = 0.0, without: str = ""
) -> str:
    """Recommend settings for an error of at most ``target`` [%], in a sentence.

    Parameters
    ----------
    rows : of one axis
    uncertainty : of the reference itself [%]
    without : whose error is not in the rows, "step" or "mesh"; empty if both are
    """
    what = WORDS.get(quantity, f"the {quantity}")
    if not uncertainty <= _SHARE * target:
        own = f"may be wrong by {uncertainty:.2g} % itself"
        if math.isinf(uncertainty):
            own = "has an uncertainty that is not known"
        return (
            f"Settings for {target:g} % in {what} are not known: the reference {own}, and must be "
            "within a third of the target."
        )
    row = cheapest(rows, quantity, target)
    if row is None:
        known = [r.worst(quantity) for r in rows if r.done and quantity in r.percent]
        best = f"; the smallest error among them is {min(known):.2g} %" if known else ""
        return f"No setting tried is reliably within {target:g} % in {what}{best}."
    parts = []
    if "dt" in row.sizes:
        parts.append(f"dt = {1e3 * row.sizes['dt']:g} ms")
    if "h" in row.sizes:
        parts.append(f"elements per gap = {round(1.0 / row.sizes['h'])}")
    alone = ""
    if quantity in row.by_step and quantity in row.by_mesh:
        alone = f" (step {row.by_step[quantity]:.2g}, mesh {row.by_mesh[quantity]:.2g})"
    speed = 1.0 / row.cost
    times = f"{speed:.3g} times {'faster' if speed >= 1 else 'the speed'}"
    times += " than real time" if speed >= 1 else " of real time"
    aside = f"; the error of the {without} comes on top and is not judged" if without else ""
    history = row.percent.get(HISTORY, 0.0)
    if quantity != HISTORY and history > _WRONG_COURSE:
        # A deviation may be right over a whole stretch while no maximum is.
        aside += f"; the force history is wrong by {history:.2g} % there, and with it its extremes"
    return (
        f"For {target:g} % in {what}: {', '.join(parts)}; error {row.percent[quantity]:.2g} %"
        f"{alone}, {times}{aside}."
    )


def parse_target(text: str, option: str = "--target") -> float:
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
        raise InputError(f"{option} {text} must be a percentage above 0 and up to 100, e.g. 1%")
    return value
