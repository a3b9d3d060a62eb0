"""Everyday questions about a scene: the highest speed, and the distance of two pantographs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from catenary.base.parallel import on_root
from catenary.base.process import alone
from catenary.callers import ending_as_python, folder_of, listed, n_at_once, number_of, saying
from catenary.cases.process.petsc_options import options_of
from catenary.cases.studies.asked import Distances, Speeds
from catenary.scenes import SceneLike, checked, draft_of, scene_of

if TYPE_CHECKING:
    import pandas as pd

    from catenary.cases.studies.sweep.together import Marching
    from catenary.postproc.report.study_table import StudyTable

_PROGRAM = "a study of a Python program"


def highest_speeds(
    scene: SceneLike,
    slowest: float = Speeds.slowest,
    fastest: float = Speeds.fastest,
    out: str | Path | None = None,
    *,
    step: float = Speeds.step,
    within: float = Speeds.within,
    criteria: str | Iterable[str] = (),
    direction: str | None = None,
    jobs: int = 1,
    force: bool = False,
    progress: bool = False,
) -> pd.DataFrame:
    """Highest speed at which the acceptance criteria hold in both directions, all and each.

    Speeds ``step`` apart are marched side by side, then ends of stretches are bisected. One process
    does so, or ``jobs`` of them: not collective.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        The scene, or whatever ``load`` takes for one; its own speed is replaced.
    slowest, fastest : float
        Range of speeds [km/h].
    out : str or Path, optional
        Folder for the files that ``catenary speed -o`` writes. A search that was
        stopped goes on there.
    step : float
        Distance of the speeds marched first [km/h]. Narrower stretches may be missed.
    within : float
        How closely ends of stretches are found [km/h], at least 0.001.
    criteria : str or sequence of str
        Parts of names of criteria, all criteria if there are none.
    direction : str
        "forward" or "backward"; None for both, as far as the scene's line can be turned.
    jobs : int
        Processes that march, 0 for one on each core.
    force : bool
        Whether results in ``out`` are replaced.
    progress : bool
        Whether what is marched and the time left are shown on standard error.

    Returns
    -------
    pandas.DataFrame
        A row for all criteria together, then one for each, with the columns of ``speed.csv``:
        ``holds_from_km_h``, ``highest_km_h``, and ``fails_at_km_h``, the first speed at which the
        criterion fails going up from there, NaN at the end of the range; ``direction`` is the one
        that fails there, or "both".

    Raises
    ------
    InputError
        If the range is invalid, if no speed can be run, if no criterion has a wanted name, if the
        line cannot be turned for the one ``direction``, or if ``out`` cannot be taken.
    KeyboardInterrupt
        If a signal ended it. With ``out`` the same call goes on.

    Examples
    --------
    >>> scene = catenary.load("en50318_2002", short=True)
    >>> table = catenary.highest_speeds(scene, 300, 310, within=5, criteria=["wave speed"])
    >>> float(table.highest_km_h[0]), float(table.fails_at_km_h[0])
    (305.0, 310.0)
    """
    import pandas as pd

    from catenary.cases.studies.questions.highest_speed import TABLE

    speeds = Speeds(
        number_of(slowest, "slowest"),
        number_of(fastest, "fastest"),
        number_of(step, "step"),
        number_of(within, "within"),
    )
    names = listed(criteria, "criteria")
    speeds.first()
    with _marching(scene, out, TABLE, jobs, force, progress) as marching:
        found = find_speeds(marching, speeds, names, direction)
    return pd.DataFrame(found.table.records())


def separations(
    scene: SceneLike,
    nearest: float = Distances.nearest,
    farthest: float = Distances.farthest,
    out: str | Path | None = None,
    *,
    step: float = Distances.step,
    jobs: int = 1,
    force: bool = False,
    progress: bool = False,
) -> pd.DataFrame:
    """Statistics of two pantographs over their distance, and of one alone.

    Both are of the kind of the scene's first pantograph. The trailing one, or the one alone, starts
    at ``train.start_m``. One process marches them, or ``jobs`` of them: not collective.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        The scene, or whatever ``load`` takes for one; its own pantographs are replaced.
    nearest, farthest, step : float
        Distances [m]: from ``nearest`` on, ``step`` apart, at least 0.001, ``farthest`` at most.
    out : str or Path, optional
        Folder for the files that ``catenary separation -o`` writes. Marches that were
        stopped go on there.
    jobs, force, progress
        As for ``highest_speeds``.

    Returns
    -------
    pandas.DataFrame
        A row for one pantograph alone, whose ``separation_m`` is NaN, then one for each distance,
        with the columns of ``separation.csv``.

    Raises
    ------
    InputError
        If the range is invalid, if nothing can be run, or if ``out`` cannot be taken.
    KeyboardInterrupt
        If a signal ended it. With ``out`` the same call goes on.

    Examples
    --------
    >>> scene = catenary.load("en50318_2002", short=True)
    >>> table = catenary.separations(scene, 50, 90, step=40)
    >>> table.separation_m.tolist()[1:], bool(table.std_trailing_N[2] > table.std_trailing_N[1])
    ([50.0, 90.0], True)
    """
    import pandas as pd

    from catenary.cases.studies.questions.separation import TABLE

    distances = Distances(
        number_of(nearest, "nearest"), number_of(farthest, "farthest"), number_of(step, "step")
    )
    distances.values()
    with _marching(scene, out, TABLE, jobs, force, progress) as marching:
        found = find_separations(marching, distances, explained=out is not None)
    return pd.DataFrame(found.table.records())


@contextmanager
def _marching(
    scene: SceneLike, out: str | Path | None, table: str, jobs: int, force: bool, progress: bool
) -> Iterator[Marching]:
    """The march of variants of a scene by a question that leaves a ``table`` in ``out``."""
    from catenary.cases.result_folder.output_folder import refuse_table

    n_jobs, folder = n_at_once(jobs), folder_of(out)
    refuse_table(folder, table, force)
    given = scene_of(scene)
    own, comm = checked(given), alone()
    from catenary.cases.studies.sweep.jobs import RunOptions
    from catenary.cases.studies.sweep.together import Marching

    with options_of(own.petsc.given()) as petsc, ending_as_python():
        options = RunOptions(force, petsc, saying(progress), n_jobs)
        yield Marching(draft_of(given), own, folder, comm, options)


def find_speeds(
    marching: Marching,
    speeds: Speeds,
    criteria: Sequence[str],
    direction: str | None,
    command: str = _PROGRAM,
) -> Answer:
    """Find the highest speeds, and write files if the marches have a folder.

    ``command`` says to others that want the folder what this process does; all else, and errors,
    are those of ``cases.studies.questions.highest_speed.find_speeds``. Collective.
    """
    from catenary.cases.studies.questions import highest_speed as question
    from catenary.cases.studies.records import held_study

    with held_study(marching.out, marching.comm, command) as held:
        found = question.find_speeds(marching, speeds, list(criteria), direction)
        files = held.write(lambda: question.files_of(found))
    return Answer(question.as_text(found), question.table_of_criteria(found), files)


def find_separations(
    marching: Marching, distances: Distances, command: str = _PROGRAM, *, explained: bool = True
) -> Answer:
    """March the distances of two pantographs, and write files if the marches have a folder.

    As ``find_speeds``. Text and files say which waves explain the distances, for which the line is
    hung once more; without ``explained`` there are none. Collective.
    """
    from catenary.cases.studies.questions import separation as question
    from catenary.cases.studies.records import held_study

    comm = marching.comm
    with held_study(marching.out, comm, command) as held:
        found = question.find_separations(marching, distances)
        if not explained:
            return Answer("", found.table(), [])
        scene = marching.scene
        period = on_root(comm, lambda: question.period_in(found, scene), takes_long=True)
        files = held.write(lambda: question.files_of(found, period))
    return Answer(question.as_text(found, period), found.table(), files)


class Answer(NamedTuple):
    """Answer to a question: what the program prints, the table that Python gets, files with it."""

    text: str
    table: StudyTable
    files: list[Path]
