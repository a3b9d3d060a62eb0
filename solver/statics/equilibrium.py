"""Form finding: dropper forces and lengths for the wanted contact-wire profile, and elasticity.

The wires' static shape is linear in the loads, so the profile is prescribed at the droppers and
the forces that hold it there are the dropper tensions; the messenger wire then carries them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from catenary.meshgen.line import Line, Role
from catenary.meshgen.mesh import LineMesh
from catenary.solver.base.errors import InputError
from catenary.solver.effects.build_model import build
from catenary.solver.model import elements
from catenary.solver.model.model import Model
from catenary.solver.problem.problem import Problem

# Lengths are printed to the millimetre; the iteration contracts by the ratio of dropper weight
# to tension sag, about 1e-3, so that this costs one more pass and leaves no trace in the forces.
_LENGTH_TOLERANCE = 1e-10
_MAX_PASSES = 30


@dataclass(frozen=True)
class Equilibrium:
    """The line at rest.

    Attributes
    ----------
    height : (n_nodes,) of every mesh node [m]
    slope : (n_nodes,) dw/dx of the wires at every mesh node [-]
    dropper_force : (n_droppers,) tension [N]
    dropper_length : (n_droppers,) unstretched length, by which the dropper is cut [m]
    """

    height: np.ndarray
    slope: np.ndarray
    dropper_force: np.ndarray
    dropper_length: np.ndarray


def find_form(problem: Problem, mesh: LineMesh) -> tuple[Model, Equilibrium]:
    """The model of a line and its equilibrium under its own weight. Not collective.

    Raises
    ------
    InputError
        If a dropper would be slack at rest or would have no length, or if lengths do not settle.
    """
    length = mesh.points[mesh.droppers[:, 0], 2] - mesh.points[mesh.droppers[:, 1], 2]
    for _ in range(_MAX_PASSES):
        model = build(problem, mesh, length)
        form = _form(model)
        _check(problem.line, mesh, form)
        geometric = form.height[mesh.droppers[:, 0]] - form.height[mesh.droppers[:, 1]]
        change = np.abs(geometric - length).max(initial=0.0)
        length = geometric
        if change < _LENGTH_TOLERANCE:
            return model, form
    raise InputError(
        f"the lengths of the droppers do not settle: they still change by {1e3 * change:.2g} mm "
        f"after {_MAX_PASSES} passes, as each stretches the line by its own weight; make "
        "line.dropper.mass_kg_per_m smaller, or the tensions greater"
    )


def _form(model: Model) -> Equilibrium:
    mesh, line = model.mesh, model.problem.line
    lower_wire, upper_wire = line.wires_of(Role.CONTACT)[0], line.wires_of(Role.MESSENGER)[0]
    contact, messenger = mesh.wires[lower_wire.name], mesh.wires[upper_wire.name]
    assert lower_wire.profile is not None
    weighted = model.simulated.gravity != 0.0
    height = np.zeros(mesh.n_nodes)
    slope = np.zeros(mesh.n_nodes)

    lower = mesh.droppers[:, 1]
    arms = mesh.steady_arms if line.steady_arms[0].kind.holds_height else mesh.steady_arms[:0]
    held = np.concatenate([lower, arms, mesh.anchors[np.isin(mesh.anchors, contact)]])
    target = model.simulated.target_height(lower_wire.profile, mesh.x(held))
    load = model.weight.copy()
    reaction = _rest_on(model, lower_wire.name, held, target, load, height, slope)
    force = reaction[: lower.size] if weighted else np.zeros(lower.size)

    np.add.at(load, model.dofs(mesh.droppers[:, 0]), -force)
    top = upper_wire.top
    ends = mesh.anchors[np.isin(mesh.anchors, messenger)]
    # A support is a spring relaxed at the encumbrance: it gives way under the line's weight.
    springs = (mesh.supports, line.supports[0].stiffness, top)
    _rest_on(model, upper_wire.name, ends, np.full(ends.size, top), load, height, slope, springs)

    stretched = height[mesh.droppers[:, 0]] - height[lower]
    return Equilibrium(height, slope, force, stretched - force / model.dropper_stiffness)


def _rest_on(
    model: Model,
    wire: str,
    held: np.ndarray,
    target: np.ndarray,
    load: np.ndarray,
    height: np.ndarray,
    slope: np.ndarray,
    springs: tuple[np.ndarray, float, float] | None = None,
) -> np.ndarray:
    """Let one wire rest at prescribed heights of some nodes; fills height and slope of its nodes.

    ``springs`` are nodes, stiffness [N/m] and relaxed height [m] of springs to the ground.
    Returns the upward forces [N] that hold ``held``, in their order.
    """
    nodes = model.mesh.wires[wire]
    length = np.diff(model.mesh.x(nodes))
    data = model.problem.line.wire(wire)
    band = _chain_band(elements.stiffness(length, data.bending_stiffness, data.tension))
    place = np.full(model.mesh.n_nodes, -1)
    place[nodes] = np.arange(nodes.size)
    fixed = 2 * place[held]
    own = np.stack([model.dofs(nodes, "w"), model.dofs(nodes, "theta_y")], axis=1).ravel()
    own_load = load[own]
    if springs is not None:
        at, stiffness, relaxed = springs
        band[3, 2 * place[at]] += stiffness
        own_load[2 * place[at]] += stiffness * relaxed
    free_band = band.copy()
    prescribed = np.zeros(own.size)
    prescribed[fixed] = target
    right = own_load - _band_times(band, prescribed)
    right[fixed] = target
    for offset in range(band.shape[0]):
        low = fixed[fixed >= offset]
        free_band[3 - offset, low] = float(offset == 0)
        high = fixed[fixed + offset < own.size]
        free_band[3 - offset, high + offset] = float(offset == 0)
    solution = linalg.solveh_banded(free_band, right)
    height[nodes] = solution[0::2]
    slope[nodes] = solution[1::2]
    return (_band_times(band, solution) - own_load)[fixed]


def _chain_band(matrices: np.ndarray) -> np.ndarray:
    """Upper band, shape (4, 2 n + 2), of a chain of n elements assembled node by node."""
    n = 2 * matrices.shape[0] + 2
    band = np.zeros((4, n))
    first = 2 * np.arange(matrices.shape[0])
    for i in range(4):
        for j in range(i, 4):
            band[3 - (j - i), first + j] += matrices[:, i, j]
    return band


def _band_times(band: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Product of a symmetric matrix in upper-band storage, shape (4, n), with ``x``, shape (n,)."""
    result = band[3] * x
    for offset in range(1, 4):
        result[:-offset] += band[3 - offset, offset:] * x[offset:]
        result[offset:] += band[3 - offset, offset:] * x[:-offset]
    return np.asarray(result)


def _check(line: Line, mesh: LineMesh, form: Equilibrium) -> None:
    length = form.height[mesh.droppers[:, 0]] - form.height[mesh.droppers[:, 1]]
    _refuse(line, mesh, length <= 0, lambda i: f"would have a length of {length[i]:.3f} m")
    weighted = form.dropper_force.any()
    slack = (form.dropper_force <= 0) & weighted
    _refuse(
        line, mesh, slack, lambda i: f"would be slack at rest (force {form.dropper_force[i]:.1f} N)"
    )


def _refuse(line: Line, mesh: LineMesh, bad: np.ndarray, what: Callable[[int], str]) -> None:
    found = np.flatnonzero(bad)
    if found.size == 0:
        return
    x = mesh.x(mesh.droppers[found, 1])
    masts = line.support_positions
    span = np.clip(np.searchsorted(masts, x, side="right") - 1, 0, line.n_spans - 1)
    place = f"span {span[0] + 1} at {x[0] - masts[span[0]]:.2f} m from its left support"
    more = f", and so would {found.size - 1} more" if found.size > 1 else ""
    raise InputError(
        f"the dropper in {place} {what(int(found[0]))}{more}: change line.dropper.pre_sag_mm, the "
        "dropper positions, line.encumbrance_m or the tensions"
    )
