"""Bending moments of snapshots where a wire is worn, against the curvature that its nodes have."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
from measuring import check

import catenary

FROM, TO, LOST, EI = 170.0, 215.0, 0.3, 195.0


def left_of_a_disc(lost: float) -> float:
    """Share left of the second moment of a disc from which a segment is cut, summed by strips."""
    y = (np.arange(1_000_000) + 0.5) / 500_000 - 1.0
    width = 2.0 * np.sqrt(1.0 - y**2)
    kept = np.cumsum(width) > lost * width.sum()
    y, width = y[kept], width[kept]
    axis = (width * y).sum() / width.sum()
    return float((width * (y - axis) ** 2).sum() / 500_000 / (np.pi / 4))


def test_a_snapshot_bends_a_worn_wire_with_what_is_left_of_it(tmp_path: Path) -> None:
    """Between droppers a wire is a parabola, of which second differences are exact; within half a
    metre of droppers and arms it bends more."""
    scene = catenary.load("ac_simple", short=True).replace(
        line={"n_spans": 8},
        mesh={"elements_per_gap": 16},
        train={"start_m": 110.0, "end_m": 210.0},
        evaluation={"from_m": 190.0, "to_m": 200.0},
        output={"fields": ["bending_moment"], "field_every_s": 1.0},
        defects=[{"type": "worn_wire", "from_m": FROM, "to_m": TO, "lost_share": LOST}],
    )
    catenary.run(scene, tmp_path / "run", report=False).close()
    with h5py.File(tmp_path / "run" / "fields.h5", locking=False) as file:
        wire = file["contact_wire"]
        x, z = wire["points"][:, 0], wire["points"][:, 2]
        found = wire["bending_moment"][: x.size]
        hung = file["droppers/points"][:, 0], file["steady_arms/points"][:, 0]
    h = np.diff(x)
    bent = 2.0 * np.diff(np.diff(z) / h) / (h[1:] + h[:-1])
    x, found = x[1:-1], found[1:-1]
    away = np.abs(x[:, None] - np.concatenate(hung)).min(axis=1) > 1.5
    inside, outside = (x > FROM + 1) & (x < TO - 1), (x < FROM - 1) | (x > TO + 1)
    for where, stiffness in ((inside, EI * left_of_a_disc(LOST)), (outside, EI)):
        assert np.count_nonzero(where & away) > 20
        ratio = np.median(found[where & away] / bent[where & away])
        # At 1.5 m, 16 lengths of bending, a dropper's layer is gone; cubic elements of 0.36 m let
        # it die by half an element each, which leaves a hundredth.
        check("EI [N m2]", ratio, stiffness, within=0.01 * stiffness)
