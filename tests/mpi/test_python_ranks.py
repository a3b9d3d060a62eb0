"""Runs and sweeps of a Python program on 1, 2 and 3 ranks: the same answers, on all of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from program import SHORT_SCENE
from scenes import with_words

import catenary

pytestmark = pytest.mark.timeout(250)

COMM = MPI.COMM_WORLD
# Round-off of a solve, 1e-16, over 1e4 steps of a damped line; see rank_histories.py.
SAME = 1e-9


@pytest.fixture(scope="module")
def scene() -> catenary.Scene:
    """With steps of 4 ms, some five hundred."""
    return with_words("en50318_2002", (*SHORT_SCENE, "numerics.dt_s=4e-3"))


def agree(value: Any) -> bool:
    """Whether all ranks have the same. Collective."""
    values = COMM.allgather(value)
    return all(one == values[0] for one in values)


def test_all_ranks_have_the_results_of_all(scene: catenary.Scene) -> None:
    run = catenary.run(scene)
    assert run.summary["n_ranks"] == COMM.size and run.outcome == "done"
    assert agree(run.force.values.tobytes()) and agree(run.summary["pantographs"])
    alone = catenary.run(scene, comm=MPI.COMM_SELF)
    assert alone.summary["n_ranks"] == 1
    for name in ("contact_force", "arm_uplift", "dropper_force"):
        found, expected = run.channel(name), alone.channel(name)
        assert float(np.abs(found - expected).max()) < SAME * float(np.abs(expected).max())


def test_a_sweep_is_shared(scene: catenary.Scene) -> None:
    table = catenary.sweep(scene, {"train.end_m": [243.0, 250.0]})
    assert agree(table.to_json()) and table.outcome.tolist() == ["done", "done"]


def test_all_ranks_are_told_what_is_wrong(scene: catenary.Scene) -> None:
    loose = {"line.dropper.pre_sag_mid_mm": 900.0, "case.accept_unusual": True}
    with pytest.raises(catenary.InputError, match="slack") as found:
        catenary.run(scene.replace(loose))
    assert agree(str(found.value))


@pytest.mark.skipif(COMM.size == 1, reason="one process agrees with itself")
def test_processes_that_differ_are_told_so(scene: catenary.Scene, tmp_path: Path) -> None:
    """A study that takes ``run`` for a function of one process waited without end, or mixed two."""
    own = scene.replace(train={"speed_km_h": 240 + COMM.rank})
    ends = [243.0 + COMM.rank]
    for call in (
        lambda: catenary.run(own),
        lambda: catenary.run(scene, tmp_path / str(COMM.rank)),
        lambda: catenary.restart(tmp_path / str(COMM.rank)),
        lambda: catenary.sweep(own, {"train.end_m": [243.0]}),
        lambda: catenary.sweep(scene, {"train.end_m": ends}),
    ):
        with pytest.raises(catenary.InputError, match="give all the same, or comm=MPI.COMM_SELF"):
            call()
    assert catenary.run(own, comm=MPI.COMM_SELF).scene["train.speed_km_h"] == 240 + COMM.rank


def test_each_rank_may_ask_for_itself(scene: catenary.Scene, tmp_path: Path) -> None:
    """Functions that are not collective, with a folder of each rank."""
    folder = tmp_path / str(COMM.rank)
    found = catenary.highest_speeds(scene, 240, 250, folder, within=10, criteria="wave speed")
    assert agree(found.to_json()) and found.highest_km_h.tolist() == [250.0, 250.0]
    assert (folder / "speed.csv").is_file()


def test_each_rank_steps_a_line_of_its_own(scene: catenary.Scene) -> None:
    with catenary.Simulation(scene) as sim:
        sim.lift_force = 5.0 * COMM.rank
        sim.step(300)
        forces = COMM.allgather(float(sim.contact_force[0]))
    assert len(set(forces)) == COMM.size
