"""Lines, meshes and problems for tests, made without files and without Gmsh."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from plain_mesh import mesh_on

from catenary.mbs.lumped_data import LumpedData
from catenary.meshgen.geometry import find_cuts
from catenary.meshgen.line import DropperKind, Line, SteadyArm
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.line_data import LineData
from catenary.meshgen.wires import Conductor
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.problem import Damping, Numerics, Placement, Problem, Train

# Wires without anything that damps or hangs on them; the least that a march can be made of.
BARE = frozenset({"vertical"})
# Everything that changes the line's matrices and weights.
HANGING = BARE | {
    "gravity",
    "pre_sag",
    "transition_spans",
    "dropper_mass",
    "clamp_mass",
    "arm_inertia",
    "arm_stiffness",
}
WHOLE = HANGING | {
    "structural_damping",
    "dropper_slackening",
    "contact_loss",
    "several_pantographs",
}

EN_CONTACT_WIRE = Conductor(tension=20e3, mass_per_length=1.35, bending_stiffness=195.0)
EN_MESSENGER_WIRE = Conductor(tension=16e3, mass_per_length=1.07, bending_stiffness=131.7)
# EN 50318:2002, annex: head 7.2 kg, frame 15 kg.
EN_PANTOGRAPH = LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0))
# One mass without springs: what it does against a rigid wire has a closed form.
FREE_MASS = LumpedData((8.0,), (0.0,), (0.0,))


def bare_wires(
    length: float,
    contact_wire: Conductor = EN_CONTACT_WIRE,
    messenger_wire: Conductor = EN_MESSENGER_WIRE,
) -> LineData:
    """One span of ``length`` [m] without droppers: two wires pinned at both ends, not coupled."""
    return LineData(
        span_lengths=(length,),
        dropper_positions=((),),
        pre_sag=((),),
        stagger=(0.0, 0.0),
        contact_height=5.5,
        encumbrance=1.2,
        contact_wire=contact_wire,
        messenger_wire=messenger_wire,
        dropper=DropperKind(1e5, None, 0.0, 0.0, 0.0),
        support_stiffness=5e4,
        steady_arm=SteadyArm(1.0, 0.0, 0.0, 0.0),
        n_transition=(0, 0),
        transition_rise=0.0,
    )


def en50318_line(n_spans: int) -> LineData:
    """The reference line of EN 50318:2002: spans of 60 m, 9 massless droppers, no pre-sag."""
    droppers = (5.0, 10.5, 17.0, 23.5, 30.0, 36.5, 43.0, 49.5, 55.0)
    return replace(
        bare_wires(60.0),
        span_lengths=(60.0,) * n_spans,
        dropper_positions=(droppers,) * n_spans,
        pre_sag=((0.0,) * 9,) * n_spans,
        stagger=(0.0,) * (n_spans + 1),
        steady_arm=SteadyArm(1.0, 0.0, 0.0, 300.0),
    )


def ac_simple_line(n_spans: int) -> LineData:
    """The simple AC catenary of the benchmark of ten codes (2015): pre-sag, clamps, steady arms."""
    sag = tuple(millimetres / 1000 for millimetres in (0, 24, 41, 52, 55, 52, 41, 24, 0))
    return LineData(
        span_lengths=(55.0,) * n_spans,
        dropper_positions=(tuple(4.5 + 5.75 * k for k in range(9)),) * n_spans,
        pre_sag=(sag,) * n_spans,
        stagger=tuple(0.2 * (-1) ** i for i in range(n_spans + 1)),
        contact_height=5.08,
        encumbrance=1.2,
        contact_wire=Conductor(22e3, 1.35, 195.0),
        messenger_wire=Conductor(16e3, 1.08, 131.7),
        dropper=DropperKind(1e5, None, 0.117, 0.195, 0.165),
        support_stiffness=5e5,
        steady_arm=SteadyArm(1.22, 0.73, 0.2, 0.0),
        n_transition=(0, 0),
        transition_rise=0.0,
    )


def mesh_of(line: LineData | Line, elements_per_gap: int) -> LineMesh:
    """Equal elements between neighbouring cuts, on all wires; heights without pre-sag and sag."""
    line = make_line(line) if isinstance(line, LineData) else line
    cuts, share = find_cuts(line).x, np.arange(elements_per_gap) / elements_per_gap
    gaps = cuts[:-1, None] + np.diff(cuts)[:, None] * share
    return mesh_on(line, np.append(gaps.ravel(), cuts[-1]))


def numerics(dt: float, scheme: str = "one_solve", **changes: Any) -> Numerics:
    """Average acceleration; the fixed-point correction as tight as round-off lets it be."""
    usual = Numerics(
        dt=dt, scheme=scheme, beta=0.25, gamma=0.5, eps_d=1e-13, eps_v=1e-10, max_iterations=200
    )
    return replace(usual, **changes)


def train(
    speed: float,
    start: float,
    end: float,
    *,
    data: LumpedData = EN_PANTOGRAPH,
    static_force: float = 120.0,
    behind: tuple[float, ...] = (0.0,),
    raise_time: float = 0.5,
    nominal_height: float | None = None,
) -> Train:
    """Equal pantographs, each ``behind`` [m] the train's reference point."""
    placements = tuple(
        Placement(data, static_force, distance, nominal_height) for distance in behind
    )
    return Train(speed, start, end, raise_time, placements)


def problem_of(line: LineData | Line, effects: frozenset[str] = WHOLE, **changes: Any) -> Problem:
    """A problem on ``line`` with the damping and contact of EN 50318; keywords replace fields."""
    first, last = line.running_range
    usual = Problem(
        line=make_line(line) if isinstance(line, LineData) else line,
        damping=Damping(alpha=1e-4, beta=0.0125),
        contact=LinearLaw(stiffness=5e4, damping=0.0),
        train=train(70.0, first, last),
        numerics=numerics(1e-3),
        evaluation=(first, last),
        residual_stiffness_ratio=0.0,
        effects=effects,
    )
    return replace(usual, **changes)
