"""A scene on which every shipped effect finds something to act on, and what a model holds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Set
from dataclasses import replace

import numpy as np
from small_lines import BARE, EN_PANTOGRAPH, ac_simple_line, problem_of, train

from catenary.mbs.air import Polynomial, Uplift
from catenary.mbs.head.laws import Law, Regulation
from catenary.mbs.head.stepping import Lowering
from catenary.mbs.head.strips import Flexure, Strips, Suspension, Turning
from catenary.mbs.vehicle import Harmonic, Vehicle, VehicleMotion
from catenary.meshgen.line import DropperPlace, Fittings
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE, LineMesh
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.line_data import LineData
from catenary.solver.effects.build_model import build
from catenary.solver.model.model import Model
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.defects import (
    DropperBreak,
    HardSpot,
    Heights,
    Irregularities,
    Kink,
    LengthErrors,
    LooseClamp,
    MissingDropper,
    TensionLoss,
    WornWire,
    WrongTension,
)
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.problem.wind import Gusts, Wind

N_SPANS = 4
WIND = Wind(25.0, gusts=Gusts(2.0))
CAR = Vehicle(3e4, 2e6, 9e5, 4e4, 19.0, 2.5)
INSULATORS = Fittings("section_insulator", CONTACT_WIRE, (100.3, 101.7), (5.0, 5.0))
DEFECTS = (
    MissingDropper(DropperPlace(88.25)),
    LooseClamp(DropperPlace(137.5)),
    WornWire(CONTACT_WIRE, 60.0, 80.0, 0.2),
    WrongTension(CONTACT_WIRE, 1.05),
    HardSpot(CONTACT_WIRE, 120.2, 5.0, 300.0),
    Kink(CONTACT_WIRE, 130.0, 0.01),
)


def full_line() -> LineData:
    """A line on which every shipped effect finds something to act on."""
    line = ac_simple_line(N_SPANS)
    return replace(
        line,
        steady_arm=replace(line.steady_arm, stiffness=300.0, uplift_stop=0.1),
        contact_wire=replace(line.contact_wire, diameter=0.0144),
        messenger_wire=replace(line.messenger_wire, diameter=0.014),
        n_transition=(1, 1),
        transition_rise=0.2,
    )


def full_problem(names: frozenset[str]) -> Problem:
    line = full_line()
    uplift = Uplift(Polynomial((0.0, 0.0, 0.01)))
    limiter = Law(1, 2, False, (-1.0, 0.1, 1.0), (0.0, 0.0, 9e3))
    rolling = replace(EN_PANTOGRAPH, roll=Turning(2.0, 470.0, 1.0), uplift=uplift, laws=(limiter,))
    bending = Strips(
        length=1.6, suspension=Suspension(1.0, 8e3, 10.0), flexure=Flexure(600.0, 0.9, 2), rake=0.3
    )
    rolling = replace(rolling, strips=bending)
    speed = 1.1 * line.contact_wire.wave_speed
    ours = train(speed, 60.0, 160.0, data=rolling, behind=(0.0, 31.0))
    lowered = replace(
        ours.placements[0],
        lowering=Lowering(0.5, -50.0, 0.2, 0.4),
        regulator=Regulation(False, 120.0, ((0.0, 0.1, 1.0, 0.0),), -50.0, 50.0, 0.01),
    )
    heights = Heights((0.0, 220.0), None, ((90.0, 0.0), (100.0, 0.005), (110.0, 0.0)))
    return problem_of(
        replace(make_line(line), fittings=(INSULATORS,)),
        names,
        damping=Damping(1e-4, 0.0125),
        contact=LinearLaw(5e4, 50.0),
        train=replace(
            ours,
            vehicle=VehicleMotion((Harmonic(0.01, 1.0),), suspension=CAR),
            placements=(lowered, *ours.placements[1:]),
        ),
        residual_stiffness_ratio=0.01,
        incidents=(DropperBreak(0.5, DropperPlace(80.0)), TensionLoss(0.6, MESSENGER_WIRE, 0.9)),
        irregularities=Irregularities(heights, heights, LengthErrors(0.001, 2.0, 1)),
        defects=DEFECTS,
        wind=WIND,
    )


def model_with(names: Set[str], mesh: LineMesh) -> Model:
    lengths = np.full(mesh.droppers.shape[0], 1.0)
    return build(full_problem(BARE | names), mesh, lengths)


def contents(model: Model) -> Counter[tuple[str, int, bool, bool]]:
    """Every block as component, number of elements, and which matrices it has."""
    return Counter(
        (block.component, block.dofs.shape[0], block.mass is not None, block.stiffness is not None)
        for block in model.blocks
    )


def counts(mesh: LineMesh) -> dict[str, int]:
    return {
        "elements": mesh.n_nodes - 2,
        "droppers": mesh.droppers.shape[0],
        "arms": mesh.steady_arms.size,
        "supports": mesh.supports.size,
        "fittings": 2,
        "one wire": (mesh.n_nodes - 2) // 2,
        "unknowns": 2 * mesh.n_nodes,
        "spots": 1,
    }


def with_line(problem: Problem, **changes: object) -> Problem:
    return replace(problem, line=make_line(replace(full_line(), **changes)))


def with_dropper(problem: Problem, **changes: float) -> Problem:
    return with_line(problem, dropper=replace(full_line().dropper, **changes))


def with_arm(problem: Problem, **changes: float) -> Problem:
    return with_line(problem, steady_arm=replace(full_line().steady_arm, **changes))
