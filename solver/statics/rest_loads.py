"""Loads of a line at rest: weights, cant, curve, mean wind, links with a force of their own."""

from __future__ import annotations

import numpy as np

from catenary.solver.model import beam, exact_beam
from catenary.solver.model.axial_elements import curve_rows
from catenary.solver.model.model import Model, wire_elements
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.wind.wind_at import mean_load

_LEVEL = ("v", "theta_z")


def dead_loads(model: Model) -> np.ndarray:
    """Loads that no shape changes, (n_dofs,) [N], [N m]: weights, their part sideways on a canted
    track, the mean wind, and forces of links that do not follow the shape at rest."""
    weight = model.weight
    load = weight.copy()
    for links in model.links:
        pulls = np.where(links.law["open"], 0.0, links.law["rest"])
        if not links.of_shape and pulls.any():
            unknowns, weights = links.direction
            np.add.at(load, unknowns, -pulls[:, None] * weights)
    if not model.simulated.lateral:
        return load
    line, wind = model.problem.line, model.simulated.wind
    if line.curve is not None:
        every = np.arange(model.mesh.n_nodes)
        share = line.curve.sideways_pull_at(model.mesh.x(every))
        for sideways, own in zip(_LEVEL, ("w", "theta_y"), strict=True):
            load[model.dofs(every, sideways)] -= share * weight[model.dofs(every, own)]
    if wind is None:
        return load
    for wire in line.wires:
        dofs, length = wire_elements(model, wire.name, _LEVEL)
        middle = model.mesh.x(model.mesh.elements(wire.name)).mean(axis=1)
        pull = mean_load(wind, model.problem.tunnels, wire, middle)
        np.add.at(load, dofs, pull[:, None] * beam.uniform_load(length))
        if line.curve is not None:
            pull *= line.curve.upright_part_at(middle)
            upright, _ = model.wire_elements(wire.name)
            np.add.at(load, upright, pull[:, None] * beam.uniform_load(length))
    return load


def curve_load(model: Model, form: Equilibrium | None) -> np.ndarray:
    """Pull of the tension of the installation towards the centre of a curve, (n_dofs,) [N], [N m],
    of lines with lateral motion. A course y across a track of curvature c has the curvature
    y'' + c in plan, of which a canted plane has a part across itself; where the track twists, a
    course that is straight relative to it is not straight in space, about the shape ``form``,
    None where none is known yet."""
    load = np.zeros(model.n_dofs)
    if model.problem.line.curve is None or not model.simulated.lateral:
        return load
    for wire in model.problem.line.wires:
        upright, length = model.wire_elements(wire.name)
        level, _ = wire_elements(model, wire.name, _LEVEL)
        middle = model.mesh.x(model.mesh.elements(wire.name)).mean(axis=1)
        pull = wire.tension_at(middle) * length
        for dofs, rows in zip((upright, level), curve_rows(model, wire.name, form), strict=True):
            np.add.at(load, dofs, -pull[:, None] * rows)
    return load


def exact_moments(model: Model) -> np.ndarray:
    """Moments that exact elements add to ``dead_loads`` and ``curve_load`` of a line in still air,
    (n_dofs,) [N m]: under a uniform load their ends carry smaller moments. Droppers have no part in
    it."""
    load, line = np.zeros(model.n_dofs), model.problem.line
    curve = line.curve if model.simulated.lateral else None
    for wire in line.wires:
        dofs, length = model.wire_elements(wire.name)
        middle = model.mesh.x(model.mesh.elements(wire.name)).mean(axis=1)
        tension = wire.tension_at(middle)
        lacks = exact_beam.moment_share(length, wire.bending_stiffness, tension) - 1.0
        moments = lacks[:, None] * beam.uniform_load(length) * np.array([0.0, 1.0, 0.0, 1.0])
        weight = model.simulated.gravity * wire.mass_per_length
        np.add.at(load, dofs, -weight * moments)
        if curve is not None:
            pull = curve.upright_curvature_at(middle) * tension
            np.add.at(load, dofs, pull[:, None] * moments)
            pull = curve.sideways_pull_at(middle) * weight + curve.curvature_at(middle) * tension
            sideways, _ = wire_elements(model, wire.name, _LEVEL)
            np.add.at(load, sideways, pull[:, None] * moments)
    return load
