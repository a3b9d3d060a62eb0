"""Effects of irregularities and defects, which change a line once its droppers have been cut."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from catenary.meshgen.line import Line
from catenary.solver.effects.effect import Effect
from catenary.solver.model.link_directions import at_places
from catenary.solver.problem.defects import (
    BentWire,
    HardSpot,
    Kink,
    LooseClamp,
    MissingDropper,
    WornWire,
    WrongTension,
)
from catenary.solver.problem.problem import Problem, Simulated

if TYPE_CHECKING:
    from catenary.solver.model.builder import ModelBuilder

_Kind = TypeVar("_Kind")


def _of_kind(problem: Problem, kind: type[_Kind]) -> Iterator[_Kind]:
    return (defect for defect in problem.defects if isinstance(defect, kind))


def _has(kind: type) -> Callable[[Problem], bool]:
    return lambda problem: any(True for _ in _of_kind(problem, kind))


def _worn(line: Line, problem: Problem) -> Line:
    worn = list(_of_kind(problem, WornWire))
    wires = (
        replace(wire, worn=tuple((d.start, d.end, d.lost) for d in worn if d.wire == wire.name))
        for wire in line.wires
    )
    return replace(line, wires=tuple(wires))


def _hard_spots(builder: ModelBuilder) -> None:
    for spot in _of_kind(builder.problem, HardSpot):
        place = at_places(builder.model, spot.wire, np.array([spot.x]))
        if spot.mass:
            builder.add_masses_at(spot.wire, place, np.array([spot.mass]))
        if spot.stiffness:
            spring = place.matrices(np.array([spot.stiffness]))
            builder.add_elements(spot.wire, place.unknowns, stiffness=spring)


def _kinks(laws: Simulated, problem: Problem) -> Simulated:
    bent = []
    for kink in _of_kind(problem, Kink):
        wire = problem.line.wire(kink.wire)
        decay = float(np.sqrt(wire.bending_stiffness / wire.tension))
        # A worn wire straightens over less; where wear begins beside the kink, the mean counts.
        _, left = wire.left_of(kink.x + decay * np.array([[-1.0, 1.0]]))
        decay *= float(np.sqrt(left[0]))
        bent.append(BentWire(kink.wire, kink.x, kink.angle, decay))
    return replace(laws, surface=(*laws.surface, *bent))


DEFECTS = (
    Effect(
        "contact_wire_height",
        "irregular heights of the contact wires at their droppers",
        "heights that droppers are cut for; [irregularities.contact_wire_height]",
        "sums of sines after Shinozuka and Jan (1972); table",
        requires=("gravity",),
        data="irregularities.contact_wire_height",
        applies=lambda p: p.irregularities.heights is not None,
        law=lambda laws, p: replace(laws, irregular_heights=p.irregularities.heights),
        after_cutting=True,
        cut_for=True,
    ),
    Effect(
        "dropper_lengths",
        "droppers that are cut too long or too short",
        "errors of length, by which the line rests otherwise; [irregularities.dropper_lengths]",
        "static equilibrium with given lengths of droppers that only pull",
        requires=("gravity",),
        data="irregularities.dropper_lengths",
        applies=lambda p: p.irregularities.lengths is not None,
        law=lambda laws, p: replace(laws, length_errors=p.irregularities.lengths),
        after_cutting=True,
    ),
    Effect(
        "running_surface",
        "waviness of the contact wires' running surface",
        "a height and a slope at each contact; [irregularities.running_surface]",
        "sums of sines after Shinozuka and Jan (1972); table",
        data="irregularities.running_surface",
        applies=lambda p: p.irregularities.surface is not None,
        law=lambda laws, p: replace(
            laws, surface=(*laws.surface, *filter(None, [p.irregularities.surface]))
        ),
    ),
    Effect(
        "missing_dropper",
        "droppers that are missing from the start",
        "matrices, weights and rest without the dropper and its clamps; [[defects]]",
        "static equilibrium with given lengths of droppers that only pull",
        requires=("gravity",),
        data="defects of the type missing_dropper",
        applies=_has(MissingDropper),
        law=lambda laws, p: replace(
            laws, missing=tuple(defect.place for defect in _of_kind(p, MissingDropper))
        ),
        after_cutting=True,
    ),
    Effect(
        "loose_clamp",
        "droppers whose clamp slips from the start",
        "matrices and rest without the dropper, whose masses stay; [[defects]]",
        "static equilibrium with given lengths of droppers that only pull",
        requires=("gravity",),
        data="defects of the type loose_clamp",
        applies=_has(LooseClamp),
        law=lambda laws, p: replace(
            laws, loose=tuple(defect.place for defect in _of_kind(p, LooseClamp))
        ),
        after_cutting=True,
    ),
    Effect(
        "worn_wire",
        "wires that are worn over a stretch",
        "less mass and bending stiffness there, under the same tension; [[defects]]",
        "section of a round wire worn flat from below",
        requires=("gravity",),
        data="defects of the type worn_wire",
        applies=_has(WornWire),
        hangs=_worn,
        after_cutting=True,
    ),
    Effect(
        "wrong_tension",
        "wires that hang with a wrong tension",
        "matrices and rest with it, droppers cut for the right one; [[defects]]",
        "static equilibrium with given lengths of droppers that only pull",
        requires=("gravity",),
        data="defects of the type wrong_tension",
        applies=_has(WrongTension),
        hangs=lambda line, p: line.with_shares(
            {defect.wire: defect.factor for defect in _of_kind(p, WrongTension)}
        ),
        after_cutting=True,
    ),
    Effect(
        "hard_spot",
        "hard spots of wires",
        "a lumped mass and a spring at a place, droppers cut without them; [[defects]]",
        "obstacle on a string: R = -D / (D + 2 i w Z)",
        requires=("gravity",),
        data="defects of the type hard_spot",
        applies=_has(HardSpot),
        build=_hard_spots,
        after_cutting=True,
    ),
    Effect(
        "kink",
        "kinks of contact wires, as at a splice",
        "a height and a slope at each contact; [[defects]]",
        "bent beam under tension: z = -angle l exp(-|x| / l) / 2, l = sqrt(EI / F)",
        data="defects of the type kink",
        applies=_has(Kink),
        law=_kinks,
    ),
)
