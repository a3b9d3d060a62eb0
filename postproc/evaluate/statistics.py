"""Statistics of contact forces, uplifts and dropper forces as EN 50317 and EN 50318 define them.

Contact forces are filtered over the whole record first and cut to the evaluation stretch then, so
that end effects of the filter do not reach the ends of the stretch. Each pantograph is evaluated
while it is itself within the stretch. Lateral places of contact wires on the strips are those of
every step of a run, beside the strips' length.

Derivatives of the statistics by parameters: with the filtered force F of n records and its
derivative F' by a parameter, which is filtered in the same way as filters are linear,

    mean' = mean(F'),    sigma' = mean((F - mean) (F' - mean')) / sigma,

and an extreme changes as the record in which it stands.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.postproc.evaluate import filters
from catenary.postproc.files.header import in_sentence
from catenary.postproc.read.results import Results, in_stretch

SHORTEST_ARC = 5e-3
HISTOGRAM_BIN, MOST_BINS = 10.0, 1000
_NAN = float("nan")
# Standard deviations from the mean to statistical extremes.
_STATISTICAL = 3.0


@dataclass(frozen=True)
class PantographStatistics:
    """One pantograph in the evaluation stretch; NaN throughout if ``complaint`` is not empty.

    Attributes
    ----------
    name : "leading", "trailing", ...
    mean, std, maximum, minimum : of the contact force, 20 Hz low-pass [N]
    std_0_5, std_5_20 : standard deviations of the bands 0-5 and 5-20 Hz [N]
    stat_max, stat_min : mean + 3 std and mean - 3 std [N]
    loss_percent : share of time without contact, from the unfiltered force [%]
    arcing_percent : the same without losses shorter than 5 ms [%]
    contact_height_range : highest minus lowest height of the contact wire at the pan head, 20 Hz
        low-pass [m]
    histogram_edges : (n + 1,) edges of the bins of the 20 Hz force [N]
    histogram_percent : (n,) share of time in each bin [%]
    complaint : why there are no statistics, a sentence
    covered : whether its record covers the evaluation stretch
    unjudged : why no criterion is judged by statistics that there are, a sentence
    """

    name: str
    mean: float = _NAN
    std: float = _NAN
    std_0_5: float = _NAN
    std_5_20: float = _NAN
    maximum: float = _NAN
    minimum: float = _NAN
    stat_max: float = _NAN
    stat_min: float = _NAN
    loss_percent: float = _NAN
    arcing_percent: float = _NAN
    contact_height_range: float = _NAN
    histogram_edges: np.ndarray = field(default_factory=lambda: np.zeros(1))
    histogram_percent: np.ndarray = field(default_factory=lambda: np.zeros(0))
    complaint: str = ""
    covered: bool = True
    unjudged: str = ""


@dataclass(frozen=True)
class SupportStatistics:
    """Uplift of the contact wire at the steady arms over every step of the run.

    Attributes
    ----------
    x : (n_arms,) positions of all arms [m]
    uplift : (n_arms,) largest uplift at each [m]
    evaluated : (n_arms,) bool, whether the arm stands in the evaluation stretch
    maximum : largest uplift of the evaluated ones [m], NaN if there are none
    """

    x: np.ndarray
    uplift: np.ndarray
    evaluated: np.ndarray
    maximum: float


@dataclass(frozen=True)
class DropperStatistics:
    """Dropper forces over every step of the run.

    Attributes
    ----------
    x : (n_droppers,) positions of all droppers [m]
    highest, lowest : (n_droppers,) largest and smallest force of each [N]
    evaluated : (n_droppers,) bool, whether the dropper hangs in the evaluation stretch
    slackened : (n_droppers,) bool, whether the force of each was zero at some time and not always,
        as that of one that is missing; of none if they cannot slacken
    maximum, minimum : largest and smallest force of the evaluated ones [N], NaN if there are none
    """

    x: np.ndarray
    highest: np.ndarray
    lowest: np.ndarray
    evaluated: np.ndarray
    slackened: np.ndarray
    maximum: float
    minimum: float

    @property
    def n_slackened(self) -> int:
        """Number of evaluated droppers that slackened."""
        return int(np.count_nonzero(self.evaluated & self.slackened))


@dataclass(frozen=True)
class RunStatistics:
    """All statistics of a run."""

    pantographs: Sequence[PantographStatistics]
    supports: SupportStatistics
    droppers: DropperStatistics
    lateral: Sequence[LateralRange] = ()

    @property
    def complaints(self) -> list[str]:
        """Sentences that say which statistics could not be formed, and why."""
        reasons = (p.complaint or p.unjudged for p in self.pantographs)
        return [sentence for sentence in reasons if sentence]


def evaluate(results: Results) -> RunStatistics:
    """Statistics of a run, as far as its record goes. Not collective."""
    names = results.pantograph_names()
    pantographs = [_pantograph(name, p, results) for p, name in enumerate(names)]
    lateral = lateral_ranges(results)
    return RunStatistics(pantographs, _supports(results), _droppers(results), lateral)


def covers(position: np.ndarray, evaluation: tuple[float, float]) -> bool:
    """Whether a pantograph's record runs through the whole stretch, to within one step.

    Parameters
    ----------
    position : ndarray, shape (n,)
        Places of the pantograph, ascending [m].
    evaluation : tuple of float
        Stretch whose statistics are judged, from and to [m].
    """
    if position.size < 2:
        return False
    step = float(np.diff(position).max())
    return bool(position[0] <= evaluation[0] + step and position[-1] >= evaluation[1] - step)


class Uncovered(InputError):
    """The record of a pantograph does not cover the evaluation stretch."""


def evaluated_force(results: Results, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Records (n,) bool of a pantograph in the evaluation stretch, and its force there below 20 Hz
    [N].

    Raises
    ------
    InputError
        If there are no statistics of it, with the reason; `Uncovered` if that is a part that its
        record lacks.
    """
    start, end = results.evaluation
    position = results.column("contact_position", number)
    if not covers(position, (start, end)):
        seen = f"{position[0]:.0f} to {position[-1]:.0f} m" if position.size else "nothing"
        raise Uncovered(
            f"its record covers {seen}, the evaluation stretch is {start:.0f} to {end:.0f} m"
        )
    within = (position >= start) & (position <= end)
    del position
    time = max(np.count_nonzero(within) - 1, 0) * results.dt
    if time < 1.0 / filters.CUT_OFF:
        raise InputError(
            f"it passes the evaluation stretch within {1e3 * time:.3g} ms, less than a period of "
            f"the 20 Hz filter ({1e3 / filters.CUT_OFF:g} ms)"
        )
    return within, filters.contact_force(results, number)[within]


def contact_statistics(
    name: str,
    position: np.ndarray,
    force: np.ndarray,
    wire_height: np.ndarray,
    dt: float,
    evaluation: tuple[float, float],
) -> PantographStatistics:
    """Statistics of one pantograph whose record covers the evaluation stretch. Not collective.

    Parameters
    ----------
    name : str
        Name of the pantograph.
    position : ndarray, shape (n,)
        Places of the pantograph along the track [m].
    force : ndarray, shape (n,)
        Unfiltered contact force [N].
    wire_height : ndarray, shape (n,)
        Height of the contact wire at the pan head [m].
    dt : float
        Time step [s].
    evaluation : tuple of float
        Stretch whose statistics are judged, from and to [m].

    Raises
    ------
    InputError
        If the time step is too long for the 20 Hz filter.
    """
    within = (position >= evaluation[0]) & (position <= evaluation[1])
    return PantographStatistics(
        name=name,
        **_of_force(force, filters.low_pass(force, dt)[within], within, dt),
        contact_height_range=_height_range(wire_height, within, dt),
    )


def _of_force(
    force: np.ndarray, filtered: np.ndarray, within: np.ndarray, dt: float
) -> dict[str, Any]:
    """Statistics of the force (n,) of a pantograph, with the filtered one within the stretch; at no
    time more than a few records are in memory."""
    mean, std = float(filtered.mean()), float(filtered.std())
    edges, percent = histogram(filtered)
    maximum, minimum = float(filtered.max()), float(filtered.min())
    del filtered
    lost = force <= 0.0
    return {
        "mean": mean,
        "std": std,
        "std_0_5": float(filters.band_0_5(force, dt)[within].std()),
        "std_5_20": float(filters.band_5_20(force, dt)[within].std()),
        "maximum": maximum,
        "minimum": minimum,
        "stat_max": mean + _STATISTICAL * std,
        "stat_min": mean - _STATISTICAL * std,
        "loss_percent": 100.0 * float(lost[within].mean()),
        # A loss that an end of the stretch cuts is as long as it is.
        "arcing_percent": 100.0 * float(without_short_losses(lost, dt)[within].mean()),
        "histogram_edges": edges,
        "histogram_percent": percent,
    }


def _height_range(wire_height: np.ndarray, within: np.ndarray, dt: float) -> float:
    return float(np.ptp(filters.low_pass(wire_height, dt)[within]))


def without_short_losses(lost: np.ndarray, dt: float) -> np.ndarray:
    """``lost`` with the intervals shorter than ``SHORTEST_ARC`` set to contact, (n,) bool."""
    padded = np.concatenate([[0], lost.astype(np.int8), [0]])
    change = np.diff(padded)
    starts, ends = np.flatnonzero(change == 1), np.flatnonzero(change == -1)
    kept = np.zeros_like(lost)
    for start, end in zip(starts, ends, strict=True):
        if (end - start) * dt >= SHORTEST_ARC * (1.0 - 1e-9):  # exactly the shortest counts
            kept[start:end] = True
    return kept


def histogram(force: np.ndarray, width: float = HISTOGRAM_BIN) -> tuple[np.ndarray, np.ndarray]:
    """Edges (n + 1,) [N] at multiples of ``width`` and share of time (n,) [%] of a force record.

    Bins are ten times as wide, or more, where there would be too many of them: an unstable run may
    have reached any force.
    """
    while np.ptp(force) > MOST_BINS * width:
        width *= 10.0
    first = np.floor(force.min() / width)
    last = np.floor(force.max() / width) + 1
    edges = width * np.arange(first, last + 1)
    counts, _ = np.histogram(force, edges)
    return edges, 100.0 * counts / force.size


def _pantograph(name: str, number: int, results: Results) -> PantographStatistics:
    """Statistics of a pantograph; its histories are read one after the other."""
    if results.attributes.get("excitation"):
        return PantographStatistics(
            name, complaint="No statistics of contact forces: the line is excited without a train."
        )
    try:
        within, filtered = evaluated_force(results, number)
        force = results.column("contact_force", number)
        return PantographStatistics(
            name=name,
            **_of_force(force, filtered, within, results.dt),
            contact_height_range=_height_range(
                results.column("wire_height", number), within, results.dt
            ),
            unjudged=_unjudged(in_sentence(name), force[within], results),
        )
    except InputError as error:
        complaint = f"No statistics of {in_sentence(name)}: {error}."
        covered = not isinstance(error, Uncovered)
        return PantographStatistics(name, complaint=complaint, covered=covered)


def _unjudged(who: str, force: np.ndarray, results: Results) -> str:
    """Reason for not judging a force (n,) of the evaluation stretch, "" if it is judged."""
    if not force.any():
        return f"Nothing is judged of {who}: its contact force is zero all the way."
    start, end = results.evaluation
    masts = results.line("support_x")
    spans = np.diff(masts)[(masts[1:] > start) & (masts[:-1] < end)]
    # Lengths of spans come from sums, which round.
    if end - start < spans.min(initial=np.inf) * (1.0 - 1e-9):
        return (
            f"Nothing is judged of {who}: the evaluation stretch of {end - start:.4g} m is "
            f"shorter than a span ({spans.min(initial=np.inf):.4g} m)."
        )
    return ""


def _supports(results: Results) -> SupportStatistics:
    x = results.line("arm_x")
    uplift = results.extremes("arm_uplift")[1]
    evaluated = in_stretch(x, *results.evaluation)
    return SupportStatistics(x, uplift, evaluated, _if_any(uplift[evaluated], np.max))


def _droppers(results: Results) -> DropperStatistics:
    x = results.line("dropper_x")
    lowest, highest = results.extremes("dropper_force")
    evaluated = in_stretch(x, *results.evaluation)
    return DropperStatistics(
        x,
        highest,
        lowest,
        evaluated,
        (lowest <= 0.0) & (highest > 0.0) & slackens_at_all(results),
        _if_any(highest[evaluated], np.max),
        _if_any(lowest[evaluated], np.min),
    )


def slackens_at_all(results: Results) -> bool:
    """Whether droppers of a run slacken at zero force: not if they may push, or have no force at
    rest."""
    kept = results.fact("slack_stiffness_share")
    if np.isnan(kept):  # a file without this fact, of a version with one effect for it
        on = results.attributes["effects_on"]
        return any(name == "dropper_slackening" for name, *_ in on)
    return bool(kept < 1.0)


def _if_any(values: np.ndarray, which: Callable[..., Any]) -> float:
    return float(which(values)) if values.size else _NAN


def slack_times(results: Results) -> np.ndarray:
    """Time for which the force of each dropper was zero, (n_droppers,) [s]. Not collective.

    From the records of the line, each of which stands for the time up to the next one: a dropper
    that is recorded at no time has NaN, and one that cannot slacken zero.
    """
    n_droppers = results.line("dropper_x").size
    if not slackens_at_all(results):
        return np.zeros(n_droppers)
    times = np.full(n_droppers, np.nan)
    times[results.recorded_columns("dropper_force")] = 0.0
    interval = results.line_record.every * results.dt
    for _, columns, force in results.written_blocks("dropper_force"):
        times[columns] += interval * np.count_nonzero(force <= 0.0, axis=0)
    return times


@dataclass(frozen=True)
class LateralRange:
    """One pantograph over every step of a run with lateral motion.

    Attributes
    ----------
    name : "leading", "trailing", ...
    place : farthest place of a contact wire from the middle of a strip, to the left [m]
    time, x : when that was [s], and where along the track [m]
    half_length : of the strips [m], NaN if it is not known
    left_time, left_x : when and where a wire first was beyond the end of a strip, NaN if it never
        was
    """

    name: str
    place: float
    time: float
    x: float
    half_length: float
    left_time: float = math.nan
    left_x: float = math.nan

    @property
    def left(self) -> bool:
        """Whether a wire has left a strip."""
        return not math.isnan(self.left_time)


def lateral_ranges(results: Results) -> list[LateralRange]:
    """Ranges of all pantographs, none without lateral motion. Not collective."""
    if not results.has("lateral_place") or not results.n_rows("time"):
        return []
    half_lengths = results.facts_of("strip_half_length")
    found = []
    columns = [list(own.values()) for own in results.contact_columns()]
    for p, (name, own) in enumerate(zip(results.pantograph_names(), columns, strict=True)):
        farthest, at, left = 0.0, 0, -1
        half = float(half_lengths[p])
        for part, places in results.blocks("lateral_place"):
            mine = np.where(np.isfinite(places[:, own]), places[:, own], 0.0)
            worst = mine[np.arange(len(mine)), np.abs(mine).argmax(axis=1)]
            row = int(np.abs(worst).argmax())
            if abs(worst[row]) > abs(farthest) or part.start == 0:
                farthest, at = float(worst[row]), part.start + row
            beyond = np.flatnonzero(np.abs(worst) > half)
            if left < 0 and beyond.size:
                left = part.start + int(beyond[0])
        position = results.column("contact_position", p)
        when = results.time_at(at), float(position[at])
        gone = (results.time_at(left), float(position[left])) if left >= 0 else (math.nan, math.nan)
        found.append(LateralRange(name, farthest, *when, half, *gone))
    return found


def left_strips_sentence(p: LateralRange) -> str:
    """Sentence on a wire that left a strip, with time and place."""
    return (
        f"At {p.left_time:.4g} s, {p.left_x:.4g} m, a contact wire leaves the strips of "
        f"{in_sentence(p.name)}, which end {p.half_length:.3g} m beside their middle: it gets "
        f"{abs(p.place):.3g} m away from that. What follows assumes that it stays on them."
    )


def lateral_table(ranges: list[LateralRange]) -> list[dict[str, Any]]:
    """Plain values for the summary."""
    return [
        {
            "name": p.name,
            "max_place_mm": 1e3 * p.place,
            "time_s": p.time,
            "at_m": p.x,
            "strip_half_length_mm": 1e3 * p.half_length,
            "left_strip_s": p.left_time,
            "left_strip_at_m": p.left_x,
        }
        for p in ranges
    ]


class ForceDerivatives(NamedTuple):
    """Derivatives (m,) by m parameters of the statistics of a contact force [N], named as in
    ``PantographStatistics``."""

    mean: np.ndarray
    std: np.ndarray
    maximum: np.ndarray
    minimum: np.ndarray
    stat_max: np.ndarray
    stat_min: np.ndarray


def force_derivatives(
    force: np.ndarray,
    by_force: np.ndarray,
    within: np.ndarray,
    dt: float,
    by_place: np.ndarray | None = None,
) -> ForceDerivatives:
    """Derivatives of the statistics of a contact force. Not collective.

    Parameters
    ----------
    force : ndarray, shape (n,)
        Force of all records [N].
    by_force : ndarray, shape (n, m)
        Its derivatives by m parameters.
    within : ndarray, shape (n,), dtype bool
        Records in the evaluated stretch.
    dt : float
        Time between two records [s].
    by_place : ndarray, shape (n, m), optional
        Derivatives of the pantograph's position over the train's speed [s], where
        parameters change either: the stretch stays, so that records are compared at equal
        places.

    Raises
    ------
    InputError
        If the records are too far apart for the 20 Hz filter.
    """
    filtered = filters.low_pass(force, dt)
    changes = filters.low_pass(by_force, dt)
    if by_place is not None and by_place.any():
        changes = changes - _rate_of_change(filtered, dt)[:, None] * by_place
    filtered, changes = filtered[within], changes[within]
    mean, std = changes.mean(axis=0), filtered.std()
    about = filtered - filtered.mean()
    by_std = about @ (changes - mean) / (filtered.size * std) if std > 0.0 else np.zeros(mean.size)
    return ForceDerivatives(
        mean,
        by_std,
        changes[int(np.argmax(filtered))],
        changes[int(np.argmin(filtered))],
        mean + _STATISTICAL * by_std,
        mean - _STATISTICAL * by_std,
    )


def largest_derivatives(values: np.ndarray, by_values: np.ndarray) -> np.ndarray:
    """Derivatives (m,) of the largest of ``values`` (n, k), whose own are ``by_values`` (n, m, k);
    NaN if there are none."""
    if not values.size:
        return np.full(by_values.shape[1], np.nan)
    record, column = np.unravel_index(int(np.argmax(values)), values.shape)
    return np.asarray(by_values[record, :, column])


def _rate_of_change(values: np.ndarray, dt: float) -> np.ndarray:
    """Rate of change of records, by differences of the fourth order, of the second at both ends."""
    slope = np.gradient(values, dt)
    if values.size > 4:
        inner = 8.0 * (values[3:-1] - values[1:-3]) - (values[4:] - values[:-4])
        slope[2:-2] = inner / (12.0 * dt)
    return np.asarray(slope)
