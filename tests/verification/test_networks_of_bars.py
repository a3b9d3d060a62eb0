"""Lines of other topologies at rest, warm and in a wind, against networks of bars in true geometry.

Wires have no bending stiffness, so that both are strings. The elements of the program round off the
kink of a string where something hangs on it, over a part of an element: the error of its shape
falls with the first power of the elements' length, so that it is about what a mesh of half as many
elements differs by; half as much again is allowed for its higher powers. Slopes of 0.05 are taken
as small there, which leaves their squares, some 2e-3 of what moves or of a force. A warm span is
longer by alpha dT, and so is its sag, which small displacements leave out.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from bar_network import BarNetwork
from measuring import check
from scenes import load_scene, problem_of
from small_lines import mesh_of
from studies import few

from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.wires import Role
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.elasticity import elasticity
from catenary.solver.statics.form_finding import find_form

N_SPANS, WARMER, SPEED = 6, 25.0, 15.0
SQUARES = 2e-3
# Axial stiffness [N], expansion [1/K] and diameter [mm] of each wire, so that droppers lean.
WIRES = {
    "contact_wire": (14e6, 1.7e-5, 13.0),
    "messenger_wire": (13e6, 1.5e-5, 15.0),
    "stitch_wire": (3.6e6, 1.2e-5, 7.5),
    "auxiliary_wire": (15e6, 1.3e-5, 14.0),
    "bridle": (3.6e6, 1.0e-5, 7.5),
}
OTHER_END = "line.ends.end.along=tensioner"
LINES: dict[str, tuple[str, list[str]]] = {
    "stitched": ("re330_stitched", [OTHER_END]),
    "compound": ("shinkansen_compound", [OTHER_END]),
    "alternating": (
        "dc_twin",
        [
            OTHER_END,
            "effects.relative_motion=true",
            "line.twin={spacing_m=0.1,droppers='alternating'}",
        ],
    ),
    "overlap": ("overlap", ["line.overlap.first_span=2", "line.overlap.n_spans=4"]),
}


def at_rest(name: str, elements: int) -> tuple[Problem, LineMesh, Model, Equilibrium]:
    case, more = LINES[name]
    own = load_scene(case)
    middle, kind = 0.5 * N_SPANS * own.line.span_m[0], own.train.pantographs[0].name
    words = [
        f"line.n_spans={N_SPANS}",
        "line.steady_arm.inclination_deg=8",
        f"line.temperature.difference_K={WARMER}",
        "effects.lateral_motion=true",
        "effects.axial_motion=true",
        f"wind={{speed_m_per_s={SPEED},height_m=10.0}}",
        f"train.pantographs=[{{name='{kind}'}}]",
        f"train.start_m={middle - 4.0}",
        f"train.end_m={middle + 4.0}",
        "train.raise_time_s=0.01",
        f"evaluation.from_m={middle}",
        f"evaluation.to_m={middle + 4.0}",
        *more,
    ]
    for wire, (stiffness, expansion, diameter) in WIRES.items():
        if getattr(own.line, wire) is not None:
            words += [
                f"line.{wire}.axial_stiffness_N={stiffness}",
                f"line.{wire}.expansion_per_K={expansion}",
                f"line.{wire}.diameter_mm={diameter}",
                f"line.{wire}.bending_stiffness_N_m2=0",
            ]
    for key in ("section_mm2", "youngs_modulus_GPa"):
        words += [
            f"line.{wire}.{key}="
            for wire in WIRES
            if getattr(getattr(own.line, wire), key, None) is not None
        ]
    problem = problem_of(load_scene(case, words))
    mesh = mesh_of(problem.line, elements)
    return problem, mesh, *find_form(problem, mesh)


def places(mesh: LineMesh, form: Equilibrium) -> np.ndarray:
    """Places of the nodes along the track, to the left and upwards, (n, 3) [m]."""
    assert form.lateral is not None
    return np.column_stack([mesh.points[:, 0] + form.along, form.lateral.y, form.height])


def network_of(name: str, problem: Problem, mesh: LineMesh) -> BarNetwork:
    length = float(problem.line.support_positions[-1])
    inside: Callable[[float], bool] = lambda x: 0.0 < x < length  # noqa: E731
    tensioned = inside if name == "overlap" else lambda x: x > 0.0
    return BarNetwork(problem.line, mesh, np.deg2rad(8.0), tensioned, problem.gravity)


@pytest.mark.parametrize("name", few(LINES, "stitched", "overlap"))
def test_a_line_is_at_rest_where_a_network_of_bars_is(name: str) -> None:
    (_, coarse, _, rough), (problem, mesh, model, form) = (at_rest(name, n) for n in (6, 12))
    network = network_of(name, problem, mesh)
    expected, forces = network.rest(WARMER, 0.5 * 1.225 * SPEED**2)
    moved = np.abs(expected - network.installed).max(axis=0)
    print(f"moves by {moved[0]:.3f} m along, {moved[1]:.3f} m across, {moved[2]:.3f} m up or down")
    heights = network.installed[:, 2]
    sag = max(float(np.ptp(heights[mesh.wires[wire.name]])) for wire in problem.line.wires)
    longer = np.array([0.0, 0.0, 1.7e-5 * WARMER * sag])
    # Nodes of the coarse mesh are every second one of the fine one.
    found, less = places(mesh, form), places(coarse, rough)
    for wire in problem.line.wires:
        nodes, few_nodes = mesh.wires[wire.name], coarse.wires[wire.name]
        shared = np.searchsorted(mesh.x(nodes), coarse.x(few_nodes) - 1e-6)
        if len(wire.pieces) > 1:
            shared = np.argmin(np.abs(mesh.x(nodes)[:, None] - coarse.x(few_nodes)), axis=0)
        for axis, what in enumerate(("along", "across", "height")):
            refined = np.abs(found[nodes[shared], axis] - less[few_nodes, axis]).max()
            within = 1.5 * refined + SQUARES * moved[axis] + longer[axis]
            own, wanted = found[nodes, axis], expected[nodes, axis]
            check(f"{wire.name} {what} [m]", own, wanted, within=within)
    refined = np.abs(form.dropper_force - rough.dropper_force).max()
    within = 1.5 * refined + SQUARES * forces.max()
    check("droppers [N]", form.dropper_force, forces, within=within)
    own_length = form.dropper_length - network.dropper_length
    cut = np.abs(form.dropper_length - rough.dropper_length).max()
    check("cut lengths [m]", own_length, 0.0, within=1.5 * cut)
    first = next(wire.name for wire in problem.line.wires_of(Role.CONTACT))
    masts = problem.line.support_positions
    span = (float(masts[2]), float(masts[3]))
    lifts = [elasticity(one, *span) for one in (find_form(problem, coarse)[0], model)]
    nodes = mesh.wires[first]
    nodes = nodes[np.isin(np.round(mesh.x(nodes), 6), np.round(lifts[1].x, 6))]
    wanted = network.compliance(nodes)
    shared = np.searchsorted(lifts[1].x, lifts[0].x - 1e-6)
    refined = np.abs(lifts[1].of_wires[shared, 0] - lifts[0].of_wires[:, 0]).max()
    within = 1.5 * refined + SQUARES * wanted.max()
    check("lift by a unit force [m/N]", lifts[1].of_wires[:, 0], wanted, within=within)
