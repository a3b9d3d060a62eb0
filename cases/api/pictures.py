"""The pictures of a report, as figures of Matplotlib."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from catenary.base.errors import InputError
from catenary.cases.scene.input.faults import shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from catenary.postproc.evaluate.statistics import RunStatistics
    from catenary.postproc.read.results import Results
    from catenary.postproc.report.sections.section import Picture


class Pictures:
    """Pictures of a run: ``run.plot``. Not collective.

    A figure is Matplotlib's: ``savefig`` writes it, a notebook shows it. Nothing opens a window.

    Examples
    --------
    >>> run.plot.names[:3]
    ('contact_force', 'histogram', 'spectrum')
    >>> run.plot("static").axes[0].get_ylabel() != ""
    True
    """

    def __init__(
        self, results: Callable[[], Results], evaluated: Callable[[], RunStatistics]
    ) -> None:
        self._results = results
        self._evaluated = evaluated

    def _drawings(self) -> Iterator[Picture]:
        from catenary.postproc.report.report import drawings

        return drawings(self._results(), self._evaluated())

    @property
    def names(self) -> tuple[str, ...]:
        """Pictures that the report of this run has, by the names of their files.

        Examples
        --------
        >>> "droppers" in run.plot.names
        True
        """
        return tuple(name for name, *_ in self._drawings())

    def __call__(self, name: str) -> Figure:
        """The picture of a name out of ``names``.

        Parameters
        ----------
        name : str
            Of its file in the report, without the end.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        InputError
            If the run has no such picture.

        Examples
        --------
        >>> figure = run.plot("histogram")
        """
        from catenary.postproc.report.pictures.figures import fitted

        for own, _, draw in self._drawings():
            if isinstance(name, str) and own == name and (figure := draw()) is not None:
                return fitted(figure)
        raise InputError(f"the run has no picture {shown(name)}; it has {', '.join(self.names)}")

    def force(self) -> Figure:
        """Contact force of each pantograph along the track, unfiltered and below 20 Hz [N].

        Examples
        --------
        >>> run.plot.force().axes[0].get_ylabel()
        'contact force [N]'
        """
        return self("contact_force")

    def statistics(self) -> Figure:
        """Mean, deviation and extremes of the contact force of each pantograph as bars [N].

        Raises
        ------
        InputError
            If there is no record to evaluate, as of all pictures.

        Examples
        --------
        >>> figure = run.plot.statistics()
        """
        from catenary.postproc.report.pictures import figures, force_pictures

        evaluated = self._evaluated()
        complaints = [one.complaint for one in evaluated.pantographs]
        if all(complaints):
            raise InputError(f"the run has no picture of statistics. {complaints[0]}")
        return figures.fitted(force_pictures.force_statistics(evaluated))

    def histogram(self) -> Figure:
        """Share of time [%] of the contact force below 20 Hz in bins of 10 N.

        Examples
        --------
        >>> figure = run.plot.histogram()
        """
        return self("histogram")

    def uplift(self) -> Figure:
        """Uplift of the contact wire at the steady arms [mm].

        Examples
        --------
        >>> figure = run.plot.uplift()
        """
        return self("uplift")

    def droppers(self) -> Figure:
        """Forces of the dropper with the lowest one and of one at mid-span; ranges of all [N].

        Examples
        --------
        >>> figure = run.plot.droppers()
        """
        return self("droppers")

    def at_rest(self) -> Figure:
        """Profile of the contact wire at rest [mm], and elasticity along a span [mm/N].

        Examples
        --------
        >>> figure = run.plot.at_rest()
        """
        return self("static")
