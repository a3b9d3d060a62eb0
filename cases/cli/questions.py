"""Verbs for everyday questions: ``speed``, ``separation``, ``what-if`` and ``worst``."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from catenary.base.options import Bounds
from catenary.base.parallel import on_root
from catenary.cases.cli.app import leave, print_findings, serial_verb, verb
from catenary.cases.cli.command_words import OutIfAny, RunFolder, RunWords, StudyRuns, records_of
from catenary.cases.result_folder.output_folder import refuse_impossible, refuse_table
from catenary.cases.studies.asked import Distances, Speeds
from catenary.cases.terminal import console

if TYPE_CHECKING:
    from catenary.cases.scene.load import Draft
    from catenary.cases.scene.scene import Scene
    from catenary.cases.studies.sweep.together import Marching


def _begun(words: RunWords, table: str, out: Path | None, runs: StudyRuns) -> Marching:
    """The march of variants of a case by a question that leaves a ``table`` in the folder ``out``.

    Collective.
    """

    def read() -> tuple[Draft, Scene]:
        refuse_table(out, table, runs.force)
        draft = words.draft()
        return draft, draft.scene()

    comm, (draft, scene), options = runs.begin(read, lambda made: made[1], words.petsc)
    from catenary.cases.studies.sweep.together import Marching

    return Marching(draft, scene, out, comm, options)


class Direction(StrEnum):
    """Direction of the train along the line of the scene."""

    FORWARD = "forward"
    BACKWARD = "backward"


@verb("speed")
def speed(
    words: RunWords,
    speeds: Speeds,
    criterion: list[str] | None = None,
    direction: Direction | None = None,
    out: OutIfAny = None,
    *,
    runs: StudyRuns,
) -> None:
    """Find the highest speed at which the criteria hold.

    They hold if they do in both directions, all together and each by itself: an ensemble over
    speeds, then bisection. The same command continues one that was stopped.

    Example: catenary speed en50318_2002 -o results/highest --from 200 --to 360

    Parameters
    ----------
    criterion : Part of the name of a criterion, such as deviation; repeatable. All if absent.
    direction : The one direction of the train to judge; both if absent, where the line can be
        turned.
    out : Folder for tables and picture; without it nothing is written.
    """
    from catenary.questions import find_speeds

    speeds.first()
    marching, command = _begun(words, "speed.csv", out, runs), f"catenary speed {words.case}"
    found = find_speeds(marching, speeds, criterion or [], direction, command)
    print_findings(found.text, found.files)


@verb("separation")
def separation(
    words: RunWords, distances: Distances, out: OutIfAny = None, *, runs: StudyRuns
) -> None:
    """Find good and bad distances of two pantographs.

    It prints deviation, least force and uplift over the distance, where acceptance criteria fail,
    and which waves explain it. The same command continues one that was stopped.

    Example: catenary separation en50318_2002 -o results/distances --from 50 --to 200 --step 5

    Parameters
    ----------
    out : Folder for table and picture; without it nothing is written.
    """
    from catenary.questions import find_separations

    distances.values()
    marching = _begun(words, "separation.csv", out, runs)
    found = find_separations(marching, distances, f"catenary separation {words.case}")
    print_findings(found.text, found.files)


@verb("what-if")
def what_if(words: RunWords, out: OutIfAny = None, *, runs: StudyRuns) -> None:
    """Run a case with and without changes, and compare them.

    The changes are those of --set; compared are statistics, uplift by support, droppers, verdicts.
    The same command continues runs that were stopped.

    Example: catenary what-if en50318_2002 --set line.contact_wire.tension_N=22000 -o
    results/tension

    Parameters
    ----------
    out : Folder for page, tables, pictures and both runs; none is kept if absent.
    """
    from catenary.callers import given_or_temporary
    from catenary.cases.studies.questions import what_if as question
    from catenary.cases.studies.sweep.jobs import Job

    changes = words.changes

    def read() -> list[Job]:
        jobs = question.jobs_of(words.case, changes, words.shortened)
        refuse_table(out, "what_if.html", runs.force)
        return jobs

    comm, jobs, options = runs.begin(read, lambda jobs: jobs[0].scene, words.petsc)
    from catenary.cases.studies.records import held_study

    with (
        given_or_temporary(out, comm, "what_if") as folder,
        held_study(out, comm, f"catenary what-if {words.case}") as held,
    ):
        ended = question.run(jobs, folder, comm, options)
        found = on_root(comm, lambda: question.differences(changes, ended, folder), takes_long=True)
        files = held.write(lambda: question.files_of(folder, found))
    print_findings(question.as_text(found), files)


@serial_verb("worst")
def worst(
    folder: RunFolder,
    count: Annotated[int, "-n", "--count", Bounds(1, 1000)] = 3,
    out: OutIfAny = None,
) -> None:
    """Name the worst spans, supports and droppers of a run.

    Each has possible causes: defects, elasticity, reflections, ends of wires, the pantograph ahead.

    Example: catenary worst results/en300

    Parameters
    ----------
    count : Places of each kind.
    out : Folder for tables of all places; without it nothing is written.
    """
    records = records_of(folder)
    if out is not None:
        refuse_impossible(out)
    console.alone()  # starts MPI as one process, before anything imports it
    from catenary.cases.studies.questions.worst import answer_of
    from catenary.postproc.read.results import Results

    with Results(folder, records) as results:
        text, tables = answer_of(results, count)
    leave(out, text, lambda: tables)
