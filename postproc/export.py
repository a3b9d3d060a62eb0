"""Tables for spreadsheets: the droppers as they are cut, the channels of the pantographs."""

from __future__ import annotations

import csv
import io
from typing import NamedTuple

import numpy as np

from catenary.postproc import channels
from catenary.postproc.results import Results


class DropperRow(NamedTuple):
    """A dropper for the installer: span and number from 1, position from the span's left support
    and along the track [m], length [m], force at rest [N]."""

    span: int
    number: int
    position: float
    x: float
    length: float
    force: float


def dropper_table(results: Results) -> list[DropperRow]:
    """All droppers of the line in order of x. Not collective."""
    span = results.line("dropper_span")
    x = results.line("dropper_x")
    masts = results.line("support_x")
    length, force = results.static("dropper_length"), results.static("dropper_force")
    rows = []
    for i in np.argsort(x, kind="stable"):
        number = int(np.count_nonzero((span == span[i]) & (x <= x[i])))
        rows.append(
            DropperRow(
                int(span[i]) + 1,
                number,
                float(x[i] - masts[span[i]]),
                float(x[i]),
                float(length[i]),
                float(force[i]),
            )
        )
    return rows


def droppers_csv(results: Results) -> str:
    """The dropper table as CSV text, lengths to a tenth of a millimetre."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(
        ["span", "dropper", "position in span [m]", "position [m]", "length [m]", "force [N]"]
    )
    for row in dropper_table(results):
        figures = (f"{row.position:.4f}", f"{row.x:.4f}", f"{row.length:.4f}", f"{row.force:.2f}")
        writer.writerow([row.span, row.number, *figures])
    return stream.getvalue()


def pantographs_csv(results: Results) -> str:
    """Time and the channels of all pantographs as CSV text, one line a step. Not collective."""
    heads, columns = [channels.TIME.label], [results.time]
    names = results.pantograph_names()
    for channel in channels.CHANNELS.values():
        if channel.per != channels.PANTOGRAPH:
            continue
        values = results.channel(channel.name)
        for p, name in enumerate(names):
            prefix = f"{name} " if len(names) > 1 else ""
            heads.append(prefix + channel.label)
            columns.append(values[:, p])
    violations = results.constraint_violations()
    if violations is not None:
        for p, name in enumerate(names):
            prefix = f"{name} " if len(names) > 1 else ""
            heads.append(prefix + channels.CONSTRAINT_VIOLATION.label)
            columns.append(violations[:, p])
    for name, forces in zip(names, results.strip_forces(), strict=False):
        prefix = f"{name} " if len(names) > 1 else ""
        for number in range(forces.shape[1] if forces.shape[1] > 1 else 0):
            heads.append(f"{prefix}strip {number + 1} {channels.STRIP_FORCE.label}")
            columns.append(forces[:, number])
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerow(heads)
    np.savetxt(stream, np.column_stack(columns), fmt="%.9g", delimiter=",")
    return stream.getvalue()
