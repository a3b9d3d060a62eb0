"""Exact windows on lines of all kinds against steps of the whole line: forces to round-off.

Each shipped case, and what scenes may have besides: incidents, ends that absorb, several
pantographs, damping by component.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI
from scenes import load_scene
from windowed import apart, march

from catenary import InputError
from catenary.cases.studies.hard import runs as hard_runs
from catenary.solver.problem.problem import EXACT, WindowChoice

pytestmark = pytest.mark.study

# Round-off of a step, 1e-16, grows to some 1e-13 of the force in as many steps as these; a dropper
# that slackens, or a head that hops, some 1e-16 later makes a thousand times as much of it.
ROUND_OFF = 1e-10
SPANS = ("line.n_spans=40",)
BREAKS = "incidents=[{type='dropper_break',at_s=0.3,span=4,dropper=3}]"
TENSION = "incidents=[{type='tension_loss',at_s=0.3,wire='messenger_wire',share=0.9}]"
LOWERED = "incidents=[{type='lowering',at_s=0.3}]"
ABSORBS = ("line.ends.start.kind=absorbing_layer", "line.ends.start.spans=2",
           "line.ends.end.kind=absorbing_layer", "line.ends.end.spans=6")  # fmt: skip
ALONG = ("effects.axial_motion=true", "line.contact_wire.axial_stiffness_N=1e7",
         "line.messenger_wire.axial_stiffness_N=1e7", "line.ends.start.along=tensioner",
         "line.steady_arm.length_m=1.2")  # fmt: skip
TWO = "train.pantographs=[{name='three_masses'},{name='three_masses',behind_m=100}]"
BEHIND = ("train.start_m=250",)
CURVES = ("line.dropper.stiffness_N_per_m=",
          "line.dropper.curve=[[0,0],[5e-4,20],[1e-3,80],[3e-3,120],[4e-3,600]]")  # fmt: skip
SCENES: dict[str, tuple[str, tuple[str, ...]]] = {
    "ambrosio2012": ("ambrosio2012", SPANS),
    "en50318_2002": ("en50318_2002", SPANS),
    "ac_simple": ("ac_simple", SPANS),
    "ac_simple_3d": ("ac_simple_3d", SPANS),
    "curve": ("curve", ()),
    "dc_twin": ("dc_twin", SPANS),
    "overlap": ("overlap", ()),
    "re330_stitched": ("re330_stitched", SPANS),
    "record_574": ("record_574", ()),
    "shinkansen_compound": ("shinkansen_compound", SPANS),
    "tramway": ("tramway", SPANS),
    "windy_viaduct": ("windy_viaduct", ()),
    "dropper curves": ("ac_simple", (*SPANS, *CURVES)),
    "dropper curves and incidents": ("ac_simple", (*SPANS, *CURVES, *ALONG, BREAKS)),
    "axial motion": (
        "ac_simple", (*SPANS, *ALONG),
    ),
    "dropper breaks": ("ac_simple", (*SPANS, BREAKS)),
    "tension loss": ("ac_simple", (*SPANS, TENSION)),
    "lowering": ("ac_simple", (*SPANS, LOWERED)),
    "absorbing layers": ("ac_simple", (*SPANS, *ABSORBS)),
    "two pantographs": ("ac_simple", (*SPANS, TWO, *BEHIND)),
}  # fmt: skip
# Simulated time [s]: waves have then run some spans.
SECONDS = 0.8


@pytest.mark.parametrize("name", SCENES)
def test_an_exact_window_gives_the_forces_of_the_whole_line(name: str) -> None:
    case, words = SCENES[name]
    rest = hard_runs.at_rest(load_scene(case, words), MPI.COMM_SELF)
    train = rest.problem.train
    train = replace(train, end=train.start + SECONDS * train.speed)
    rest = rest._replace(problem=replace(rest.problem, train=train))
    whole = march(rest)
    assert whole.outcome == "done"
    found = march(rest, WindowChoice(EXACT))
    off = apart(found, whole)
    print(f"{name}: {len(whole.time)} steps, forces {off:.1e} of the largest apart")
    assert found.outcome == "done" and off < ROUND_OFF
    assert np.ptp(whole.force[100:]) > 1.0


def test_what_no_window_can_follow_is_refused_in_a_sentence() -> None:
    for words, why in (
        (("line.ends.end.kind=periodic",), "an end of the line is periodic"),
        (("numerics.scheme=fixed_point",), "numerics.scheme is fixed_point"),
        (("numerics.coupling=explicit",), "numerics.coupling is explicit"),
        (("numerics.adaptive_tolerance_N=10",), "lets steps be halved"),
        ((*ALONG, "window.mode=bounded"), "run far ahead of a window"),
    ):
        with pytest.raises(InputError) as refused:
            load_scene("ac_simple", ("window.mode=exact", *words))
        assert why in str(refused.value) and "\n" not in str(refused.value)
