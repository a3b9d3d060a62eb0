"""Everyday questions about a scene: the highest speed, and the distance of two pantographs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from catenary.base.lone_process import alone
from catenary.cases.process.petsc_options import options_of
from catenary.scenes import SceneLike, checked, draft_of

if TYPE_CHECKING:
    import pandas as pd

    from catenary.cases.scene.scene import Scene as Checked
    from catenary.cases.studies.sweep.together import Marching


def highest_speeds(
    scene: SceneLike,
    slowest: float = 200.0,
    fastest: float = 360.0,
    *,
    step: float = 10.0,
    within: float = 1.0,
    criteria: Sequence[str] = (),
    direction: str | None = None,
    jobs: int = 1,
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
    step : float
        Distance of the speeds marched first [km/h]. Narrower stretches may be missed.
    within : float
        How closely ends of stretches are found [km/h].
    criteria : sequence of str
        Parts of names of criteria, all criteria if there are none.
    direction : str
        "forward" or "backward"; None for both, as far as the scene's line can be turned.
    jobs : int
        Processes that march, 0 for one on each core.

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
        If the range is none, if no speed can be run, if no criterion has a wanted name, or if the
        line cannot be turned for the one ``direction``.
    KeyboardInterrupt
        If a signal ended it.

    Examples
    --------
    >>> scene = catenary.load("en50318_2002", short=True)
    >>> table = catenary.highest_speeds(scene, 300, 310, within=5, criteria=["wave speed"])
    >>> float(table.highest_km_h[0]), float(table.fails_at_km_h[0])
    (305.0, 310.0)
    """
    import pandas as pd

    from catenary.cases.studies.questions import highest_speed as question

    speeds = question.Speeds(float(slowest), float(fastest), float(step), float(within))
    with _marching(scene, jobs) as (marching, own):
        found = question.find_speeds(marching, own, speeds, list(criteria), direction)
    return pd.DataFrame(question.table_of_criteria(found).records())


@contextmanager
def _marching(scene: SceneLike, jobs: int) -> Iterator[tuple[Marching, Checked]]:
    """The march of variants of a scene, and the scene itself."""
    own, comm = checked(scene), alone()
    from catenary.cases.process.interrupts import Interrupted
    from catenary.cases.studies.sweep.jobs import RunOptions
    from catenary.cases.studies.sweep.together import Marching

    with options_of(own.petsc.given()) as options:
        plan = RunOptions(petsc=options, n_jobs=jobs)
        try:
            yield Marching(draft_of(scene), None, comm, plan), own
        except Interrupted as stopped:
            raise KeyboardInterrupt from stopped


def separations(
    scene: SceneLike,
    nearest: float = 31.0,
    farthest: float = 400.0,
    *,
    step: float = 1.0,
    jobs: int = 1,
) -> pd.DataFrame:
    """Statistics of two pantographs over their distance, and of one alone.

    Both are of the kind of the scene's first pantograph. The trailing one, or the one alone, starts
    at ``train.start_m``. One process marches them, or ``jobs`` of them: not collective.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        The scene, or whatever ``load`` takes for one; its own pantographs are replaced.
    nearest, farthest, step : float
        Distances [m]: from ``nearest`` on, ``step`` apart, ``farthest`` at most.
    jobs : int
        Processes that march, 0 for one on each core.

    Returns
    -------
    pandas.DataFrame
        A row for one pantograph alone, whose ``separation_m`` is NaN, then one for each distance,
        with the columns of ``separation.csv``.

    Raises
    ------
    InputError
        If the range is none, or if nothing can be run.
    KeyboardInterrupt
        If a signal ended it.

    Examples
    --------
    >>> scene = catenary.load("en50318_2002", short=True)
    >>> table = catenary.separations(scene, 50, 90, step=40)
    >>> table.separation_m.tolist()[1:], bool(table.std_trailing_N[2] > table.std_trailing_N[1])
    ([50.0, 90.0], True)
    """
    import pandas as pd

    from catenary.cases.studies.questions import separation as question

    distances = question.Distances(float(nearest), float(farthest), float(step))
    with _marching(scene, jobs) as (marching, own):
        found = question.find_separations(marching, own, distances)
    return pd.DataFrame(found.table().records())
