"""Head of a result file: facts that are known before the first step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from catenary.meshgen.line import Line
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.wires import Role

if TYPE_CHECKING:
    from catenary.solver.statics.elasticity import Elasticity
    from catenary.solver.statics.form_finding.equilibrium import Equilibrium


@dataclass(frozen=True)
class Header:
    """Root attributes and constant datasets of a result file; only rank 0 needs it.

    Attributes
    ----------
    attributes : as `RunAttributes`; text and numbers are stored as they are, lists and tables as
        JSON. ``system`` is a key of ``postproc.standards``, ``rules`` lists names of rule books,
        and whole ones; ``effects_on`` and ``effects_off`` are lists of (name, title, reason).
    datasets : path in the file -> array, from ``line_datasets`` and ``static_datasets``
    facts : name -> value of all facts, from ``facts_of``
    """

    attributes: Mapping[str, Any]
    datasets: Mapping[str, np.ndarray]
    facts: Mapping[str, np.ndarray]


def wire_roles(line: Line) -> dict[str, str]:
    """Root attribute ``wires``: the role of each wire by its name, in the order of the line."""
    return {wire.name: wire.role.value for wire in line.wires}


def line_datasets(
    line: Line, mesh: LineMesh, evaluation: tuple[float, float]
) -> dict[str, np.ndarray]:
    """Datasets of ``/line``: masts, spans of the droppers, ranges, chains of nodes. Not collective.

    Parameters
    ----------
    line : Line
        The line.
    mesh : LineMesh
        Mesh of the line.
    evaluation : tuple of float
        Stretch whose statistics are judged, from and to [m].
    """
    masts = line.support_positions
    dropper_x = mesh.x(mesh.droppers[:, 1])
    datasets = {
        "line/support_x": masts,
        "line/dropper_span": np.searchsorted(masts, dropper_x, side="right") - 1,
        "line/running_range": np.array(line.running_range),
        "line/evaluation_range": np.array(evaluation, dtype=float),
        "line/droppers": np.asarray(mesh.droppers, dtype=np.int64),
        "line/arm_wire": _arm_wire(line, mesh),
    }
    for name, nodes in mesh.wires.items():
        datasets[f"line/wires/{name}"] = np.asarray(nodes, dtype=np.int64)
    for name, breaks in mesh.breaks.items():
        datasets[f"line/breaks/{name}"] = np.asarray(breaks, dtype=np.int64)
    return datasets


def _arm_wire(line: Line, mesh: LineMesh) -> np.ndarray:
    """Number of the wire that each steady arm holds, in the order of the line, (n_arms,)."""
    names = [wire.name for wire in line.wires]
    of_group = np.array([names.index(arms.wire) for arms in line.steady_arms], dtype=np.int64)
    return of_group[mesh.arm_group] if of_group.size else np.zeros(0, dtype=np.int64)


def static_datasets(
    line: Line,
    mesh: LineMesh,
    equilibrium: Equilibrium,
    elasticity: Elasticity,
) -> dict[str, np.ndarray]:
    """Datasets of ``/static``: droppers, profiles, registration and elasticity at rest, but not the
    lengths to which droppers are cut. Not collective.

    Parameters
    ----------
    line : Line
        The line.
    mesh : LineMesh
        Mesh of the line.
    equilibrium : Equilibrium
        The line at rest.
    elasticity : Elasticity
        Elasticity of the line at rest.
    """
    contact = np.concatenate([mesh.wires[wire.name] for wire in line.wires_of(Role.CONTACT)])
    return {
        "static/dropper_force": equilibrium.dropper_force,
        "static/contact_x": mesh.x(contact),
        "static/contact_height": equilibrium.height[contact],
        "static/elasticity_x": elasticity.x,
        "static/elasticity": elasticity.lift,
        "static/elasticity_of_wires": elasticity.of_wires,
        **_registration(line, mesh, equilibrium),
    }


def _registration(line: Line, mesh: LineMesh, form: Equilibrium) -> dict[str, np.ndarray]:
    """Forces of steady arms at rest, and lateral positions of the contact wires where they move so.

    Without lateral motion arms carry the radial force of the stagger; nothing for straight wires.
    """
    if form.lateral is not None:
        contact = np.concatenate([mesh.wires[wire.name] for wire in line.wires_of(Role.CONTACT)])
        return {
            "static/arm_stagger": form.lateral.y[mesh.steady_arms],
            "static/arm_force": form.lateral.arm_force,
            "static/arm_tension": form.lateral.arm_tension,
            "static/contact_y": form.lateral.y[contact],
        }
    stagger, force = np.zeros(mesh.steady_arms.size), np.zeros((mesh.steady_arms.size, 3))
    for number, arms in enumerate(line.steady_arms):
        mine = mesh.arm_group == number
        x, wire = mesh.x(mesh.steady_arms[mine]), line.wire(arms.wire)
        stagger[mine], force[mine, 0] = wire.points(x)[:, 1], wire.radial_force(x)
    if not force.any():
        return {}
    if form.arm_lift.size:
        force[:, 1] = form.arm_lift
    tension = np.linalg.norm(force, axis=1)
    return {
        "static/arm_stagger": stagger,
        "static/arm_force": force,
        "static/arm_tension": tension,
    }
