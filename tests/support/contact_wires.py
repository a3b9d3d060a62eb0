"""Lines of several contact wires without files: twins, and an overlap; a run on them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from small_lines import WHOLE, en50318_line, numerics, problem_of, train

from catenary.meshgen.line import Droppers, Line
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.wires import Piece, Role, Section
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.problem import Damping, Problem

STIFFNESS = 5e4  # [N/m] of a contact


def one_wire() -> Line:
    """Two spans of 24 m with three droppers each."""
    return make_line(
        replace(
            en50318_line(2),
            span_lengths=(24.0, 24.0),
            dropper_positions=((4.0, 12.0, 20.0),) * 2,
            pre_sag=((0.0,) * 3,) * 2,
        )
    )


def twins(first: float) -> Line:
    """The same with the share ``first`` of its contact wire, droppers and arms, and the rest beside
    it."""
    line = one_wire()
    (wire,), (droppers,), (arms,) = line.wires_of(Role.CONTACT), line.droppers, line.steady_arms
    wires: list[Any] = []
    groups: list[Any] = []
    hardware: list[Any] = []
    for share, end in ((first, ""), (1.0 - first, "_2")):
        name = wire.name + end
        part = {
            key: share * getattr(wire, key)
            for key in ("tension", "mass_per_length", "bending_stiffness")
        }
        wires.append(replace(wire, name=name, **part))
        assert droppers.kind.stiffness is not None
        kind = replace(droppers.kind, stiffness=share * droppers.kind.stiffness)
        groups.append(replace(droppers, name=droppers.name + end, kind=kind, lower=name))
        arm = replace(arms.kind, stiffness=share * arms.kind.stiffness)
        hardware.append(replace(arms, name=arms.name + end, kind=arm, wire=name))
    others = [other for other in line.wires if other is not wire]
    return replace(
        line,
        wires=(*wires, *others),
        droppers=tuple(groups),
        steady_arms=tuple(hardware),
    )


def overlap() -> Line:
    """One contact wire that ends at 33 m, 0.15 m higher, and one that begins so at 15 m.

    Both are at the same height from 20 to 28 m.
    """
    line = one_wire()
    (wire,), (droppers,) = line.wires_of(Role.CONTACT), line.droppers
    (piece,), profile = wire.pieces, wire.profile
    assert profile is not None
    places = np.array([4.0, 12.0, 20.0, 28.0, 36.0, 44.0])
    ends, groups = ((0.0, 33.0), (15.0, 48.0)), []
    wires = []
    for number, (low, high) in enumerate(ends):
        # The running height between the droppers, a rise towards the end in the overlap.
        name = wire.name + ("_2" if number else "")
        running = ((0.0, 28.0), (20.0, 48.0))[number]
        rise = replace(profile, sections=(Section((low, high), running, (0.15, 0.15)),))
        y = float(piece.y[0])
        own = Piece((low, high), (y, y), (profile.height, profile.height), piece.ends)
        wires.append(replace(wire, name=name, pieces=(own,), profile=rise))
        mine = places[:4] if number == 0 else places[2:]
        x = tuple(mine.tolist())
        groups.append(
            Droppers(f"droppers_{number}", droppers.kind, line.wires[-1].name, name, x, x)
        )
    others = [other for other in line.wires if other is not wire]
    arms = tuple(replace(own, x=()) for own in line.steady_arms)
    return replace(line, wires=(*wires, *others), droppers=tuple(groups), steady_arms=arms)


def problem_on(line: Line, **changes: Any) -> Problem:
    """A head that rises into the wires, fast and strong enough to leave droppers slack."""
    run = train(100.0, 6.0, 42.0, static_force=260.0, raise_time=0.0, nominal_height=5.5)
    usual = problem_of(
        line,
        WHOLE - {"transition_spans"},  # wires of an overlap begin and end level
        damping=Damping(alpha=2e-4, beta=0.0),
        train=replace(run, start_below=0.02),
        numerics=numerics(1e-3),
        contact=LinearLaw(STIFFNESS, 0.0),
    )
    return replace(usual, **changes)
