"""Cost of scenes side by side: processor time a step and scene, in lanes and in a march alone."""

from __future__ import annotations

import time

import pytest
from mpi4py import MPI
from scenes import load_scene

from catenary.cases.run.at_rest import sound_rest
from catenary.solver.ensemble import SceneHistory, SharedLine, march_side_by_side
from catenary.solver.kernels import native
from catenary.solver.kernels.flush_to_zero import flushed
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.time_loop.compiled_steps import CompiledSteps
from catenary.solver.time_loop.march import March

ROUNDS = 3


def alone(at_rest: LineAtRest) -> float:
    """Time of a march's steps [us a step]."""
    with March(MPI.COMM_SELF, *at_rest) as march, flushed():
        steps, step = CompiledSteps(*march.in_loop(), shows=True), 0
        begin = time.process_time()
        while step < march.n_steps:
            left = march.n_steps - step
            steps.take(step, min(steps.most, left), left)
            step += steps.taken
        return 1e6 * (time.process_time() - begin) / march.n_steps


def in_lanes(shared: SharedLine, at_rest: LineAtRest) -> float:
    """Time of a scene in each lane, with its train's set-up [us a step and scene]."""
    n = len(shared.lanes)
    begin = time.process_time()
    marched = list(march_side_by_side(shared, ((number, at_rest) for number in range(n))))
    taken = time.process_time() - begin
    return 1e6 * taken / sum(one.n_steps for one in marched if isinstance(one, SceneHistory))


@pytest.mark.parametrize("case", ["ambrosio2012", "ac_simple", "re330_stitched"])
def test_cost_of_a_step_in_lanes(case: str) -> None:
    at_rest = sound_rest(load_scene(case))
    whole = (-1e9, 1e9)
    *_, best = native.targets()
    print()
    try:
        for target in native.targets()[1:]:
            native.set_target(target)
            shared = SharedLine(at_rest, whole, 8)
            times = [(alone(at_rest), in_lanes(shared, at_rest)) for _ in range(ROUNDS)]
            single, lane = (min(of) for of in zip(*times, strict=True))
            print(f"{case}, {target}: alone {single:.1f} us a step, in {len(shared.lanes)} lanes "
                  f"{lane:.1f} us a step and scene, {lane / single:.2f} of it")  # fmt: skip
            shared.destroy()
            # Lanes take 0.43 to 0.9 of the time; a busy machine takes a quarter longer.
            assert lane < 1.15 * single
    finally:
        native.set_target(best)
