"""What an installer needs of a line at rest: which wire hangs on which, and how long it is."""

from __future__ import annotations

import numpy as np

from catenary.meshgen.line import Line
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.wires import End
from catenary.postproc.read.registration import Registration
from catenary.solver.model.rest_shape import Equilibrium


def installed(line: Line, mesh: LineMesh, height: np.ndarray) -> dict[str, np.ndarray]:
    """Names of the wires that droppers join, and lengths of wires between clamps.

    Parameters
    ----------
    height : (n_nodes,) of the line at rest [m]

    Returns
    -------
    ``line/dropper_upper``, ``line/dropper_lower`` : (n_droppers,) names of wires
    ``static/lengths/NAME`` : length along each piece of a wire whose ends are clamped [m]
    """
    group = mesh.dropper_group
    ends = (
        ("upper", [own.upper for own in line.droppers]),
        ("lower", [own.lower for own in line.droppers]),
    )
    found = {f"line/dropper_{end}": np.array(names, dtype=str)[group] for end, names in ends}
    for wire in line.wires:
        if all(End.CLAMPED in piece.ends for piece in wire.pieces):
            nodes = mesh.wires[wire.name]
            pieces = np.split(nodes, mesh.breaks.get(wire.name, np.zeros(0, dtype=int)))
            lengths = [np.hypot(np.diff(mesh.x(own)), np.diff(height[own])).sum() for own in pieces]
            found[f"static/lengths/{wire.name}"] = np.array(lengths)
    return found


def registration_of(mesh: LineMesh, form: Equilibrium) -> Registration | None:
    """Steady arms at rest, None if wires do not move sideways, so that nothing pushes an arm."""
    if form.lateral is None:
        return None
    x, nodes = mesh.x(mesh.steady_arms), mesh.steady_arms
    return Registration(x, form.lateral.y[nodes], form.lateral.arm_force, form.lateral.arm_tension)
