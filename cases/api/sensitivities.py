"""Derivatives of the statistics of a scene."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from catenary.base.lone_process import alone
from catenary.callers import listed, progress_shown
from catenary.scenes import SceneLike, checked

if TYPE_CHECKING:
    import pandas as pd

    from catenary.postproc.report.study_table import StudyTable

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
    from catenary.cases.studies.sensitivity.output import as_text, table_of
    from catenary.cases.studies.sensitivity.study import sensitivity_of

    with progress_shown(progress, comm):
        found = sensitivity_of(own, list(parameters), comm, droppers=droppers, shows=progress)
    return Derivatives(as_text(found), table_of(found), SENSITIVITIES, found.left_out)


def rest_derivatives(
    scene: SceneLike, parameters: Sequence[str] = (), *, droppers: bool = False
) -> Derivatives:
    """Differentiate a line at rest, for the verb; as ``AtRest.sensitivity``. Not collective."""
    from catenary.cases.studies.sensitivity.at_rest import (
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
