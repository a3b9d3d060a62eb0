"""The recorders on any number of ranks, with ranks that own nothing, and failing on one of them.

Run by ``mpirun -n N python -m mpi4py -m pytest tests/mpi/test_recorder_ranks.py``.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest
from mpi4py import MPI

from catenary.postproc import result_file
from catenary.postproc.fields import FieldRecorder
from catenary.postproc.header import REQUIRED_ATTRIBUTES, Header
from catenary.postproc.recorder import Recorder
from catenary.postproc.results import Results
from catenary.postproc.storage import NoRoom
from catenary.solver.errors import RunBroken
from catenary.solver.observation import Stage, StepView

COMM = MPI.COMM_WORLD
N_ARMS, N_DROPPERS, N_NODES, N_STEPS, DT = 7, 23, 60, 130, 1e-3
Share = Callable[[int], np.ndarray]


def in_runs(count: int) -> np.ndarray:
    return np.array_split(np.arange(count), COMM.size)[COMM.rank]


def in_turn(count: int) -> np.ndarray:
    """Interleaved and backwards: nothing may rely on the order of the numbers."""
    return np.arange(count)[COMM.rank :: COMM.size][::-1]


def all_on_the_last(count: int) -> np.ndarray:
    return np.arange(count if COMM.rank == COMM.size - 1 else 0)


SHARES = [in_runs, in_turn, all_on_the_last]


@pytest.fixture
def folder() -> Iterator[Path]:
    """The same folder on all ranks."""
    path = Path(COMM.bcast(tempfile.mkdtemp() if COMM.rank == 0 else None))
    yield path
    COMM.Barrier()
    if COMM.rank == 0:
        shutil.rmtree(path)


def make_header() -> Header | None:
    if COMM.rank:
        return None
    attributes = dict.fromkeys(REQUIRED_ATTRIBUTES, ["made up"])
    return Header(attributes, {"line/support_x": np.arange(3.0)})


def make_stage(share: Share) -> Stage:
    points = np.column_stack([np.arange(N_NODES), np.zeros(N_NODES), np.full(N_NODES, 5.0)])
    return Stage(
        n_pantographs=2,
        dt=DT,
        start_time=0.0,
        n_steps=N_STEPS,
        arm_x=np.arange(N_ARMS, dtype=float),
        dropper_x=np.arange(N_DROPPERS, dtype=float),
        owned_arms=share(N_ARMS),
        owned_droppers=share(N_DROPPERS),
        node_points=points,
        owned_nodes=share(N_NODES),
    )


def make_view(step: int, share: Share) -> StepView:
    on_root = COMM.rank == 0
    two = np.array([1.0, 2.0]) + step
    return StepView(
        step=step,
        time=step * DT,
        contact_position=two,
        contact_force=10 * two if on_root else np.zeros(0),
        head_height=20 * two if on_root else np.zeros(0),
        wire_height=30 * two if on_root else np.zeros(0),
        dropper_force=1000.0 * step + share(N_DROPPERS),
        arm_uplift=-1000.0 * step - share(N_ARMS),
        node_uplift=lambda: 1e-3 * step + share(N_NODES),
        energies=lambda: (COMM.allreduce(1.0), float(step)),
        checkpoint=lambda: checkpoint(step),
    )


def checkpoint(step: int) -> dict | None:
    parts = COMM.gather(COMM.rank, root=0)  # collective, as the solver's is
    return {"step": step, "ranks": np.array(parts)} if COMM.rank == 0 else None


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("flush_every", [1, 40, 500])
def test_all_channels_reach_the_file(folder: Path, share: Share, flush_every: int) -> None:
    recorder = Recorder(
        COMM, folder / "run.h5", make_header(), flush_every=flush_every, energy_every=10
    )
    recorder.start(make_stage(share))
    for step in range(N_STEPS + 1):
        recorder.observe(make_view(step, share))
    recorder.finish("done")
    recorder.close({"march_wall_s": 2.0} if COMM.rank == 0 else None)
    if COMM.rank:
        return
    with h5py.File(folder / "run.h5") as file:
        attributes = dict(file.attrs)
    assert attributes["n_ranks"] == COMM.size and attributes["march_wall_s"] == 2.0
    steps = np.arange(N_STEPS + 1.0)[:, None]
    with Results(folder / "run.h5") as results:
        assert results.outcome == "done"
        np.testing.assert_allclose(results.time, DT * steps[:, 0], rtol=1e-15)
        expected = {
            "contact_position": steps + [1.0, 2.0],
            "contact_force": 10 * (steps + [1.0, 2.0]),
            "head_height": 20 * (steps + [1.0, 2.0]),
            "wire_height": 30 * (steps + [1.0, 2.0]),
            "dropper_force": 1000.0 * steps + np.arange(N_DROPPERS),
            "arm_uplift": -1000.0 * steps - np.arange(N_ARMS),
        }
        for name, values in expected.items():
            np.testing.assert_array_equal(results.channel(name), values, name)
        state = results.checkpoint
        assert state["step"] == N_STEPS
        np.testing.assert_array_equal(state["ranks"], np.arange(COMM.size))
        np.testing.assert_array_equal(results.energies()["kinetic"], np.full(14, float(COMM.size)))


@pytest.mark.parametrize("share", SHARES)
def test_fields_reach_the_file(folder: Path, share: Share) -> None:
    wires = {"contact_wire": np.arange(30), "messenger_wire": np.arange(30, 60)}
    recorder = FieldRecorder(
        COMM,
        folder / "fields.xdmf",
        wires,
        np.array([[35, 5], [45, 15]]),
        every=20,
        snapshots_per_flush=3,
    )
    recorder.start(make_stage(share))
    for step in range(N_STEPS + 1):
        recorder.observe(make_view(step, share))
    recorder.finish("done")
    if COMM.rank:
        return
    with h5py.File(folder / "fields.h5") as file:
        np.testing.assert_allclose(file["times"][...], 0.02 * np.arange(7))
        for number, name in enumerate(sorted(file["uplift"])):
            expected = 0.02 * number + np.arange(N_NODES)
            np.testing.assert_allclose(file["uplift"][name][...], expected, rtol=1e-6)


def test_a_full_disk_on_rank_0_breaks_the_run_on_all_ranks_at_the_same_step(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = Recorder(COMM, folder / "run.h5", make_header(), flush_every=25)
    recorder.start(make_stage(in_runs))

    def full(*_: object) -> None:
        raise NoRoom(28, "No space left on device")

    broken_at = -1
    for step in range(N_STEPS + 1):
        if step == 60 and COMM.rank == 0:
            monkeypatch.setattr(result_file, "reserve", full)
        try:
            recorder.observe(make_view(step, in_runs))
        except RunBroken as error:
            assert "No space left on device" in str(error)
            broken_at = step
            break
    assert COMM.allgather(broken_at) == [74] * COMM.size
    recorder.finish("the disk is full")
    recorder.close({})
    if COMM.rank == 0:
        with Results(folder / "run.h5") as results:
            assert results.n_steps == 74
            assert results.outcome.startswith("writing ")


def test_a_file_that_cannot_be_opened_raises_on_all_ranks(folder: Path) -> None:
    if COMM.rank == 0:
        (folder / "file").write_text("no folder")
    recorder = Recorder(COMM, folder / "file" / "nowhere" / "run.h5", make_header())
    with pytest.raises(RunBroken, match="Not a directory"):
        recorder.start(make_stage(in_runs))


def test_columns_without_an_owner_raise_on_all_ranks(folder: Path) -> None:
    recorder = Recorder(COMM, folder / "run.h5", make_header())
    with pytest.raises((ValueError, RuntimeError), match="each must have one owner"):
        recorder.start(make_stage(lambda count: in_runs(count - 1)))
