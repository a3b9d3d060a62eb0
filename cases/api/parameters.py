"""Parameters of a scene: derivatives of statistics by them, and their values from measurement."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from catenary.base.process import alone
from catenary.callers import listed, path_of, progress_shown, saying
from catenary.postproc.evaluate.wording import counted
from catenary.scenes import Scene, SceneLike, checked, scene_of, tables_or_file

if TYPE_CHECKING:
    import pandas as pd

    from catenary.cases.studies.parameters.identification import Identification
    from catenary.cases.studies.parameters.measurement import Task
    from catenary.postproc.report.study_table import Content, StudyTable

SENSITIVITIES, AT_REST = "sensitivity.csv", "sensitivity_at_rest.csv"


def sensitivity(
    scene: SceneLike,
    parameters: str | Iterable[str] = (),
    *,
    droppers: bool = False,
    progress: bool = False,
) -> pd.DataFrame:
    """Sensitivities of the statistics of a scene to its parameters, from one march.

    The march is differentiated step by step: these are no differences of runs. Derivatives hold
    while a change moves no loss of contact and no slackening of a dropper to another step. One
    process computes them, under mpirun too: not collective.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        The scene, or whatever ``load`` takes for one.
    parameters : str or sequence of str
        Keys of numbers, or of lists whose entries change together; with the number of an entry
        behind it (``line.dropper.pre_sag_mm.3``) that one alone. Those of pantographs, contact,
        wires, droppers and damping if there are none.
    droppers : bool
        Whether the length of each dropper in the evaluated stretch is a parameter, too: how many
        millimetres it is too long.
    progress : bool
        Whether a terminal shows a bar on standard error.

    Returns
    -------
    pandas.DataFrame
        A row for each parameter and pantograph, with the columns of ``sensitivity.csv``; first what
        changes the standard deviation most. Changes are those under ``change`` of the parameter, in
        the ``unit`` of its key. ``table.attrs["left_out"]`` has sentences on usual parameters by
        which the march has no derivative.

    Raises
    ------
    InputError
        If a key is wrong, or if the march or a parameter has no derivatives (``docs/guide/
        sensitivities.md`` lists them).
    RunBroken
        If the march breaks.

    Examples
    --------
    >>> scene = catenary.load("en50318_2002", short=True)
    >>> table = catenary.sensitivity(scene, ["pantographs.reference.static_force_N"])
    >>> row = table.iloc[0]
    >>> row.change, row.unit, bool(0.9 < row.mean_change_N < 1.1)
    (1.0, 'N', True)
    """
    names = listed(parameters, "parameters")
    return derivatives(scene, names, droppers=droppers, progress=progress).table()


def derivatives(
    scene: SceneLike,
    parameters: Sequence[str] = (),
    *,
    droppers: bool = False,
    progress: bool = False,
) -> Derivatives:
    """Differentiate a march, for ``sensitivity`` and its verb, with its errors. Not collective."""
    own, comm = checked(scene), alone()  # starts MPI as one process, before anything imports it
    from catenary.cases.studies.parameters.derivatives import as_text, sensitivity_of, table_of

    with progress_shown(progress, comm):
        found = sensitivity_of(own, list(parameters), comm, droppers=droppers, shows=progress)
    return Derivatives(as_text(found), table_of(found), SENSITIVITIES, found.left_out)


def rest_derivatives(
    scene: SceneLike, parameters: Sequence[str] = (), *, droppers: bool = False
) -> Derivatives:
    """Differentiate a line at rest, for the verb; as ``AtRest.sensitivity``. Not collective."""
    from catenary.cases.studies.parameters.derivatives import (
        along_span,
        rest_sensitivity_of,
        rest_text,
    )

    found = rest_sensitivity_of(checked(scene), parameters, droppers=droppers)
    return Derivatives(rest_text(found), along_span(found), AT_REST, found.left_out)


class Derivatives(NamedTuple):
    """Derivatives of the statistics of a scene, or of its line at rest.

    Attributes
    ----------
    text : what the program prints
    rows, file : the table, and the file that it is written as
    left_out : why there is no derivative by a usual parameter, by its key
    """

    text: str
    rows: StudyTable
    file: str
    left_out: Mapping[str, str]

    def table(self) -> pd.DataFrame:
        """The table that a program gets."""
        import pandas as pd

        table = pd.DataFrame(self.rows.records())
        table.attrs["left_out"] = [f"{key}: {why}" for key, why in self.left_out.items()]
        return table


@dataclass(frozen=True, eq=False, repr=False)
class Identified:
    """Result of ``identify``. As text it is what the program prints.

    Attributes
    ----------
    parameters : pandas.DataFrame
        A row for each parameter, by its key: prior, found value, posterior deviation, in ``unit``.
    correlation : pandas.DataFrame
        Posterior correlations.
    directions : pandas.DataFrame
        Directions in the space of parameters, in deviations of their priors, with their
        ``information``: below 1 the prior says more than the data.
    residuals : pandas.DataFrame
        By place: measured values, and values of the march with the found parameters.
    summary : dict
        As ``identification.json``: chi-square and whiteness of the residuals, the verdict.

    Examples
    --------
    >>> scene = catenary.load("en50318_2002", short=True)
    >>> measured = catenary.run(scene).force.isel(pantograph=0)
    >>> task = {
    ...     "measured": {
    ...         "time": {"column": "time"},
    ...         "force": {"column": "contact_force", "noise": 10.0},
    ...         "is_filtered": False,
    ...     },
    ...     "parameters": [{"key": "pantographs.reference.static_force_N", "deviation": 2.0}],
    ... }
    >>> found = catenary.identify(scene, measured.to_series().reset_index(), task)
    >>> found.summary["verdict"].partition(":")[0]  # the run has none
    'The noise that the task states is too large'
    """

    parameters: pd.DataFrame
    correlation: pd.DataFrame
    directions: pd.DataFrame
    residuals: pd.DataFrame
    summary: dict[str, Any]
    _own: Identification

    def __repr__(self) -> str:
        return f"<catenary.Identified: {counted(len(self.parameters), 'parameter')}>"

    def __str__(self) -> str:
        from catenary.cases.studies.parameters.identified import as_text

        return as_text(self._own)


def identify(
    scene: SceneLike,
    measured: str | Path | pd.DataFrame,
    task: str | Path | Mapping[str, Any],
    *,
    progress: bool = False,
) -> Identified:
    """Find parameters of a scene from a measured contact force, head height, or both.

    The most probable parameters under normal distributions of noise and priors, by
    Levenberg-Marquardt with the derivatives of the march. One process computes them, under mpirun
    too: not collective.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        The scene, or whatever ``load`` takes for one.
    measured : str, Path or pandas.DataFrame
        A CSV file, or its table: a row for each sample, at even steps of place or time.
    task : str, Path or mapping
        The TOML file, or its tables: columns, units and noise of the measurement, parameters that
        are looked for and their priors; see ``docs/guide/identification.md``.
    progress : bool
        Whether a line on each march is shown on standard error.

    Returns
    -------
    Identified

    Raises
    ------
    InputError
        If scene, measurement and task do not fit together, or if the march has no derivatives.
    RunBroken
        If a march breaks.

    Examples
    --------
    >>> scene = catenary.load("en50318_2002", short=True)
    >>> measured = catenary.run(scene).force.isel(pantograph=0).to_series().reset_index()
    >>> task = {
    ...     "measured": {
    ...         "time": {"column": "time"},
    ...         "force": {"column": "contact_force", "noise": 10.0},
    ...         "is_filtered": False,
    ...     },
    ...     "parameters": [
    ...         {"key": "pantographs.reference.static_force_N", "deviation": 5.0, "mean": 117.0}
    ...     ],
    ... }
    >>> found = catenary.identify(scene, measured, task).parameters
    >>> found.found.round().tolist()
    [120.0]
    """
    own = scene_of(scene)
    return identified(own, measured, task_of(task), saying(progress))


def identified(
    scene: Scene, measured: str | Path | pd.DataFrame, task: Task, say: Callable[[str], None]
) -> Identified:
    """Identify parameters of a checked scene by a checked task, as ``identify``. Not collective.

    ``say`` gets a line on each march.
    """
    import pandas as pd

    comm = alone()  # starts MPI as one process, before anything imports it
    from catenary.cases.studies.parameters import identified as output
    from catenary.cases.studies.parameters.identification import identify as find

    samples = measured
    if not isinstance(samples, pd.DataFrame):
        samples = path_of(measured, "measured", "a table of pandas, or a file")
    found = find(checked(scene), samples, task, comm, say)
    tables = [
        pd.DataFrame(table.records())
        for table in (
            output.parameters_table(found),
            output.correlation_table(found),
            output.directions_table(found),
            output.residuals_table(found),
        )
    ]
    return Identified(
        tables[0].set_index("parameter"),
        tables[1].set_index("parameter"),
        tables[2].set_index("direction"),
        tables[3],
        output.summary_of(found),
        found,
    )


def task_of(task: str | Path | Mapping[str, Any]) -> Task:
    """The checked task of an identification, from its TOML file or its tables.

    Raises InputError if it is wrong.
    """
    from catenary.cases.studies.parameters.measurement import Task
    from catenary.cases.studies.task_files import read_task

    return read_task(tables_or_file(task, "task"), Task)


def identified_files(found: Identified) -> dict[str, Content]:
    """What ``catenary identify -o`` writes. Not collective."""
    from catenary.cases.studies.parameters.identified import files_of

    return files_of(found._own)
