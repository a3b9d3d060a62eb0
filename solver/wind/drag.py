"""Drag of wires in the wind: gusts and aerodynamic damping; `mean_wind` has the mean load.

A wire of diameter d is met by the wind across it, q = (W_y - v', W_z - w') less its own velocity,
with the force 1/2 rho d C_d |q| q per length (J. Dyrbye, S. O. Hansen, Wind Loads on Structures).
With the mean W along y, gusts (g_y, g_z) and small velocities that is

    lateral:   1/2 rho d C_d W |W|  +  rho |W| d C_d (g_y - v')
    vertical:                       1/2 rho |W| d C_d (g_z - w')

and without linearisation about the mean the gusts' part is 1/2 rho d C_d (|q| q - |W| W).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import sparse

from catenary.solver.model import beam
from catenary.solver.model.alike import alike
from catenary.solver.model.loads import FieldLoad
from catenary.solver.model.model import Block, Model, wire_elements
from catenary.solver.problem.wind import Wind
from catenary.solver.wind.gust_field import GustField
from catenary.solver.wind.spectra import UPWARD
from catenary.solver.wind.wind_at import (
    across_at,
    directions,
    drag_width,
    gust_exposure,
    gust_points,
    horizontal_gusts,
)


def along(
    model: Model, wire: str, unknowns: tuple[str, str], points: np.ndarray | None = None
) -> tuple[np.ndarray, sparse.csr_matrix]:
    """Unknowns (n,) of a wire in a plane, and work-equivalent forces (n, n_points) of unit loads.

    Column j holds the forces [N], [N m] by a load per length of 1 N/m at point j. The load is
    linear between points and constant beyond them; it is evaluated at nodes, and linear along each
    element.

    Parameters
    ----------
    model : Model
        Discrete line.
    wire : str
        Name of the wire.
    unknowns : tuple of str
        Names of deflection and slope in the plane.
    points : ndarray, shape (n_points,), optional
        Ascending places [m]; the wire's nodes if not given.
    """
    dofs, length = wire_elements(model, wire, unknowns)
    nodes = model.mesh.wires[wire]
    number = np.empty(model.mesh.n_nodes, dtype=np.int64)
    number[nodes] = np.arange(nodes.size)
    rows, row_of = np.unique(dofs, return_inverse=True)
    forces = beam.linear_load(length)
    at = np.broadcast_to(row_of.reshape(dofs.shape)[:, :, None], forces.shape)
    column = np.broadcast_to(number[model.mesh.elements(wire)][:, None, :], forces.shape)
    weights = sparse.coo_matrix(
        (forces.ravel(), (at.ravel(), column.ravel())), shape=(rows.size, nodes.size)
    ).tocsr()
    if points is not None:
        weights = weights @ _interpolation(model.mesh.x(nodes), points)
    return rows, weights


def _interpolation(x: np.ndarray, points: np.ndarray) -> sparse.csr_matrix:
    """Matrix (n, m) of linear interpolation from ``points`` (m,) to ``x`` (n,) [m]."""
    m = points.size
    if m == 1:
        return sparse.csr_matrix(np.ones((x.size, 1)))
    low = np.clip(np.searchsorted(points, x, side="right") - 1, 0, m - 2)
    share = np.clip((x - points[low]) / (points[low + 1] - points[low]), 0.0, 1.0)
    i = np.arange(x.size)
    return sparse.coo_matrix(
        (np.concatenate([1.0 - share, share]), (np.tile(i, 2), np.concatenate([low, low + 1]))),
        shape=(x.size, m),
    ).tocsr()


VERTICAL, LATERAL = ("w", "theta_y"), ("v", "theta_z")


def planes_of(model: Model, wire: str) -> tuple[tuple[str, str], ...]:
    """Planes in which a wire moves, as pairs of unknowns."""
    nodes = model.mesh.wires[wire]
    lateral = bool(model.numbering.has(nodes, LATERAL[0]).all())
    return (VERTICAL, LATERAL) if lateral else (VERTICAL,)


def damping_blocks(model: Model, wind: Wind) -> list[Block]:
    """Aerodynamic damping of all wires about the mean wind, in all planes. Not collective."""
    tunnels, found = model.problem.tunnels, []
    for wire in model.problem.line.wires:
        for plane in planes_of(model, wire.name):
            dofs, length = wire_elements(model, wire.name, plane)
            middle = model.mesh.x(model.mesh.elements(wire.name)).mean(axis=1)
            speed = np.abs(across_at(wind, tunnels, middle))
            share = 1.0 if plane is LATERAL else 0.5
            rate = share * wind.density * drag_width(wire) * speed
            first, kind = alike(np.column_stack([length, rate]))
            matrices = beam.mass(length[first], rate[first])
            found.append(Block(wire.name, dofs, kind, None, None, matrices))
    return found


def gust_loads(model: Model, wind: Wind) -> list[FieldLoad]:
    """Loads of the gusts on all wires, one for each plane. Not collective."""
    gusts = wind.gusts
    assert gusts is not None
    x = model.mesh.points[:, 0]
    points = gust_points(gusts.spacing, float(x.min()), float(x.max()))
    pressures = {
        VERTICAL: upward_pressure(model, wind, points),
        LATERAL: _lateral(model, wind, points),
    }
    found = []
    for plane, (interval, fill) in pressures.items():
        parts = [
            (*along(model, wire.name, plane, points), drag_width(wire))
            for wire in model.problem.line.wires
            if plane in planes_of(model, wire.name)
        ]
        if parts:
            unknowns = np.concatenate([unknowns for unknowns, _, _ in parts])
            weights = sparse.vstack([width * weights for _, weights, width in parts]).tocsr()
            found.append(FieldLoad(unknowns, weights, interval, fill))
    return found


_Fill = tuple[float, Callable[[int, slice, np.ndarray], None]]


def upward_pressure(model: Model, wind: Wind, points: np.ndarray) -> _Fill:
    """Upward force of gusts over diameter times drag coefficient [N/m2]. Not collective.

    Parameters
    ----------
    model : Model
        Discrete line.
    wind : Wind
        Wind with gusts.
    points : ndarray, shape (n,)
        Places along the track, even and ascending [m].

    Returns
    -------
    interval : float
        Time between slices, between which the force is linear [s].
    fill : callable
        ``fill(first, part, slices)`` fills ``slices`` (m, k) at the k points of ``part`` and at the
        times (first + i) ``interval``.
    """
    mean = across_at(wind, model.problem.tunnels, points)
    exposed = gust_exposure(wind, points, model.problem.tunnels)
    upward = GustField(wind, UPWARD, points, _apart(points))
    across = _Across(wind, points, exposed) if wind.quadratic else None

    def fill(first: int, part: slice, slices: np.ndarray) -> None:
        upward.fill(first, part, slices)
        slices *= exposed[part]
        if across is None:
            slices *= 0.5 * wind.density * np.abs(mean[part])
        else:
            lateral = mean[part] + across.at(first, part, slices.shape[0])
            slices *= 0.5 * wind.density * np.hypot(lateral, slices)

    return upward.interval, fill


def _lateral(model: Model, wind: Wind, points: np.ndarray) -> _Fill:
    """Force of gusts to the left over diameter times drag coefficient [N/m2]."""
    mean = across_at(wind, model.problem.tunnels, points)
    exposed = gust_exposure(wind, points, model.problem.tunnels)
    across = _Across(wind, points, exposed)
    upward = GustField(wind, UPWARD, points, _apart(points)) if wind.quadratic else None

    def fill(first: int, part: slice, slices: np.ndarray) -> None:
        own = across.at(first, part, slices.shape[0])
        if upward is None:
            slices[:] = wind.density * np.abs(mean[part]) * own
            return
        upward.fill(first, part, slices)
        lateral = mean[part] + own
        size = np.hypot(lateral, exposed[part] * slices)
        slices[:] = 0.5 * wind.density * (size * lateral - np.abs(mean[part]) * mean[part])

    return across.interval, fill


def _apart(points: np.ndarray) -> float:
    """Distance of points, which are even [m]."""
    return float(points[1] - points[0])


class _Across:
    """Gusts to the left of the track [m/s], as far as the wind's direction has such."""

    def __init__(self, wind: Wind, points: np.ndarray, exposed: np.ndarray) -> None:
        parts = zip(
            reversed(directions(wind)), horizontal_gusts(wind, points, _apart(points)), strict=True
        )
        self._parts = [(share, field) for share, field in parts if share]
        self._exposed, self.interval = exposed, self._parts[0][1].interval

    def at(self, first: int, part: slice, n_slices: int) -> np.ndarray:
        """At the points of ``part`` and slices from ``first`` on, (n_slices, k)."""
        total = np.zeros((n_slices, part.stop - part.start))
        one = np.empty_like(total)
        for share, field in self._parts:
            field.fill(first, part, one)
            total += share * one
        return np.asarray(total * self._exposed[part])
