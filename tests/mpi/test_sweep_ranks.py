"""A sweep on all ranks: the same figures as on one, every rank knows how each variant ended.

Run by ``mpirun -n N python -m mpi4py -m pytest tests/mpi``.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from mpi4py import MPI
from scenes import TINY_WORDS

from catenary import InputError, RunBroken
from catenary.cases.process.workers import each
from catenary.cases.studies.sweep.jobs import RunOptions, make_jobs
from catenary.cases.studies.sweep.run_jobs import run_jobs
from catenary.cases.studies.sweep.variants import Variant

COMM = MPI.COMM_WORLD
CASE = "en50318_2002"
# Pushes on its droppers at rest, which is found on rank 0 alone.
VARIANTS = (
    Variant("slack", ("line.dropper.pre_sag_mid_mm=-100",)),
    Variant("sound", ()),
)
# Round-off of the parallel solve, as in rank_histories.py.
TOLERANCE = 1e-9


@pytest.fixture
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The folder of rank 0, on all ranks."""
    path = tmp_path_factory.mktemp("sweep") if COMM.rank == 0 else None
    yield COMM.bcast(path, root=0)
    COMM.barrier()


def test_a_sweep_goes_past_a_broken_variant_on_all_ranks(folder: Path) -> None:
    jobs = make_jobs(CASE, VARIANTS, TINY_WORDS)
    slack, sound = run_jobs(jobs, folder, COMM)
    assert "would be slack at rest" in slack.outcome
    assert sound.done
    outcomes = COMM.allgather([slack.outcome, sound.outcome])
    assert outcomes == [outcomes[0]] * COMM.size
    again = run_jobs(jobs[1:], folder, COMM)
    assert again[0].skipped and again[0].summary == sound.summary
    if COMM.rank == 0:
        (alone,) = run_jobs(jobs[1:], folder / "alone", MPI.COMM_SELF)
        here, there = (one.summary["pantographs"][0]["std_N"] for one in (sound, alone))
        print(f"standard deviation: {here:.12g} N on {COMM.size} ranks, {there:.12g} N on one")
        assert abs(here - there) <= TOLERANCE * there


def test_a_refusal_reaches_all_ranks(folder: Path) -> None:
    jobs = make_jobs(CASE, VARIANTS[1:], TINY_WORDS)
    run_jobs(jobs, folder, COMM)
    other = make_jobs(CASE, VARIANTS[1:], [*TINY_WORDS, "contact.stiffness_N_per_m=2e4"])
    with pytest.raises(InputError, match="another configuration"):
        run_jobs(other, folder, COMM)


def test_each_rank_makes_runs_of_its_own(folder: Path) -> None:
    """With -j of as many ranks: the same figures as one after the other, to the last bit."""
    speeds = [f"train.speed_km_h={speed}" for speed in (200, 220, 240, 260)]
    jobs = make_jobs(
        CASE, [Variant(f"v{i}", (speed,)) for i, speed in enumerate(speeds)], TINY_WORDS
    )
    lines: list[str] = []
    options = RunOptions(progress=lines.append, n_jobs=COMM.size)
    ended = run_jobs(jobs[:3], folder, COMM, options)
    assert [one.outcome for one in ended] == ["done"] * 3
    found = COMM.allgather([one.summary["pantographs"] for one in ended])
    assert found == [found[0]] * COMM.size
    if COMM.rank == 0:
        alone = run_jobs(jobs[:3], folder / "alone", MPI.COMM_SELF)
        assert [one.summary["pantographs"] for one in alone] == found[0]
    again = run_jobs(jobs, folder, COMM, options)
    assert [one.skipped for one in again] == [True, True, True, False]


def test_an_error_on_a_rank_reaches_all_when_the_others_are_done(folder: Path) -> None:
    def work(item: int, comm: object) -> int:
        if item == 1:
            raise RunBroken("the disk is full")
        return 2 * item

    found = {one.number: one for one in each(work, range(4), COMM.size, COMM)}
    assert [found[i].value for i in range(4)] == [0, None, 4, 6]
    with pytest.raises(RunBroken, match="the disk is full"):
        found[1].get()


@pytest.mark.skipif(COMM.size == 1, reason="for several ranks")
def test_as_many_runs_at_a_time_as_there_are_ranks_or_one(folder: Path) -> None:
    jobs = make_jobs(CASE, VARIANTS[1:], TINY_WORDS)
    with pytest.raises(InputError, match=f"jobs is {COMM.size + 1} on {COMM.size} ranks"):
        run_jobs(jobs, folder, COMM, RunOptions(n_jobs=COMM.size + 1))
