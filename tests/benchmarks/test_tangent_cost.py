"""Cost of derivatives: processor time a step of a march, of each tangent beside it, and of their
set-ups."""

from __future__ import annotations

import time

import pytest
from mpi4py import MPI
from scenes import load_scene

from catenary.cases.run.at_rest import sound_rest
from catenary.cases.studies.parameters.derivatives import change_by
from catenary.cases.studies.parameters.parameters import ChangedScenes
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.tangents.march import march_with_tangents
from catenary.solver.tangents.set_up import Change, set_up_of

COMM, REPEATS = MPI.COMM_SELF, 3
OF_LINE = (
    "line.contact_wire.mass_kg_per_m",
    "line.messenger_wire.mass_kg_per_m",
    "line.contact_wire.tension_N",
    "line.messenger_wire.tension_N",
    "line.contact_wire.bending_stiffness_N_m2",
    "line.damping.alpha_s",
    "line.dropper.contact_clamp_kg",
    "line.support.stiffness_N_per_m",
)
DROPPERS = tuple(f"irregularities.dropper_lengths.8.{number}" for number in range(1, 9))


def us_a_step(at_rest: LineAtRest, changes: list[Change]) -> float:
    """Least processor time of some marches with their set-up, over the number of steps [us]."""
    times = []
    for _ in range(REPEATS):
        begin = time.process_time()
        n_steps = len(march_with_tangents(COMM, at_rest, changes).force)
        times.append(time.process_time() - begin)
    return 1e6 * min(times) / n_steps


@pytest.mark.parametrize("case", ["ambrosio2012", "ac_simple"])
def test_cost_of_eight_tangents(case: str) -> None:
    scenes = ChangedScenes(load_scene(case))
    at_rest = sound_rest(scenes.scene)
    now = set_up_of(COMM, at_rest)
    alone = us_a_step(at_rest, [])
    print(f"\n{case}: a march without tangents, with its set-up, {alone:.1f} us a step")
    for what, keys in (("of the line", OF_LINE), ("of droppers", DROPPERS)):
        begin = time.process_time()
        changes = [change_by(scenes.parameter(key), scenes, at_rest, now, COMM) for key in keys]
        set_up = 1e3 * (time.process_time() - begin) / len(keys)
        whole = us_a_step(at_rest, changes)
        own = (whole - alone) / len(keys)
        print(f"{what}: {own:.1f} us a step and tangent, {own / alone:.2f} times that, ", end="")
        print(f"{whole / alone:.1f} marches in all; set-ups {set_up:.0f} ms each")
        # Measured: 0.2 to 0.33, and 0.37 to 0.56 in vectors of four; a busy machine takes a quarter
        # longer.
        assert own < 0.72 * alone
