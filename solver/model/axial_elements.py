"""Stretch of a tensioned wire along its course: a bar of the mean strain of each element.

To first order in the motion (u, w) about a shape z at rest the mean strain of an element of length
h is e = (u2 - u1) / h + (1 / h) integral of z' w' dx. One strain for an element keeps the bar from
locking: what bends within it does not stretch it. Its tension gains EA e.
"""

from __future__ import annotations

import numpy as np

from catenary.solver.model.elements import beam
from catenary.solver.model.model import Model, wire_elements

# Slopes at rest that differ by less are one, so that like spans have like matrices [-]. What that
# changes of a stiffness is a share of 1e-11 of EA.
_SLOPE = 1e-10


def unknowns_along(model: Model, wire: str) -> np.ndarray:
    """Unknowns of the elements of a wire: u of both ends, then height and slope of both, (n, 6)."""
    pairs = model.mesh.elements(wire)
    bending, _ = wire_elements(model, wire, ("w", "theta_y"))
    return np.concatenate([model.dofs(pairs, "u"), bending], axis=1)


def strain_rows(model: Model, wire: str) -> np.ndarray:
    """Mean strain of the elements of a wire by their unknowns, (n, 6) [1/m], [1/rad].

    Before the shape at rest is known the wire is straight.
    """
    pairs = model.mesh.elements(wire)
    length = np.diff(model.mesh.x(pairs), axis=1)[:, 0]
    rows = np.zeros((len(pairs), 6))
    rows[:, 0], rows[:, 1] = -1.0 / length, 1.0 / length
    if model.form is not None:
        shape = np.stack([model.form.height[pairs], model.form.slope[pairs]], axis=2)
        rows[:, 2:] = np.round(slope_rows(length, shape.reshape(-1, 4)) / _SLOPE) * _SLOPE
    return rows


def slope_rows(length: np.ndarray, shape: np.ndarray) -> np.ndarray:
    """(1 / h) integral of z' N' dx of elements, (n, 4), of their shapes z (n, 4)."""
    pull = beam.stiffness(length, 0.0, 1.0)
    return np.asarray(np.einsum("nij,nj->ni", pull, shape) / length[:, None])


def bar_mass(length: np.ndarray, mass_per_length: float) -> np.ndarray:
    """Consistent mass matrices of bars, shape (n, 2, 2) [kg]."""
    shape = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
    return np.asarray(mass_per_length * length[:, None, None] * shape)
