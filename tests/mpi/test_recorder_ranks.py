"""The recorders on any number of ranks, with ranks that own nothing, and failing on one of them.

Run by ``mpirun -n N python -m mpi4py -m pytest tests/mpi/test_recorder_ranks.py``.
"""

from __future__ import annotations

import runpy
import shutil
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from mpi4py import MPI

from catenary import RunBroken
from catenary.postproc.files import result_file
from catenary.postproc.files.disk import NoRoom
from catenary.postproc.files.header import Header, LineRecord
from catenary.postproc.read.results import Results
from catenary.postproc.record.recorder import Recorder
from catenary.postproc.record.snapshots.contents import Course, FieldRecord
from catenary.postproc.record.snapshots.fields import FieldRecorder
from catenary.solver.time_loop.views.channels import TrainLayout
from catenary.solver.time_loop.views.observers import NodeMotion, Stage, StepView

COMM = MPI.COMM_WORLD
N_STEPS, DT = 130, 1e-3
# A line whose head of a file is sound, as the unit tests of the recorders have it.
CONFTEST = runpy.run_path(str(Path(__file__).parents[1] / "unit/postproc/conftest.py"))
MARCH, row_of = CONFTEST["March"](n_steps=N_STEPS, dt=DT, comm=COMM), CONFTEST["row_of"]
N_ARMS, N_DROPPERS, N_NODES = MARCH.arm_x.size, MARCH.dropper_x.size, MARCH.mesh.n_nodes
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
    header: Header = MARCH.header()
    return header


def make_stage(share: Share) -> Stage:
    return Stage(
        train=TrainLayout((1, 1)),
        dt=DT,
        start_time=0.0,
        n_steps=N_STEPS,
        arm_x=MARCH.arm_x,
        dropper_x=MARCH.dropper_x,
        owned_arms=share(N_ARMS),
        owned_droppers=share(N_DROPPERS),
        node_points=MARCH.mesh.points,
        owned_nodes=share(N_NODES),
    )


def make_view(step: int, share: Share) -> StepView:
    on_root = COMM.rank == 0
    two = np.array([1.0, 2.0]) + step
    row, columns = row_of(
        {
            "contact_position": two,
            "contact_force": 10 * two if on_root else np.zeros(0),
            "head_height": 0.02 * two if on_root else np.zeros(0),
            "wire_height": 0.03 * two if on_root else np.zeros(0),
            "dropper_force": 1000.0 * step + share(N_DROPPERS),
            "arm_uplift": -0.01 * step - share(N_ARMS),
        }
    )
    return StepView(
        step=step,
        time=step * DT,
        row=row,
        columns=columns,
        node_motion=lambda name, rate, among=slice(None): (
            1e-3 * step + (2.0 if rate else 1.0) * share(N_NODES)[among]
        ),
        wire_tension=lambda: 10.0 * step + np.arange(N_NODES),
        pantograph_places=lambda: np.zeros(0),
        line_state=dict,
        energies=lambda: (COMM.allreduce(1.0), float(step)),
        state=lambda: checkpoint(step),
    )


def checkpoint(step: int) -> dict | None:
    parts = COMM.gather(COMM.rank, root=0)  # collective, as the solver's is
    return {"step": step, "ranks": np.array(parts)} if COMM.rank == 0 else None


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("flush_every", [pytest.param(1, marks=pytest.mark.study), 40, 500])
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
            "head_height": 0.02 * (steps + [1.0, 2.0]),
            "wire_height": 0.03 * (steps + [1.0, 2.0]),
            "dropper_force": 1000.0 * steps + np.arange(N_DROPPERS),
            "arm_uplift": -0.01 * steps - np.arange(N_ARMS),
        }
        for name, values in expected.items():
            np.testing.assert_array_equal(results.channel(name), values, name)
        state = results.checkpoint
        assert state["step"] == N_STEPS
        np.testing.assert_array_equal(state["ranks"], np.arange(COMM.size))
        np.testing.assert_array_equal(results.energies()["kinetic"], np.full(14, float(COMM.size)))


@pytest.mark.parametrize("share", SHARES)
def test_a_part_of_the_line_and_its_extremes_reach_the_file(folder: Path, share: Share) -> None:
    """Every third step of some droppers in a window; broken at step 100, restarted at step 79."""
    record = LineRecord(every=3, window=(30.0, 90.0), stretch=(25.0, 180.0))
    for first, last in ((0, 100), (79, N_STEPS)):
        recorder = Recorder(
            COMM, folder / "run.h5", make_header(), flush_every=40, record=record, resume=first > 0
        )
        recorder.start(replace(make_stage(share), start_time=first * DT))
        for step in range(first, last + 1):
            recorder.observe(make_view(step, share))
        recorder.finish("done" if last == N_STEPS else "broken")
        recorder.close({})
    if COMM.rank:
        return
    steps, x = np.arange(0, N_STEPS + 1, 3.0)[:, None], MARCH.dropper_x
    inside = (x >= steps + 1.0 - 30.0) & (x <= steps + 2.0 + 90.0) & (x >= 25) & (x <= 180)
    assert inside.any(axis=0).sum() > 20 and not inside.all(axis=1).any()
    droppers, arms = np.arange(N_DROPPERS), np.arange(N_ARMS)
    with Results(folder / "run.h5") as results:
        np.testing.assert_allclose(results.line_time, DT * steps[:, 0])
        expected = np.where(inside, 1000.0 * steps + droppers, np.nan)
        np.testing.assert_array_equal(results.channel("dropper_force"), expected)
        # Of every step and column: those of step 0 and of the last one.
        np.testing.assert_array_equal(
            results.extremes("dropper_force"), [droppers, 1000.0 * N_STEPS + droppers]
        )
        np.testing.assert_array_equal(
            results.extremes("arm_uplift"), [-0.01 * N_STEPS - arms, -arms]
        )


@pytest.mark.parametrize("share", SHARES)
def test_fields_reach_the_file(folder: Path, share: Share) -> None:
    wires = {"contact_wire": np.arange(30), "messenger_wire": np.arange(30, 60)}
    recorder = FieldRecorder(
        COMM,
        folder / "fields.xdmf",
        MARCH.recorded._replace(mesh=replace(MARCH.mesh, wires=wires)),
        every=20,
        record=FieldRecord(("uplift", "velocity", "tension")),
    )
    recorder.most_kept = 3
    recorder.start(make_stage(share))
    for step in range(N_STEPS + 1):
        recorder.observe(make_view(step, share))
    recorder.finish("done")
    if COMM.rank:
        return
    with h5py.File(folder / "fields.h5") as file:
        np.testing.assert_allclose(file["times"][...], 0.02 * np.arange(7))
        for name, nodes in wires.items():
            uplift, tension = (file[f"{name}/{kind}"][:].reshape(7, -1) for kind in
                               ("uplift", "tension"))  # fmt: skip
            velocity = file[f"{name}/velocity"][:].reshape(7, -1, 3)
            number = np.arange(7)[:, None]
            np.testing.assert_allclose(uplift, 0.02 * number + nodes, rtol=1e-6)
            np.testing.assert_allclose(velocity[..., 2], 0.02 * number + 2 * nodes, rtol=1e-6)
            np.testing.assert_allclose(tension, 200.0 * number + nodes, rtol=1e-6)


@pytest.mark.parametrize("share", SHARES)
def test_a_window_gathers_what_it_shows(folder: Path, share: Share) -> None:
    """It moves on by a fifth of the wire; what no snapshot of a flush shows is not asked for."""
    nodes, asked = np.arange(30), 0
    x = MARCH.mesh.points[nodes, 0]
    course = Course(x[5], x[5], (x[11] - x[5]) / (N_STEPS * DT))
    recorder = FieldRecorder(
        COMM,
        folder / "fields.xdmf",
        MARCH.recorded._replace(mesh=replace(MARCH.mesh, wires={"contact_wire": nodes})),
        every=20,
        record=FieldRecord(
            ("uplift", "velocity"), ("contact_wire",), window=(4.0, 6.0), course=course
        ),
    )
    recorder.most_kept = 3
    recorder.start(make_stage(share))
    for step in range(N_STEPS + 1):
        view = make_view(step, share)
        motion = view.node_motion

        def counted(*what: object, motion: NodeMotion = motion) -> np.ndarray:
            nonlocal asked
            found = motion(*what)  # type: ignore[arg-type]
            asked += found.size
            return found

        view.node_motion = counted
        recorder.observe(view)
    recorder.finish("done")
    asked = COMM.allreduce(asked)
    if COMM.rank:
        return
    with h5py.File(folder / "fields.h5") as file:
        group = file["contact_wire"]
        first, count = group["first"][:], group["count"][:]
        uplift = np.split(group["uplift"][:], np.cumsum(count)[:-1])
        for number, values in enumerate(uplift):
            shown = np.arange(first[number], first[number] + count[number])
            np.testing.assert_allclose(values, 0.02 * number + shown, rtol=1e-6)
    assert first[-1] > first[0]
    # Two motions of seven snapshots, of far fewer nodes than the line has.
    assert 2 * count.sum() <= asked < 2 * 7 * 25


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
