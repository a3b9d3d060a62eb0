"""Points on a straight line: a curve with them does what one stiffness does, in all planes.

At rest droppers are then on an inner piece of their curve, so that they slacken by a bend of their
own, with what they do across them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI
from scenes import load_scene
from studies import few
from ts_alpha2 import TS_ALPHA2

from catenary.cases.studies.hard import runs

SHORT = (
    "line.n_spans=8", "train.start_m=160", "train.end_m=230", "train.raise_time_s=0.05",
    "evaluation.from_m=190", "evaluation.to_m=230", "line.dropper.stiffness_N_per_m=",
    "pantographs.three_masses.static_force_by_speed=",
    "pantographs.three_masses.static_force_N=260", "mesh.elements_per_gap=3",
)  # fmt: skip
STRAIGHT = "line.dropper.curve=[[0,0],[1e-4,10],[3e-4,30],[4e-3,400],[5e-3,500]]"
LATERAL = ("effects.lateral_motion=true",)
ALONG = (
    "effects.axial_motion=true",
    "line.contact_wire.axial_stiffness_N=1.5e7",
    "line.messenger_wire.axial_stiffness_N=1.2e7",
    "line.ends.start.along=tensioner",
)
WARM = (
    "line.temperature={difference_K=25}",
    "line.contact_wire.expansion_per_K=1.7e-5",
    "line.messenger_wire.expansion_per_K=1.7e-5",
)
BREAKS = (
    "incidents=[{type='dropper_break',at_s=0.3,span=4,dropper=3},"
    "{type='tension_loss',at_s=0.5,wire='messenger_wire',share=0.95}]",
)
SLACK = ("irregularities.dropper_lengths={standard_deviation_mm=6.0}",)
KEPT = ("line.dropper.residual_stiffness_ratio=0.05", "effects.residual_dropper_stiffness=true")
ONE_SYSTEM = "one system"
SCENES: dict[str, tuple[str, ...]] = {
    "vertical": (),
    "residual stiffness": KEPT,
    "kept dampers": ('line.dropper.slack_damping="kept"',),
    "slack at rest": SLACK,
    "slack at rest, residual stiffness": (*SLACK, *KEPT),
    "incidents": BREAKS,
    "lateral": LATERAL,
    "along": (*ALONG, *WARM),
    "three planes, incidents": (*LATERAL, *ALONG, *BREAKS),
    "window": ("window.mode=exact",),
    ONE_SYSTEM: (),
}


@pytest.mark.parametrize(
    "name",
    few(
        SCENES,
        "along",
        "incidents",
        "vertical",
        "window",
        "kept dampers",
        "slack at rest, residual stiffness",
    ),
)
def test_points_on_a_straight_line_change_nothing(name: str) -> None:
    found = []
    for law in ("line.dropper.axial_stiffness_N=1e5", STRAIGHT):
        rest = runs.at_rest(load_scene("ac_simple", (*SHORT, *SCENES[name], law)), MPI.COMM_SELF)
        if name == ONE_SYSTEM:
            second = replace(rest.problem.numerics, scheme=TS_ALPHA2)
            rest = rest._replace(problem=replace(rest.problem, numerics=second))
        run = runs.run(rest, MPI.COMM_SELF, with_work=name != ONE_SYSTEM)
        assert run.outcome == "done"
        found.append((rest, run))
    (rest, run), (other_rest, other) = found
    tension = rest.form.dropper_force
    assert (other_rest.model.dropper_pieces.begin > 0.0).sum() > 0.8 * tension.size
    off = {"rest": np.abs(tension - other_rest.form.dropper_force).max()}
    for what in ("force", "energy", "terms"):
        one = getattr(run, what)
        off[what] = np.abs(one - getattr(other, what)).max(initial=0.0)
    slack = int((~run.taut).sum())
    print(f"{name}: droppers slack {slack} times; off by {off}")
    assert slack > 20 or not run.taut.size
    # Round-off of 1e-12 N, of which heads that hop and droppers that slacken make a thousand times
    # as much; steps in which a set differed would be off by newtons.
    assert max(off.values()) < 1e-6
