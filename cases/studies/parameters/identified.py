"""An identification as tables, as text, as pictures and as files.

Pictures show the passage beside its marches, and the parameters with the widths of their
distributions.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from catenary.cases.studies.parameters.identification import Identification
from catenary.cases.studies.parameters.measurement import UNITS
from catenary.cases.studies.parameters.posterior import RARE, Judged, is_doubtful
from catenary.postproc.evaluate.wording import without_sign_of_zero
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.study_table import Column, Content, StudyTable, file_table

# More samples than these are drawn small.
_MANY_SAMPLES = 400
# Entries of the panel of parameters that leave letters legible.
_MOST_PARAMETERS = 60
PARAMETERS, CORRELATION = "parameters.csv", "correlation.csv"
DIRECTIONS, RESIDUALS, SUMMARY = "directions.csv", "residuals.csv", "identification.json"
PASSAGE, PRIORS = "passage.png", "parameters.png"
# What the text names: so many directions, correlated pairs, and parts of a direction; of a
# correlation this much at least, of a direction parts above this share of its largest.
_MOST_DIRECTIONS, _MOST_PAIRS, _MOST_PARTS = 5, 5, 4
_CORRELATED, _LEAST_PART = 0.5, 0.2


def parameters_table(found: Identification) -> StudyTable:
    """A row for each unknown: prior, found value, posterior deviation, part of the prior left."""
    columns = [
        Column("parameter", "parameter"),
        Column("unit", "unit"),
        Column("prior", "prior", ".6g"),
        Column("prior_deviation", "+-", ".6g"),
        Column("shown", "found", ">", in_files=False),
        Column("found"),
        Column("shown_deviation", "+-", ">", in_files=False),
        Column("deviation"),
        Column("of_prior", "of prior", ".0%"),
    ]
    rows = [
        {
            "parameter": one.name,
            "unit": one.unit,
            "prior": one.mean,
            "prior_deviation": one.deviation,
            "shown": _rounded(float(value), float(width)),
            "found": float(value),
            "shown_deviation": _rounded(float(width), float(width)),
            "deviation": float(width),
            "of_prior": float(width / one.deviation),
        }
        for one, value, width in zip(found.unknowns, found.values, found.widths, strict=True)
    ]
    return StudyTable(columns, rows)


def _rounded(value: float, width: float) -> str:
    """A value with the digits that two of its deviation let it have."""
    digits = max(0, 1 - int(np.floor(np.log10(width))))
    return without_sign_of_zero(f"{value:.{digits}f}" if digits < 7 else f"{value:.3g}")


def correlation_table(found: Identification) -> StudyTable:
    """The posterior correlations, a row and a column for each unknown."""
    names = [one.name for one in found.unknowns]
    rows = zip(names, found.posterior.correlation.tolist(), strict=True)
    return file_table(["parameter", *names], ([name, *row] for name, row in rows))


def directions_table(found: Identification) -> StudyTable:
    """Directions of the parameters, in deviations of their priors, the best known first."""
    heads = ["direction", "information", *(one.name for one in found.unknowns)]
    own = found.posterior.information.tolist(), found.posterior.directions.T.tolist()
    pairs = enumerate(zip(*own, strict=True), start=1)
    rows = ([n, information, *direction] for n, (information, direction) in pairs)
    return file_table(heads, rows)


def residuals_table(found: Identification) -> StudyTable:
    """Places, and of each signal what was measured and what the found parameters give, with the
    bias that was found."""
    heads, values = ["place_m"], [found.place]
    for signal, modelled, bias in zip(found.signals, found.modelled, found.biases, strict=True):
        name = f"{signal.name.replace(' ', '_')}_{UNITS[signal.name]}"
        heads += [f"measured_{name}", f"modelled_{name}"]
        values += [signal.values, modelled + bias]
    return file_table(heads, np.column_stack(values).tolist())


def as_text(found: Identification) -> str:
    """Text for the terminal: parameters, their information in the data, and fit of the model."""
    posterior, m = found.posterior, len(found.unknowns)
    lines = [parameters_table(found).text(), ""]
    lines.append(
        f"Data say more than the prior of {posterior.n_known} of {m} directions, and determine "
        f"{posterior.n_found:.1f} parameters; condition {posterior.condition:.2g}."
    )
    lines += _unknown_directions(found)
    lines += _correlated(found)
    lines += ["", *(_sentence(name, one) for name, one in found.judged.items())]
    lines.append(verdict(found))
    lines += _hints(found)
    sums = ", ".join(f"{one:.1f}" for one in found.sums)
    if len(found.sums) > 1:
        lines.append(
            f"Sums of squares of {len(found.sums)} searches, the first of which is shown: {sums}"
        )
    else:
        lines.append(
            f"One search was made, to a sum of squares of {sums}; it may not be the least."
        )
    if not found.has_converged:
        lines.append(f"The search has not converged after {found.n_marches} marches.")
    return "\n".join(lines)


def _hints(found: Identification) -> list[str]:
    """Sentences on signals that are not as the task states them."""
    return [one.hint for one in found.signals if one.hint]


def _unknown_directions(found: Identification) -> list[str]:
    posterior = found.posterior
    unknown = np.flatnonzero(posterior.information <= 1.0)[::-1]
    if not unknown.size:
        return []
    lines = ["Not known from these data, where the prior says more:"]
    for number in unknown[:_MOST_DIRECTIONS]:
        direction = posterior.directions[:, number]
        order = np.argsort(-np.abs(direction))[:_MOST_PARTS]
        parts = " ".join(
            f"{direction[place]:+.2f} {found.unknowns[place].name}"
            for place in order
            if abs(direction[place]) > _LEAST_PART * np.abs(direction).max()
        )
        lines.append(f"  {parts} (information {posterior.information[number]:.2g})")
    if unknown.size > _MOST_DIRECTIONS:
        lines.append(f"  and {unknown.size - _MOST_DIRECTIONS} more, see {DIRECTIONS}")
    return lines


def _correlated(found: Identification) -> list[str]:
    correlation = found.posterior.correlation
    rows, columns = np.triu_indices(len(found.unknowns), 1)
    values = correlation[rows, columns]
    order = [k for k in np.argsort(-np.abs(values)) if abs(values[k]) > _CORRELATED]
    lines = [
        f"  {values[k]:+.2f} {found.unknowns[rows[k]].name} and {found.unknowns[columns[k]].name}"
        for k in order[:_MOST_PAIRS]
    ]
    if len(order) > _MOST_PAIRS:
        lines.append(f"  and {len(order) - _MOST_PAIRS} more, see {CORRELATION}")
    return ["Correlated:", *lines] if lines else []


def _sentence(name: str, one: Judged) -> str:
    size = (
        f"chi-square {one.reduced:.3f} per degree of freedom ({one.n}, p = {one.probability:.2g})"
    )
    if not one.autocorrelation.size:
        return f"Residual of {name}: {size}"
    colour = f"{one.autocorrelation[0]:+.2f} (white with p = {one.whiteness_probability:.2g})"
    return f"Residual of {name}: {size}; autocorrelation {colour}"


def verdict(found: Identification) -> str:
    """Whether the residuals are those of noise as it was stated."""
    judged = found.judged
    if len(judged) == 2:  # one signal, which is all
        judged = {name: one for name, one in judged.items() if name != "all"}
    large = [name for name, one in judged.items() if one.is_too_large]
    small = [name for name, one in judged.items() if one.is_too_small]
    # A residual far below the noise has the colour of round-off, or of a noise that was overstated.
    coloured = [name for name, one in judged.items() if one.is_coloured and name not in small]
    wrong = []
    if large:
        wrong.append(f"{_residuals(large)} larger than noise and priors allow")
    if coloured:
        wrong.append(f"{_residuals(coloured)} not white")
    if wrong:
        return (
            f"The model does not fit: {'; '.join(wrong)} (each less probable than {RARE:g}). Found "
            "values and deviations are not to be trusted."
        )
    if small:
        return f"The noise that the task states is too large: {_residuals(small)} far below it."
    if is_doubtful(found.judged):
        return (
            "The model fits, with a doubt: a right one leaves such residuals in one passage of ten "
            "at most, and more searches (starts) may find better values."
        )
    return "The model fits: residuals are those of the stated noise."


def _residuals(names: Sequence[str]) -> str:
    """The residuals of some signals, and the verb of a sentence about them."""
    texts = ["all together" if name == "all" else name for name in names]
    return (
        f"the residual of {texts[0]} is"
        if len(texts) == 1
        else (f"the residuals of {', '.join(texts[:-1])} and {texts[-1]} are")
    )


def summary_of(found: Identification) -> dict[str, Any]:
    """Parameters, what is known of them, residuals and verdict."""
    return {
        "parameters": parameters_table(found).records(),
        "directions_known": found.posterior.n_known,
        "parameters_determined": found.posterior.n_found,
        "condition": found.posterior.condition if np.isfinite(found.posterior.condition) else None,
        "residuals": {
            name: {
                "n": one.n,
                "chi_square": one.chi_square,
                "chi_square_per_degree_of_freedom": one.reduced,
                "probability": one.probability,
                "autocorrelation": one.autocorrelation.tolist(),
                "whiteness_probability": one.whiteness_probability,
            }
            for name, one in found.judged.items()
        },
        "verdict": verdict(found),
        "hints": _hints(found),
        "converged": found.has_converged,
        "n_marches": found.n_marches,
        "n_jacobians": found.n_jacobians,
        "sums_of_squares": found.sums,
    }


@figures.own_style()
def draw_passage(found: Identification) -> Figure:
    """The samples of each signal over its marches, by the priors' means and as found; below them
    the residual beside the standard deviation of the stated noise."""
    n = len(found.signals)
    figure = figures.new_figure(4.2 * n)
    panels = figure.subplots(2 * n, 1, sharex=True, height_ratios=[2.2, 1.0] * n)
    size = 4.5 if found.place.size <= _MANY_SAMPLES else 2.0
    for number, (signal, bias) in enumerate(zip(found.signals, found.biases, strict=True)):
        above, below = panels[2 * number : 2 * number + 2]
        modelled, unit = found.modelled[number] + bias, UNITS[signal.name]
        figures.curve(above, found.place, signal.values, 2, "measured", ".", ms=size, zorder=3)
        place, by_priors = found.by_priors[number]
        figures.curve(above, place, by_priors, 1, "priors' means", "--", 1.0)
        place, marched = found.marched[number]
        figures.curve(above, place, marched + bias, 0, "found", width=1.0)
        figures.tidy(above, "", f"{signal.name} [{unit}]")
        figures.legend_above(above)
        factor, unit = (1e3, "mm") if unit == "m" else (1.0, unit)
        noise = factor * signal.deviation
        below.axhspan(-noise, noise, color=figures.SHADE, zorder=0)
        figures.curve(
            below, found.place, factor * (signal.values - modelled), 2, None, ".", ms=size
        )
        below.axhline(0.0, color=figures.GREY, linewidth=0.8, zorder=1)
        figures.tidy(below, "", f"residual [{unit}]\n(shaded: noise)")
    panels[-1].set_xlabel("position along the track [m]")
    return figure


@figures.own_style()
def draw_parameters(found: Identification) -> Figure:
    """Found values less the priors' means with their posterior deviations, in deviations of the
    priors, beside these. Of many parameters those that moved most."""
    deviations = np.array([one.deviation for one in found.unknowns])
    moved = (found.values - [one.mean for one in found.unknowns]) / deviations
    widths = found.posterior.widths
    shown = np.sort(np.argsort(-np.abs(moved), kind="stable")[:_MOST_PARAMETERS])
    figure = figures.new_figure(1.2 + 0.22 * len(shown))
    axes = figure.subplots()
    rows = np.arange(len(shown))
    axes.axvspan(-1.0, 1.0, color=figures.SHADE, zorder=0, label="prior")
    axes.errorbar(
        moved[shown], rows, xerr=widths[shown], fmt="o", ms=3.5, color=figures.colour(0),
        elinewidth=1.2, capsize=2.5, label="found",
    )  # fmt: skip
    figures.tidy(axes, "distance from the prior's mean [deviations of the prior]", "")
    axes.set_yticks(rows, [found.unknowns[k].name for k in shown], fontsize="small")
    axes.set_ylim(len(shown) - 0.5, -0.5)
    figures.legend_above(axes)
    return figure


def files_of(found: Identification) -> dict[str, Content]:
    """Content of all files by name."""
    return {
        PARAMETERS: parameters_table(found),
        CORRELATION: correlation_table(found),
        DIRECTIONS: directions_table(found),
        RESIDUALS: residuals_table(found),
        SUMMARY: summary_of(found),
        PASSAGE: partial(draw_passage, found),
        PRIORS: partial(draw_parameters, found),
    }
