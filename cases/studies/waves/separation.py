"""Influence of a leading pantograph on a trailing one over their separation.

Runs of two pantographs at many separations, and of one alone, through the machinery of sweeps; the
statistics of both over separation, and the two lengths that explain where they are bad:

- **ringing**: a span that the leading one has passed rings in the lowest pass band of the line.
  The trailing one comes after the time d / v and finds it at the phase 2 pi f d / v, so that good
  and bad separations repeat every v / f;
- **travel**: waves of the leading one run back along the contact wire with c. What meets the
  trailing one was sent d c / (c + v) ahead of it, so that the place in the span from which it came
  repeats every L (c + v) / c.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from catenary.base.errors import InputError
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.sweep.jobs import Ended, Job, RunOptions, make_jobs
from catenary.cases.studies.sweep.output import table_of, value_in_words
from catenary.cases.studies.sweep.run_jobs import run_jobs
from catenary.cases.studies.sweep.variants import Variant, VariedKey, product, slug
from catenary.cases.studies.waves.theory import WaveTheory
from catenary.postproc.files.disk import write_all
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.study_table import rows_csv

RUNS, TABLE, PICTURE, PERIODS = "runs", "separations.csv", "separations.png", "periods.csv"
SEPARATION, WITH = "separation_m", "with"
# Separations that a curve may have, and the least from which a period can be read.
MOST, _LEAST_FOR_PERIOD = 400, 12
# Panels: statistic of a run, its label.
_SHOWN = (
    ("std_N", "standard deviation [N]"),
    ("mean_N", "mean force [N]"),
    ("loss_percent", "loss of contact [%]"),
)


class Curve(NamedTuple):
    """Statistics over n separations, with the same assignments.

    Attributes
    ----------
    name : the values that tell it from the others, empty if there are none
    separation : (n,) ascending [m]
    alone : of one pantograph by statistic
    trailing, leading : (n,) by statistic
    """

    name: str
    separation: np.ndarray
    alone: dict[str, float]
    trailing: dict[str, np.ndarray]
    leading: dict[str, np.ndarray]


def parse_separations(text: str) -> list[float]:
    """Separations of ``from:to:count`` or ``a,b,...`` [m].

    Raises
    ------
    InputError
        If it has another form, or names a separation that is not positive, or one twice.
    """
    parts = text.split(":")
    try:
        if len(parts) == 3:
            start, end, count = float(parts[0]), float(parts[1]), int(parts[2])
            values = np.linspace(start, end, count).round(3).tolist() if 1 < count <= MOST else []
        else:
            values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if not values or len(values) > MOST:
        raise InputError(
            f"--separations {text} must be metres as from:to:count, with a count from 2 to "
            f"{MOST}, or as a,b,..., e.g. 31:400:28"
        )
    if not all(0.0 < value < np.inf for value in values) or len(set(values)) < len(values):
        raise InputError(f"--separations {text} must name positive lengths, each once")
    return sorted(values)


def jobs_of(
    case: str,
    scene: Scene,
    separations: Sequence[float],
    varied: Sequence[VariedKey],
    overrides: Sequence[str],
    shortened: bool,
) -> list[Job]:
    """Checked runs: one pantograph, then two at each separation, for all values of varied keys.

    The trailing one, or the one alone, starts at ``train.start_m``; both are of the kind of the
    scene's first one.

    Raises
    ------
    InputError
        If a scene is wrong, such as one whose line is too short for a separation.
    """
    kind, start = scene.train.pantographs[0].name, scene.train.start_m
    others = product(varied, {}) if varied else [Variant("", ())]
    variants = []
    for other in others:
        varied_values = ", ".join(value_in_words(*each) for each in other.varied.items())
        for d in (None, *separations):
            train = [f'train.pantographs=[{{name="{kind}"}}]']
            if d is not None:
                pair = f'[{{name="{kind}"}}, {{name="{kind}", behind_m={d:g}}}]'
                train = [f"train.start_m={start + d:g}", f"train.pantographs={pair}"]
            name = "alone" if d is None else f"{d:g}m"
            columns = {SEPARATION: "" if d is None else f"{d:g}", WITH: varied_values}
            quiet = ("output.field_every_s=0", "output.energy_every_s=0")
            variants.append(
                Variant(
                    slug(f"{other.name}__{name}" if other.name else name),
                    (*other.assignments, *quiet, *train), columns,
                )
            )  # fmt: skip
    made = make_jobs(case, variants, overrides, shortened)
    return [replace(job, keep_results=False) for job in made]


def run(jobs: Sequence[Job], folder: Path, comm: Any, options: RunOptions) -> list[Ended]:
    """Run what is not done yet below ``folder``. Collective."""
    return run_jobs(jobs, folder / RUNS, comm, options)


def curves_of(ended: Sequence[Ended]) -> list[Curve]:
    """The curves of all runs that are done."""
    curves = []
    table = [row for one in ended if one.done for row in _rows_of(one)]
    for name in dict.fromkeys(row[WITH] for row in table):
        own = [row for row in table if row[WITH] == name]
        alone = next((row for row in own if row[SEPARATION] is None), None)
        found = np.array(sorted({row[SEPARATION] for row in own if row[SEPARATION] is not None}))
        if not found.size:
            continue
        by_place = {(row[SEPARATION], row["place"]): row for row in own}
        both = [
            {
                key: np.array([_number(by_place[d, place][key]) for d in found.tolist()])
                for key, _ in _SHOWN
            }
            for place in (0, 1)
        ]
        single = {key: np.nan if alone is None else _number(alone[key]) for key, _ in _SHOWN}
        curves.append(Curve(name, found, single, both[1], both[0]))
    return curves


def _rows_of(one: Ended) -> list[dict[str, Any]]:
    """A row for each pantograph of a run, from the leading one on."""
    text = one.variant.varied[SEPARATION]
    separation = float(text) if text else None
    return [
        {
            SEPARATION: separation,
            WITH: one.variant.varied[WITH],
            "place": place,
            **{key: pantograph.get(key) for key, _ in _SHOWN},
        }
        for place, pantograph in enumerate(one.summary["pantographs"])
    ]


def _number(value: float | None) -> float:
    return np.nan if value is None else float(value)


class Period(NamedTuple):
    """What explains a curve, all [m]; ``fitted`` is NaN where there are too few separations.

    Attributes
    ----------
    fitted : period of a decaying wave fitted to the deviation of the trailing one
    explains : share of its variance that the fit explains [-]
    ringing : (2,) v / f at the ends of the lowest pass band; NaN without one
    travel : L (c + v) / c
    """

    fitted: float
    explains: float
    ringing: np.ndarray
    travel: float


def period_of(curve: Curve, theory: WaveTheory, span: float) -> Period:
    """What the deviation of the trailing one repeats itself with, and what theory offers."""
    d, sigma = curve.separation, curve.trailing["std_N"]
    bands = theory.bands()
    ringing = theory.speed / bands[0, ::-1] if bands.size else np.full(2, np.nan)
    travel = span * (theory.wave_speed + theory.speed) / theory.wave_speed
    good = np.isfinite(sigma)
    d, sigma = d[good], sigma[good]
    if d.size < _LEAST_FOR_PERIOD:
        return Period(np.nan, np.nan, ringing, travel)
    # Shorter ones than two separations cannot be seen, longer ones not be told from a trend.
    shortest, longest = 2.0 * float(np.median(np.diff(d))), 0.5 * float(np.ptp(d))
    best = (np.inf, np.nan)
    for period in np.linspace(shortest, longest, 400).tolist():
        for reach in np.ptp(d) * np.array([0.25, 0.5, 1.0, 2.0, 10.0]):
            fade, phase = np.exp(-d / reach), 2 * np.pi * d / period
            basis = np.column_stack(
                [np.ones_like(d), fade, fade * np.cos(phase), fade * np.sin(phase)]
            )
            weights, *_ = np.linalg.lstsq(basis, sigma, rcond=None)
            left = float(((sigma - basis @ weights) ** 2).sum())
            best = min(best, (left, period))
    whole = float(((sigma - sigma.mean()) ** 2).sum())
    return Period(best[1], 1.0 - best[0] / max(whole, 1e-300), ringing, travel)


def write(folder: Path, ended: Sequence[Ended], theory: WaveTheory, span: float) -> list[Path]:
    """Write table, periods and picture; returns the files. Not collective."""
    curves = curves_of(ended)
    content: dict[str, bytes | str] = {TABLE: table_of(ended).csv()}
    if curves:
        found = [period_of(curve, theory, span) for curve in curves]
        content[PERIODS] = rows_csv(
            [
                {
                    "with": curve.name, "fitted_m": one.fitted, "explains": one.explains,
                    "ringing_from_m": float(one.ringing[0]), "ringing_to_m": float(one.ringing[1]),
                    "travel_m": one.travel,
                }
                for curve, one in zip(curves, found, strict=True)
            ]
        )  # fmt: skip
        content |= figures.painted(PICTURE, lambda: draw(curves, found[0]))
    return write_all(folder, content)


@figures.own_style()
def draw(curves: Sequence[Curve], period: Period) -> Figure:
    """Deviation, mean and loss of contact of the trailing pantograph over separation.

    The leading one is thin, one alone dashed; bands show where the trailing one comes whole periods
    of the ringing after the leading one.
    """
    figure = figures.new_figure(8.4)
    panels = figure.subplots(len(_SHOWN), 1, sharex=True, height_ratios=[2, 1, 1])
    for (key, label), axes in zip(_SHOWN, panels, strict=True):
        for number, curve in enumerate(curves):
            name, d = curve.name, curve.separation
            figures.curve(axes, d, curve.trailing[key], number, _joined("trailing", name), "o-")
            label = _joined("leading", name)
            figures.curve(axes, d, curve.leading[key], number, label, width=0.7)
            look = {"color": figures.colour(number), "linestyle": "--", "linewidth": 0.9}
            axes.axhline(curve.alone[key], **look)
        far = max(float(curve.separation[-1]) for curve in curves)
        if np.isfinite(period.ringing).all():
            for n in range(1, int(far / period.ringing[0]) + 1):
                low, high = n * period.ringing
                if low < far:
                    axes.axvspan(low, min(high, far), color=figures.SHADE, zorder=0)
        figures.tidy(axes, "", label)
    figures.legend_above(panels[0], 2)
    panels[-1].set_xlabel("separation [m]; shaded: whole periods of the ringing; dashed: one alone")
    return figure


def _joined(place: str, name: str) -> str:
    return f"{place}, {name}" if name else place


def as_text(curves: Sequence[Curve], theory: WaveTheory, span: float) -> str:
    """Worst and best separations, and the periods, for a terminal."""
    lines = []
    for curve in curves:
        sigma, one = curve.trailing["std_N"], period_of(curve, theory, span)
        if not np.isfinite(sigma).any():
            continue
        worst, best = int(np.nanargmax(sigma)), int(np.nanargmin(sigma))
        period = (
            f"period {one.fitted:.0f} m explains {100 * one.explains:.0f} % of the variance"
            if np.isfinite(one.fitted)
            else f"no period below {_LEAST_FOR_PERIOD} separations"
        )
        lines.append(
            f"{curve.name or 'trailing'}: deviation {curve.alone['std_N']:.1f} N alone, trailing "
            f"{sigma[worst]:.1f} N at {curve.separation[worst]:g} m, {sigma[best]:.1f} N at "
            f"{curve.separation[best]:g} m; {period}; ringing {one.ringing[0]:.0f} to "
            f"{one.ringing[1]:.0f} m, travel {one.travel:.0f} m"
        )
    return "\n".join(lines)
