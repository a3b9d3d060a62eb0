"""Distance between two pantographs: their statistics over it, best and worst, and what fails.

The trailing pantograph starts at ``train.start_m`` at every distance, so that it runs the same way;
the leading one is that far ahead. One pantograph alone is marched beside them, for reference. Two
lengths explain which distances are bad:

- **ringing**: a span that the leading one has passed rings in the lowest pass band of the line.
  The trailing one comes after the time d / v and finds it at the phase 2 pi f d / v, so that good
  and bad distances repeat every v / f;
- **travel**: waves of the leading one run back along the contact wire with c. What meets the
  trailing one was sent d c / (c + v) ahead of it, so that the place in the span from which it came
  repeats every L (c + v) / c.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from catenary.base.errors import InputError
from catenary.cases.scene.scene import Scene, problem_of
from catenary.cases.studies.asked import Distances
from catenary.cases.studies.sweep.jobs import Ended, statistics_of
from catenary.cases.studies.sweep.output import failed_criteria
from catenary.cases.studies.sweep.together import Marching
from catenary.cases.studies.sweep.variants import Variant, text_of
from catenary.postproc.evaluate.wording import counted
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.study_table import Column, Content, Row, StudyTable, remark_lines

if TYPE_CHECKING:
    from catenary.cases.studies.waves.theory import WaveTheory

TABLE, RECORD, PICTURE = "separation.csv", "separation.json", "separation.png"
DISTANCE, PLACES = "separation_m", ("leading", "trailing")
_UPLIFT = "max_uplift_mm"
_OF_BOTH = (
    ("std_{}_N", "std {} [N]", ".1f", "std_N"),
    ("min_{}_N", "min {} [N]", ".1f", "min_N"),
    ("loss_{}_percent", "loss {} [%]", ".2f", "loss_percent"),
)
_MOST_ROWS, _MOST_REMARKS = 40, 4  # on a terminal; files have all
_LEAST_FOR_PERIOD = 12  # distances from which a period can be read
# Curves without a period, of which so many may be explained as well.
_RANDOM, _AS_WELL = 99, 4
_MOST_ALIKE = 0.995  # correlation of neighbours, near which a curve has hardly any variance


@dataclass(frozen=True)
class SeparationStudy:
    """Result of a study of distances.

    Attributes
    ----------
    case, kind, speed : names of case and pantograph, train speed [km/h]
    rows : of one pantograph alone, whose distance is None, then of each distance, ascending, with
        the columns of ``table``; figures are None where a distance could not be run
    """

    case: str
    kind: str
    speed: float
    rows: Sequence[Row]

    @property
    def pairs(self) -> Sequence[Row]:
        """The rows of two pantographs."""
        return self.rows[1:]

    @property
    def done(self) -> list[Row]:
        """The distances that could be run."""
        return [row for row in self.pairs if row["outcome"] == "done"]

    @property
    def by_deviation(self) -> list[Row]:
        """Distances with statistics, by the larger deviation of the two, the best first."""
        names = [f"std_{place}_N" for place in PLACES]
        known = [row for row in self.done if all(row[name] is not None for name in names)]
        return sorted(known, key=lambda row: max(row[name] for name in names))

    def table(self) -> StudyTable:
        """A row for each distance, and one of a single pantograph."""
        both = [
            Column(name.format(place), head.format(place), form)
            for name, head, form, _ in _OF_BOTH
            for place in PLACES
        ]
        columns = [Column(DISTANCE, "distance [m]", "g"), Column("outcome"), *both]
        columns += [Column(_UPLIFT, "uplift [mm]", ".1f"), Column("failed", "failed")]
        return StudyTable([*columns, Column("remarks")], self.rows)


def find_separations(marching: Marching, distances: Distances) -> SeparationStudy:
    """March one pantograph alone and two at each distance. Collective.

    Parameters
    ----------
    marching : of the case; all pantographs are of the kind of its first
    distances : between the two pantographs

    Raises
    ------
    InputError
        If the range is invalid, or if nothing can be run.
    Interrupted
        If a signal came.
    """
    scene, values = marching.scene, (None, *distances.values())
    ended = marching.of([variant_of(scene, value) for value in values])
    rows = [_row(*both) for both in zip(values, ended, strict=True)]
    kind = scene.train.pantographs[0].name
    return SeparationStudy(scene.case.name, kind, scene.train.speed_km_h, rows)


def variant_of(scene: Scene, separation: float | None) -> Variant:
    """The scene with two pantographs ``separation`` [m] apart, or with one alone if that is
    None."""
    kind = scene.train.pantographs[0].name
    if separation is None:
        return Variant("alone", (f"train.pantographs={text_of([{'name': kind}])}",))
    train = text_of([{"name": kind}, {"name": kind, "behind_m": separation}])
    ahead = [f"train.start_m={scene.train.start_m + separation:.10g}"]
    if scene.train.end_m is not None:  # of the leading one, too
        ahead.append(f"train.end_m={scene.train.end_m + separation:.10g}")
    return Variant(f"{separation:.8g}m", (*ahead, f"train.pantographs={train}"))


def _row(separation: float | None, one: Ended) -> Row:
    row: dict[str, Any] = {DISTANCE: separation, "outcome": one.outcome}
    found = statistics_of(one.summary)
    for number, place in enumerate(PLACES):
        for name, _, _, key in _OF_BOTH:
            row[name.format(place)] = found[number][key] if number < len(found) else None
    return row | {
        _UPLIFT: found[0][_UPLIFT],
        "failed": failed_criteria(one.summary),
        "remarks": one.remarks,
    }


class Period(NamedTuple):
    """Periods that explain good and bad distances, all [m]; NaN where there is no answer, or one
    that is no better than chance.

    Attributes
    ----------
    fitted : period of a decaying wave fitted to the deviation of the trailing one
    explains : share of its variance about a trend that the fit explains [-]
    ringing : (2,) v / f at the ends of the lowest pass band
    travel : L (c + v) / c
    tried : shortest and longest period that the distances can show
    """

    fitted: float
    explains: float
    ringing: np.ndarray
    travel: float
    tried: tuple[float, float] = (np.nan, np.nan)


def period_in(study: SeparationStudy, scene: Scene) -> Period:
    """Period of a study, and the periods that theory gives for the line of its scene. Not
    collective."""
    from catenary.cases.run.scene_mesh import mesh_of
    from catenary.cases.studies.waves.theory import wave_theory
    from catenary.solver.statics.elasticity import middle_span
    from catenary.solver.statics.line_at_rest import line_at_rest

    problem = problem_of(scene)
    first, last = middle_span(problem.line)
    try:
        theory = wave_theory(problem, line_at_rest(problem, mesh_of(scene)))
    except InputError:  # a line that cannot hang, of which no distance was run
        return Period(np.nan, np.nan, np.full(2, np.nan), np.nan)
    known = [row for row in study.done if row["std_trailing_N"] is not None]
    d, sigma = (np.array([row[name] for row in known]) for name in (DISTANCE, "std_trailing_N"))
    return period_of(d, sigma, theory, last - first)


def period_of(d: np.ndarray, sigma: np.ndarray, theory: WaveTheory, span: float) -> Period:
    """Period of the deviations over the distance, and the periods that theory offers.

    Parameters
    ----------
    d : (n,) distances, ascending [m]
    sigma : (n,) deviations of the trailing pantograph [N]
    theory : of the line
    span : its length [m]
    """
    bands = theory.bands()
    ringing = theory.speed / bands[0, ::-1] if bands.size else np.full(2, np.nan)
    travel = span * (theory.wave_speed + theory.speed) / theory.wave_speed
    if d.size < _LEAST_FOR_PERIOD:
        return Period(np.nan, np.nan, ringing, travel)
    # Shorter ones than two distances cannot be seen, longer ones not be told from a trend.
    shortest, longest = 2.0 * float(np.median(np.diff(d))), 0.5 * float(np.ptp(d))
    reaches = np.ptp(d) * np.array([0.25, 0.5, 1.0, 2.0, 10.0])
    trends = [_orthonormal(np.ones_like(d), d, np.exp(-d / reach)) for reach in reaches]
    # A fit so free explains much of any smooth curve: it has to explain more of what is off the
    # trend than of most curves that are as smooth.
    off = min((_without(trend, sigma) for trend in trends), key=np.linalg.norm)
    curves = np.column_stack([sigma, _as_smooth(off)])
    most, fitted = np.zeros(_RANDOM + 1), np.nan
    for reach, trend in zip(reaches, trends, strict=True):
        rest = _without(trend, curves)
        # Of a curve that is all trend nothing is explained.
        size = np.maximum((rest**2).sum(axis=0), 1e-12 * (curves**2).sum(axis=0))
        for period in np.linspace(shortest, longest, 400).tolist():
            wave = np.exp(-d / reach) * np.exp(2j * np.pi * d / period)
            basis = _orthonormal(*_without(trend, np.column_stack([wave.real, wave.imag])).T)
            found = ((basis.T @ rest) ** 2).sum(axis=0) / size
            if found[0] > most[0]:
                fitted = period
            most = np.maximum(most, found)
    tried = shortest, longest
    if np.count_nonzero(most[1:] >= most[0]) > _AS_WELL:
        return Period(np.nan, np.nan, ringing, travel, tried)
    return Period(fitted, float(most[0]), ringing, travel, tried)


def _orthonormal(*columns: np.ndarray) -> np.ndarray:
    """Orthonormal columns that span given ones (n,), fewer if these depend on each other."""
    directions, sizes, _ = np.linalg.svd(np.column_stack(columns), full_matrices=False)
    return np.asarray(directions[:, sizes > 1e-9 * sizes[0]])


def _without(basis: np.ndarray, curves: np.ndarray) -> np.ndarray:
    """Curves (n, ...) without their parts along the orthonormal columns of a basis."""
    return np.asarray(curves - basis @ (basis.T @ curves))


def _as_smooth(curve: np.ndarray) -> np.ndarray:
    """Random curves (n, _RANDOM) whose neighbours are as alike as those of a curve (n,).

    Autoregressive noise of the first order (M. Mann, J. Lees, Climatic Change 33, 1996, 409); the
    correlation of neighbours is corrected for its bias (M. Kendall, Biometrika 41, 1954, 403).
    """
    from scipy.signal import lfilter

    n, squares = curve.size, float(curve @ curve)
    alike = float(curve[1:] @ curve[:-1]) / squares if squares else 0.0
    alike = min(max(alike + (1.0 + 4.0 * alike) / n, 0.0), _MOST_ALIKE)
    noise = np.random.default_rng(1).normal(size=(n, _RANDOM))
    noise[0] /= np.sqrt(1.0 - alike**2)  # as far from the mean as all that follow
    return np.asarray(lfilter([1.0], [1.0, -alike], noise, axis=0))


def as_text(study: SeparationStudy, period: Period) -> str:
    """Best and worst distance in sentences, the table where it is short, criteria that fail, and
    the ``period`` of the deviation."""
    lines = [f"{study.case}: two pantographs {study.kind} at {study.speed:g} km/h."]
    ranked = study.by_deviation
    if not ranked:
        lines.append(f"At no distance there are statistics of both: {study.pairs[0]['outcome']}")
        return "\n".join(lines)
    alone = study.rows[0]
    if alone["outcome"] == "done":
        words = _in_words(alone["std_leading_N"])
        lines.append(f"One alone: deviation {words}{_uplift(alone)}.")
    for word, row in (("Least", ranked[0]), ("Largest", ranked[-1])):
        both = " and ".join(f"{place} {_in_words(row[f'std_{place}_N'])}" for place in PLACES)
        where = f"at {row[DISTANCE]:g} m"
        lines.append(f"{word} deviation of the worse pantograph {where}: {both}{_uplift(row)}.")
    names = dict.fromkeys(name for row in study.done for name in row["failed"])
    lines += [f"FAILED      {name}: at {_stretches(study.done, name)} m" for name in names]
    if not names:
        lines.append("All criteria that are judged hold at all distances.")
    lines.append(_explained(period))
    refused = [row for row in study.pairs if row["outcome"] != "done"]
    if refused:
        lines.append(
            f"{len(refused)} of {len(study.pairs)} distances could not be run, the first is "
            f"{refused[0][DISTANCE]:g} m: {refused[0]['outcome']}"
        )
    lines.append("")
    if len(study.pairs) <= _MOST_ROWS:
        lines += [study.table().text(), ""]
    remarks = remark_lines((f"{row[DISTANCE]:g} m", row["remarks"]) for row in study.pairs)
    lines += remarks[:_MOST_REMARKS]
    if len(remarks) > _MOST_REMARKS:
        more = counted(len(remarks) - _MOST_REMARKS, "remark")
        lines.append(f"{more} more; {RECORD} has all of them.")
    return "\n".join(lines)


def _in_words(deviation: float | None) -> str:
    return "not known" if deviation is None else f"{deviation:.1f} N"


def _uplift(row: Row) -> str:
    return "" if row[_UPLIFT] is None else f", uplift {row[_UPLIFT]:.1f} mm"


def _explained(period: Period) -> str:
    """Sentence on the period of the deviation, and on the periods that theory offers."""
    (low, high), (shortest, longest) = period.ringing, period.tried
    if np.isfinite(period.fitted):
        found = (
            f"A period of {period.fitted:.0f} m explains {100 * period.explains:.0f} % of the "
            "variance of the trailing one's deviation about its trend"
        )
    elif np.isfinite(period.tried).all():
        found = (
            f"No period from {shortest:.0f} to {longest:.0f} m, which these distances can show, "
            "explains more of the trailing one's deviation than chance"
        )
    else:
        found = f"No period is found in fewer than {_LEAST_FOR_PERIOD} distances"
    rings = f"spans ring once in {low:.0f} to {high:.0f} m, " if np.isfinite(low) else ""
    return f"{found}; {rings}waves from the leading one repeat every {period.travel:.0f} m."


def _stretches(rows: Sequence[Row], name: str) -> str:
    """Distances at which a criterion fails, neighbouring ones joined: ``31-40, 75``."""
    neighbours = groupby(rows, key=lambda row: name in row["failed"])
    runs = [[row[DISTANCE] for row in own] for fails, own in neighbours if fails]
    return ", ".join(f"{run[0]:g}-{run[-1]:g}" if len(run) > 1 else f"{run[0]:g}" for run in runs)


def files_of(study: SeparationStudy, period: Period) -> dict[str, Content]:
    """Table, record and picture of a study and its ``period``. Not collective."""
    table, ranked = study.table(), study.by_deviation
    record = {
        "case": study.case,
        "pantograph": study.kind,
        "speed_km_h": study.speed,
        "best_separation_m": ranked[0][DISTANCE] if ranked else None,
        "worst_separation_m": ranked[-1][DISTANCE] if ranked else None,
        "fitted_period_m": period.fitted,
        "fit_explains": period.explains,
        "ringing_m": period.ringing,
        "travel_m": period.travel,
        "rows": table.records(),
    }
    drawn = partial(draw, study, period)
    return {TABLE: table, RECORD: record, PICTURE: drawn}


@figures.own_style()
def draw(study: SeparationStudy, period: Period) -> Figure | None:
    """Deviation, least force and uplift over the distance, and those of one pantograph alone as a
    line.

    At whole periods of the ringing, of which ``period`` has the range, the ground is shaded. None
    if fewer than two distances could be run.
    """
    done = study.done
    if len(done) < 2:
        return None
    figure, panels = figures.stacked(7.5, 3, shared=False)
    x = np.array([row[DISTANCE] for row in done])
    shown = (
        ("standard deviation [N]", [f"std_{place}_N" for place in PLACES]),
        ("minimum force [N]", [f"min_{place}_N" for place in PLACES]),
        ("largest uplift at arms [mm]", [_UPLIFT]),
    )
    for axes, (label, names) in zip(panels, shown, strict=True):
        curves = enumerate(PLACES) if len(names) > 1 else [(2, "both")]
        for (number, of), name, line in zip(curves, names, figures.LINES, strict=False):
            y = np.array([row[name] for row in done], dtype=float)
            figures.curve(axes, x, y, number, of, f".{line}")
        if (alone := study.rows[0][names[0]]) is not None:
            axes.axhline(alone, color=figures.GREY, linestyle=":", label="one alone")
        if np.isfinite(period.ringing).all():
            for n in range(1, int(x[-1] / period.ringing[0]) + 1):
                low, high = np.clip(n * period.ringing, x[0], x[-1])
                axes.axvspan(low, high, color=figures.SHADE, zorder=0)
        figures.tidy(axes, "distance [m]; shaded: whole periods of the ringing", label, legend=True)
    return figure
