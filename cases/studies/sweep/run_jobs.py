"""Runs variants of a case, each in a folder of its own: in this process, or some at the same time.

Imports and MPI are started once in each process. What is done already is not run again, so that a
sweep that was killed goes on where it was; a variant that breaks, or whose process is killed, does
not stop the others.
"""

from __future__ import annotations

import json
import time
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from catenary.base.errors import CatenaryError, InputError
from catenary.base.files import is_file, is_there
from catenary.base.parallel import on_root
from catenary.cases.process.interrupts import Interrupted
from catenary.cases.process.petsc_options import idle_names, look_up_all_but, start_petsc
from catenary.cases.process.workers import Outcome, WorkerLost, at_once, each
from catenary.cases.result_folder.output_folder import (
    another_folder,
    check_room_of_runs,
    force_option,
    refuse_earlier,
    refuse_impossible,
)
from catenary.cases.run.needs import Kept, total_size
from catenary.cases.run.runner import run_case
from catenary.cases.scene.scene import resolved
from catenary.cases.studies.records import is_whole, read_record, read_table, write_record
from catenary.cases.studies.sweep.jobs import AS_USUAL, Ended, Job, RunOptions
from catenary.cases.terminal.terminal_text import RunsBar
from catenary.postproc.evaluate.wording import duration, fixed
from catenary.postproc.files.disk import plain
from catenary.postproc.files.own_files import RUN_FILE
from catenary.postproc.files.own_files import VARIANT_FILE as RECORD
from catenary.postproc.files.run_schema import DONE, INTERRUPTED
from catenary.postproc.read.results import Results

_SUM_OF_SUMMARY = "summary_crc32"
SUMMARY = "summary.json"


def read_summary(path: Path, record: Mapping[str, Any]) -> dict[str, Any] | None:
    """The figures of a record, None if there are none or they are damaged, which is logged."""
    content = read_table(path)
    if content is None:
        return None
    same = record.get(_SUM_OF_SUMMARY) in (None, zlib.crc32(path.read_bytes()))  # None: older
    return content if is_whole(path, same) else None


# Function that takes plain values by name from an open result file, beside the summary.
Measure = Callable[[Results], dict[str, Any]]


def run_jobs(
    jobs: Sequence[Job],
    out_dir: Path,
    comm: Any,
    options: RunOptions = AS_USUAL,
    *,
    measure: Measure | None = None,
) -> list[Ended]:
    """Run what is not done yet, each job in ``out_dir/<name>``. Collective.

    After an interruption the list lacks the jobs that it ended and those that had not begun; its
    last entry is the interruption.

    Parameters
    ----------
    jobs : the same on all ranks
    out_dir : folder of all runs
    measure : takes figures from each result file, on rank 0; it can be pickled if
        ``options.n_jobs`` is not 1

    Raises
    ------
    InputError
        If ``out_dir`` cannot be written to, if it or a job's folder holds other results and
        ``options.force`` is not given, if the disk has no room for all runs, or if
        ``options.n_jobs`` does not suit the number of ranks; nothing is run then.
    RunBroken
        If the record of a finished run cannot be written.
    """
    n_at_once = at_once(options.n_jobs, comm)
    earlier = on_root(comm, lambda: _earlier(jobs, out_dir, options.force, measure is not None))
    left = [number for number, found in enumerate(earlier) if found is None]

    def check_room() -> None:
        kept = [Kept(jobs[i].scene, jobs[i].keep_results, jobs[i].full_report) for i in left]
        folders = [out_dir / jobs[i].variant.name for i in left]
        check_room_of_runs(out_dir, folders, total_size(kept, n_at_once), options.force)

    on_root(comm, check_room)
    ended = {number: found for number, found in enumerate(earlier) if found is not None}
    places = [f"[{i}/{len(jobs)}] {job.variant.name}" for i, job in enumerate(jobs, start=1)]
    several = n_at_once > 1
    shows = several and comm.size == 1  # on ranks the first one shows what it does itself
    work = _Work(out_dir, options.petsc, options.force, measure)
    begin = time.perf_counter()
    with ExitStack() as stack:
        bar = stack.enter_context(RunsBar(len(left) if shows else 0, options.progress))

        def begun() -> Iterator[Job]:
            for job, place, found in zip(jobs, places, earlier, strict=True):
                if found is not None:
                    bar.say(f"{place}: done already")
                    continue
                if not several:
                    bar.say(place)
                yield job

        petsc = partial(start_petsc, list(options.petsc))
        outcomes = stack.enter_context(closing(each(work, begun(), n_at_once, comm, petsc)))
        for n_run, outcome in enumerate(outcomes, start=1):
            number = left[outcome.number]
            one = ended[number] = _ended(jobs[number], outcome)
            if one.outcome == INTERRUPTED:
                if not several:
                    break
                continue
            spent = time.perf_counter() - begin
            ahead = spent / n_run * (len(left) - n_run)
            place = f"{places[number]}:" if several else "   "
            bar.ended()
            remaining = f", about {duration(ahead)} left" if n_run < len(left) else ""
            bar.say(f"{place} {_figures(one)}; {duration(spent)} gone{remaining}")
    came = {number: one for number, one in sorted(ended.items()) if one.outcome != INTERRUPTED}
    missing = [job for number, job in enumerate(jobs) if number not in came]
    return [*came.values(), *(Ended(job.variant, INTERRUPTED) for job in missing[:1])]


@dataclass(frozen=True)
class _Work:
    """Makes a run; goes to the processes that make some."""

    out_dir: Path
    petsc: Sequence[str]
    force: bool
    measure: Measure | None

    def __call__(self, job: Job, comm: Any) -> tuple[Ended, set[str]]:
        """Outcome of the run, and options that PETSc never looked up. Collective."""
        return self._run(job, self.out_dir / job.variant.name, comm), idle_names()

    def _run(self, job: Job, folder: Path, comm: Any) -> Ended:
        """Run one job and leave its record. Collective; raises only if that cannot be written."""
        clock = time.perf_counter()
        try:
            result = run_case(
                job.scene,
                folder,
                comm,
                force=True,
                petsc_options=self.petsc,
                only_summary=not job.full_report,
                large=self.force,
            )
            outcome, summary = result.outcome, result.summary
        except Interrupted:
            outcome, summary = INTERRUPTED, {}
        except CatenaryError as error:  # the same on all ranks
            outcome, summary = str(error), {}
        wall = time.perf_counter() - clock
        if outcome != DONE:
            return Ended(job.variant, outcome, wall=wall)
        measured = on_root(comm, lambda: _leave_record(job, folder, self.measure, wall))
        return Ended(job.variant, DONE, summary, measured, wall)


def as_json(table: Mapping[str, Any]) -> dict[str, Any]:
    """A table as JSON gives it back."""
    content: dict[str, Any] = json.loads(json.dumps(plain(table)))
    return content


def _ended(job: Job, outcome: Outcome) -> Ended:
    """Outcome of a run; raises an error that is not the run's alone, such as a full disk."""
    if isinstance(outcome.error, WorkerLost):
        return Ended(job.variant, str(outcome.error))
    ended, idle = outcome.get()
    look_up_all_but(idle)  # as its process did, whichever it was
    return ended


def _leave_record(job: Job, folder: Path, measure: Measure | None, wall: float) -> dict[str, Any]:
    """Take the measures and write the record by which a later sweep skips this run."""
    measured: dict[str, Any] = {}
    if measure is not None:
        with Results(folder) as results:
            measured = plain(measure(results))
    record = {
        "variant": job.variant.name,
        "assignments": job.variant.assignments,
        "config": resolved(job.scene),
        "wall_s": wall,
        "measured": measured,
        _SUM_OF_SUMMARY: zlib.crc32((folder / SUMMARY).read_bytes()),
    }
    if not job.keep_results:
        (folder / RUN_FILE).unlink()
    write_record(folder / RECORD, as_json(record))
    return measured


def _earlier(jobs: Sequence[Job], out_dir: Path, force: bool, measured: bool) -> list[Ended | None]:
    """Earlier outcome of each job, None if it is to be run."""
    refuse_impossible(out_dir)
    refuse_earlier(out_dir, force)
    if force:
        return [None] * len(jobs)
    return [_found(job, out_dir / job.variant.name, measured) for job in jobs]


def _found(job: Job, folder: Path, measured: bool) -> Ended | None:
    wanted = as_json(resolved(job.scene))
    record = read_record(folder / RECORD)
    if record is None:
        _refuse_other_run(folder, wanted)
        return None
    if record.get("config") != wanted:
        raise InputError(
            f"{folder} holds the results of {job.variant.name} with another configuration; "
            f"{another_folder()}, or give {force_option()} to replace them"
        )
    summary = read_summary(folder / SUMMARY, record)
    missing = job.keep_results and not is_file(folder / RUN_FILE)
    missing = missing or (job.full_report and not is_file(folder / "report.html"))
    if summary is None or missing or (measured and not record.get("measured")):
        return None
    wall = float(record.get("wall_s", 0.0))
    return Ended(job.variant, DONE, summary, record.get("measured", {}), wall, skipped=True)


def _refuse_other_run(folder: Path, wanted: dict[str, Any]) -> None:
    """Refuse to replace a run that no sweep with this configuration has begun."""
    if not is_there(folder / RUN_FILE):
        return
    try:
        with Results(folder) as results:
            same = results.attributes.get("config") == wanted
    except InputError:  # killed before the file was made
        same = True
    if not same:
        raise InputError(
            f"{folder / RUN_FILE} holds the results of another run; {another_folder()}, or "
            f"give {force_option()} to replace them"
        )


def _figures(ended: Ended) -> str:
    """The most important figures of a variant, or what broke."""
    if not ended.done:
        return f"BROKE: {ended.outcome}"
    parts = []
    for one in ended.summary["pantographs"]:
        if one["std_N"] is None:
            parts.append("no statistics")
        else:
            parts.append(f"{one['name']} {fixed(one['mean_N'], 1)} +- {fixed(one['std_N'], 1)} N")
    return ", ".join(parts)
