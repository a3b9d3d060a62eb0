"""Tables for spreadsheets: the droppers as they are cut."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.postproc.evaluate.statistics import slack_times
from catenary.postproc.evaluate.wording import fixed
from catenary.postproc.files.csv_text import csv_text
from catenary.postproc.read.results import Results


class DropperRow(NamedTuple):
    """A dropper for the installer.

    Attributes
    ----------
    span, number : by which a scene names it, from 1, the latter along the track over all wires
    position, x : from the span's left support and along the track [m]
    length, force : [m], at rest [N]
    upper, lower : names of the wires that it hangs from and carries
    """

    span: int
    number: int
    position: float
    x: float
    length: float
    force: float
    upper: str
    lower: str


def joins_several(results: Results) -> bool:
    """Whether droppers hang from, or carry, several wires, which a table of them is to name."""
    wires = results.dropper_wires()
    return bool((wires != wires[:1]).any())


def dropper_table(results: Results) -> list[DropperRow]:
    """All droppers of the line in order of x. Not collective."""
    span = results.line("dropper_span")
    x = results.line("dropper_x")
    masts = results.line("support_x")
    length, force = results.static("dropper_length"), results.static("dropper_force")
    wires, names = results.dropper_wires(), list(results.roles)
    order = _order(results)
    first = np.searchsorted(span[order], span)  # of each dropper's span, along the track
    return [
        DropperRow(
            int(span[i]) + 1,
            along - int(first[i]) + 1,
            float(x[i] - masts[span[i]]),
            float(x[i]),
            float(length[i]),
            float(force[i]),
            names[wires[i, 0]],
            names[wires[i, 1]],
        )
        for along, i in enumerate(order)
    ]


def _order(results: Results) -> list[int]:
    """Numbers of the droppers in order of x."""
    return [int(i) for i in np.argsort(results.line("dropper_x"), kind="stable")]


def droppers_csv(results: Results) -> str:
    """The dropper table as CSV text, lengths to a tenth of a millimetre.

    Beside the force at rest stand the least and the largest one of every step, and for how long the
    dropper was slack; they are empty where they are not known.
    """
    heads = ["span", "dropper", "position in span [m]", "position [m]", "length [m]", "force [N]"]
    heads += ["least force [N]", "largest force [N]", "slack [s]"]
    least, largest = results.extremes("dropper_force")
    slack = slack_times(results)
    several = joins_several(results)
    if several:
        heads += ["hangs from", "carries"]
    rows = (
        (
            row.span,
            row.number,
            fixed(row.position, 4),
            fixed(row.x, 4),
            fixed(row.length, 4),
            fixed(row.force, 2),
            _known(least[i], 2),
            _known(largest[i], 2),
            _known(slack[i], 3),
            *((row.upper, row.lower) if several else ()),
        )
        for i, row in zip(_order(results), dropper_table(results), strict=True)
    )
    return csv_text(heads, rows)


def _known(value: float, digits: int) -> str:
    return fixed(value, digits) if np.isfinite(value) else ""
