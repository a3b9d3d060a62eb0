"""Runs variants of a case one after the other in this process, each in a folder of its own.

Imports, compiled loops and MPI are started once. What is done already is not run again, so that a
sweep that was killed goes on where it was; a variant that breaks does not stop the others.
"""

from __future__ import annotations

import json
import logging
import time
import zlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from catenary.base.errors import CatenaryError, InputError
from catenary.base.parallel import on_root
from catenary.cases.process.interrupts import Interrupted
from catenary.cases.result_folder.output_folder import (
    check_room_of_runs,
    refuse_earlier,
    refuse_impossible,
)
from catenary.cases.run.planning.needs import Kept, total_size
from catenary.cases.run.runner import RESULT, run_case
from catenary.cases.scene.problem import resolved
from catenary.cases.studies.sweep.jobs import AS_USUAL, Ended, Job, RunOptions
from catenary.postproc.evaluate.wording import fixed
from catenary.postproc.files.disk import plain, write_all
from catenary.postproc.files.own_files import VARIANT_FILE as RECORD
from catenary.postproc.files.run_schema import DONE, INTERRUPTED
from catenary.postproc.read.results import Results

logger = logging.getLogger("catenary.sweep")

_SUM, _SUM_OF_SUMMARY = "crc32", "summary_crc32"
SUMMARY = "summary.json"


def record_text(record: Mapping[str, Any], folder: Path) -> str:
    """A variant's record as the text of its file, of a folder with the figures."""
    content = json.loads(json.dumps(plain(record)))
    content[_SUM_OF_SUMMARY] = zlib.crc32((folder / SUMMARY).read_bytes())
    return json.dumps({**content, _SUM: _sum(content)}, indent=1) + "\n"


def read_record(path: Path) -> dict[str, Any] | None:
    """A variant's record, None if there is none or it is damaged, which is logged."""
    content = _table(path)
    if content is None:
        return None
    known = content.pop(_SUM, None)
    return content if _is_whole(path, known == _sum(content)) else None


def read_summary(path: Path, record: Mapping[str, Any]) -> dict[str, Any] | None:
    """The figures of a record, None if there are none or they are damaged, which is logged."""
    content = _table(path)
    if content is None:
        return None
    same = record.get(_SUM_OF_SUMMARY) in (None, zlib.crc32(path.read_bytes()))  # None: older
    return content if _is_whole(path, same) else None


def _table(path: Path) -> dict[str, Any] | None:
    """A JSON table, None if there is no file or no whole table in it, which is logged."""
    if not path.is_file():  # a pipe would be waited for
        return None
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError:
        return None
    except (ValueError, RecursionError):
        content = None
    return content if _is_whole(path, isinstance(content, dict)) else None


def _is_whole(path: Path, whole: bool) -> bool:
    """Log that a file is damaged, if it is; returns whether it is not."""
    if not whole:
        logger.warning("%s is damaged: its variant is run again", path)
    return whole


def _sum(content: Mapping[str, Any]) -> int:
    return zlib.crc32(json.dumps(content, sort_keys=True).encode())


# What is taken from an open result file beside the summary: plain values by name.
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

    An interruption ends the list early; its last entry says so.

    Parameters
    ----------
    jobs : the same on all ranks
    measure : takes figures from each result file, on rank 0

    Raises
    ------
    InputError
        If ``out_dir`` cannot be written to, or if it or a job's folder holds other results and
        ``options.force`` is not given, or if there is no room for all runs; nothing is run then.
    RunBroken
        If a record of what is done cannot be written.
    """
    earlier = on_root(comm, lambda: _earlier(jobs, out_dir, options.force, measure is not None))
    left = [job for job, found in zip(jobs, earlier, strict=True) if found is None]
    on_root(comm, lambda: _check_room(left, out_dir, options.force))
    ended: list[Ended] = []
    begin, n_left = time.perf_counter(), len(left)
    n_run = 0
    for number, (job, found) in enumerate(zip(jobs, earlier, strict=True), start=1):
        place = f"[{number}/{len(jobs)}] {job.variant.name}"
        if found is not None:
            options.progress(f"{place}: done already")
            ended.append(found)
            continue
        options.progress(place)
        one = _run(job, out_dir / job.variant.name, comm, options, measure)
        ended.append(one)
        if one.outcome == INTERRUPTED:
            break
        n_run += 1
        spent = time.perf_counter() - begin
        ahead = spent / n_run * (n_left - n_run)
        left_of_it = f"{spent:.0f} s gone, about {ahead:.0f} s left"
        options.progress(f"    {_figures(one)}; {left_of_it}")
    return ended


def _run(
    job: Job,
    folder: Path,
    comm: Any,
    options: RunOptions,
    measure: Measure | None,
) -> Ended:
    """Run one job and leave its record. Collective; raises only if that cannot be written."""
    clock = time.perf_counter()
    try:
        result = run_case(
            job.scene,
            folder,
            comm,
            force=True,
            petsc_options=options.petsc,
            only_summary=not job.full_report,
            large=options.force,
        )
        outcome, summary = result.outcome, result.summary
    except Interrupted:
        outcome, summary = INTERRUPTED, {}
    except CatenaryError as error:  # the same on all ranks
        outcome, summary = str(error), {}
    if outcome != DONE:
        return Ended(job.variant, outcome, wall=time.perf_counter() - clock)
    wall = time.perf_counter() - clock
    measured = on_root(comm, lambda: _leave_record(job, folder, measure, wall))
    return Ended(job.variant, DONE, summary, measured, wall)


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
    }
    if not job.keep_results:
        (folder / RESULT).unlink()
    write_all(folder, {RECORD: record_text(record, folder)})
    return measured


def _earlier(jobs: Sequence[Job], out_dir: Path, force: bool, measured: bool) -> list[Ended | None]:
    """What is there of each job: how it ended, None if it is to be run."""
    refuse_impossible(out_dir)
    refuse_earlier(out_dir, force)
    if force:
        return [None] * len(jobs)
    return [_found(job, out_dir / job.variant.name, measured) for job in jobs]


def _check_room(jobs: Sequence[Job], out_dir: Path, force: bool) -> None:
    """Refuse jobs whose files have no room together."""
    size = total_size(Kept(job.scene, job.keep_results, job.full_report) for job in jobs)
    folders = [out_dir / job.variant.name for job in jobs]
    check_room_of_runs(out_dir, folders, size, force)


def _found(job: Job, folder: Path, measured: bool) -> Ended | None:
    wanted = json.loads(json.dumps(plain(resolved(job.scene))))
    record = read_record(folder / RECORD)
    if record is None:
        _refuse_other_run(folder, wanted)
        return None
    if record.get("config") != wanted:
        raise InputError(
            f"{folder} holds the results of {job.variant.name} with another configuration; name "
            "another folder with -o, or give --force to replace them"
        )
    summary = read_summary(folder / SUMMARY, record)
    missing = job.keep_results and not (folder / RESULT).is_file()
    missing = missing or (job.full_report and not (folder / "report.html").is_file())
    if summary is None or missing or (measured and not record.get("measured")):
        return None
    wall = float(record.get("wall_s", 0.0))
    return Ended(job.variant, DONE, summary, record.get("measured", {}), wall, skipped=True)


def _refuse_other_run(folder: Path, wanted: dict[str, Any]) -> None:
    """Refuse to replace a run that no sweep with this configuration has begun."""
    if not (folder / RESULT).exists():
        return
    try:
        with Results(folder) as results:
            same = results.attributes.get("config") == wanted
    except InputError:  # killed before the file was made
        same = True
    if not same:
        raise InputError(
            f"{folder / RESULT} holds the results of another run; name another folder with -o, or "
            "give --force to replace them"
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
