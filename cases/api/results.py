"""Results of a run as named arrays and tables, and the pictures of its report as figures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

# Of what evaluates a run, each method loads its own: to open a folder takes none of it.
from catenary.base.errors import InputError
from catenary.base.parallel import on_root
from catenary.callers import path_of
from catenary.cases.scene.input.faults import shown
from catenary.postproc.files.own_files import RUN_FILE
from catenary.postproc.read.results import Results
from catenary.solver.time_loop.views import channels

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

    from catenary.cases.run.runner import RunOutcome
    from catenary.postproc.evaluate.statistics import RunStatistics
    from catenary.postproc.report.page import Picture
    from catenary.scenes import Scene

_PLACES = {channels.ARM: "arm_x", channels.DROPPER: "dropper_x", channels.WIRE_END: "end_x"}
_PLACE = {"units": "m", "long_name": "position along the track"}
_WORDS = (
    *("name", "kind", "model", "criterion", "unit", "relation", "clause", "wire"),
    *("book", "rule", "because"),
)
_TRUE_OR_FALSE = ("passed", "evaluated", "compared")


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


# Name of the dimension of a channel's columns, by the part that a column is of.
_COLUMNS = {
    channels.PANTOGRAPH: "pantograph",
    channels.STRIP: "strip",
    channels.WIRE: "wire_under_pantograph",
    channels.CONTACT: "contact",
    channels.ARM: "steady_arm",
    channels.DROPPER: "dropper",
    channels.WIRE_END: "wire_end",
}


class Run:
    """Results of a run, from ``run`` or ``open``.

    Arrays are of xarray, with names, places along the track [m], times [s] and units; tables are of
    pandas, with the columns of ``summary.json``. An array is read when it is asked for.
    Under mpirun each process has its own: not collective.

    Examples
    --------
    >>> run.outcome, run.passed in (True, False, None)
    ('done', True)
    >>> run.force.dims, run.force.units
    (('time', 'pantograph'), 'N')
    """

    def __init__(
        self, results: Results | None, folder: Path | None = None, ended: RunOutcome | None = None
    ) -> None:
        """Results that are open, or None to open those of the folder when they are asked for;
        ``ended`` is how the run ended, if this process made it."""
        if results is not None:
            self._file = results
        self._folder = folder
        self._ended = ended
        self._is_closed = False

    @cached_property
    def _file(self) -> Results:
        assert self._folder is not None
        return Results(self._folder)

    @property
    def _results(self) -> Results:
        """The opened results of the run."""
        if self._is_closed:
            raise InputError("this run is closed; read tables before, or open its folder again")
        return self._file

    @property
    def plot(self) -> Pictures:
        """Draws the pictures of the report.

        Examples
        --------
        >>> figure = run.plot.force()
        """
        # Not kept: a run that no name holds any more closes its file and frees its memory at once.
        return Pictures(lambda: self._results, lambda: self._evaluated)

    @property
    def folder(self) -> Path | None:
        """The folder of the results, None of a run in memory.

        Examples
        --------
        >>> run.folder is None
        True
        """
        return self._folder

    @property
    def outcome(self) -> str:
        """End of the run: "done", "interrupted", "running", or a sentence on the failure.

        Examples
        --------
        >>> run.outcome
        'done'
        """
        return self._file.outcome if self._ended is None else self._ended.outcome

    @cached_property
    def scene(self) -> Scene:
        """The scene of the run with all values that held, to run again or to replace some.

        Raises
        ------
        InputError
            If a version of Catenary recorded it whose keys are not those of this one.

        Examples
        --------
        >>> run.scene["train.speed_km_h"]
        250.0
        """
        from catenary.cases.scene.load import Draft
        from catenary.scenes import Scene

        file = "the scene of the run" if self._folder is None else str(self._file.path)
        return Scene(Draft(self._file.attributes["config"], file, recorded=True))

    @cached_property
    def _evaluated(self) -> RunStatistics:
        from catenary.postproc.evaluate.statistics import evaluate

        return evaluate(self._results)

    @property
    def summary(self) -> dict[str, Any]:
        """The figures of ``summary.json`` as numbers, texts, lists and tables, new at each call.

        Examples
        --------
        >>> run.summary["case"], run.summary["speed_km_h"]
        ('en50318_2002', 250.0)
        """
        return deepcopy(self._summary)

    @cached_property
    def _summary(self) -> dict[str, Any]:
        if self._ended is not None and self._ended.summary:
            return self._ended.summary
        from catenary.postproc.evaluate.verdict import criteria_of
        from catenary.postproc.report.summary import summarise

        criteria = criteria_of(self._results, self._evaluated)
        return summarise(self._results, self._evaluated, criteria)

    @property
    def phase_wall(self) -> dict[str, float]:
        """Wall time of each phase [s], that of the report too if this process made the run.

        Examples
        --------
        >>> {"equilibrium", "march"} <= set(run.phase_wall)
        True
        """
        return dict(
            self._summary["phase_wall_s"] if self._ended is None else self._ended.phase_wall
        )

    @property
    def statistics(self) -> pd.DataFrame:
        """Statistics of the contact force in the evaluated stretch, a row for each pantograph.

        Forces [N] are those below 20 Hz: ``mean_N``, ``std_N``, ``max_N``, ``min_N``, the means and
        three standard deviations ``stat_max_N`` and ``stat_min_N``; ``loss_percent`` is the share
        of time without contact. Units end the names. NaN where there is no record to evaluate.

        Examples
        --------
        >>> bool(100 < run.statistics.loc["pantograph", "mean_N"] < 130)
        True
        """
        return _table(self._summary["pantographs"]).set_index("name")

    @property
    def verdict(self) -> pd.DataFrame:
        """Acceptance by rule books, a row for each criterion with its value and limit.

        ``passed`` is true, false, or missing where it is not judged, ``because`` of something;
        ``book`` and ``clause`` say where the limit comes from, ``compared`` whether it was compared
        with the text of the standard.

        Examples
        --------
        >>> run.verdict.set_index("criterion").loc["mean contact force", "unit"]
        'N'
        """
        found = _table(self._summary["acceptance"])
        return found.astype({"passed": "boolean"})

    @property
    def not_judged(self) -> pd.DataFrame:
        """Criteria for which scene or rule book lack data, a row for each with the reason.

        Examples
        --------
        >>> run.not_judged["because"].tolist()
        ['no contact wire moves sideways in this run']
        """
        return _table(self._summary["not_judged"])

    @property
    def passed(self) -> bool | None:
        """Whether all criteria are met; None if that cannot be judged, or if the run is not done.

        Examples
        --------
        >>> run.passed
        True
        """
        found: bool | None = self._summary["passed"]
        return found

    @property
    def remarks(self) -> list[str]:
        """Sentences on what the results depend on, and on figures that could not be evaluated.

        Examples
        --------
        >>> all(isinstance(sentence, str) for sentence in run.remarks)
        True
        """
        return [*self._summary["complaints"], *self._summary["remarks"]]

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of all that is recorded over time, for ``channel``.

        Examples
        --------
        >>> "contact_force" in run.channels
        True
        """
        names = (*channels.CHANNELS, *channels.ENERGIES)
        kept = self._results.energies()
        return tuple(n for n in names if n != "time" and (n in kept or self._results.has(n)))

    def channel(self, name: str) -> xr.DataArray:
        """A recorded quantity over time.

        Parameters
        ----------
        name : str
            One of ``channels``; ``docs/architecture.md`` lists them with units and signs.

        Returns
        -------
        xarray.DataArray, shape (n_times, n_columns) or (n_times,)
            ``time`` [s] and, by what a column stands for, ``pantograph`` (its name), ``strip``,
            ``contact``, or ``steady_arm``, ``dropper`` and ``wire_end`` (their places [m]). Those
            of pantographs have the places ``position`` (n_times, n_pantographs) [m]; those of the
            line its wires: ``wire`` of an arm or an end, which is ``outwards`` (1) where the wire
            ends and -1 where it begins, ``hangs_from`` and ``carries`` of a dropper. NaN where the
            line is not recorded.

        Raises
        ------
        InputError
            If the run has no such record.

        Examples
        --------
        >>> uplift = run.channel("arm_uplift")
        >>> uplift.dims, uplift.units
        (('time', 'steady_arm'), 'm')
        >>> float(uplift.sel(steady_arm=480.0).max()) > 0.01
        True
        """
        import xarray as xr

        if not isinstance(name, str) or name not in self.channels:
            there = ", ".join(self.channels)
            raise InputError(f"the run has no record {shown(name)}; it has {there}")
        results = self._results
        kept = results.energies()
        if name in kept:
            channel = channels.ENERGIES[name]
            clock = ("time", kept["time"], _about(channels.TIME))
            return xr.DataArray(kept[name], {"time": clock}, "time", name, _about(channel))
        channel = channels.CHANNELS[name]
        times = results.line_time if channel.of_line else results.time
        dims = ("time", _COLUMNS[channel.per])
        coords = {"time": ("time", times, _about(channels.TIME)), **self._columns(channel.per)}
        if channel.per == channels.PANTOGRAPH:
            place = results.channel("contact_position")
            coords["position"] = (dims, place, _PLACE)
        return xr.DataArray(results.channel(name), coords, dims, name, _about(channel))

    def _columns(self, per: str) -> dict[str, Any]:
        """The coordinates of the columns of a channel, by name."""
        results, dim = self._results, _COLUMNS[per]
        names = results.pantograph_names()
        if per in _PLACES:
            return {dim: (dim, results.line(_PLACES[per]), _PLACE), **self._wires_at(per)}
        if per == channels.PANTOGRAPH:
            return {dim: names}
        counts = results.n_strips()
        if per == channels.STRIP:
            numbers = [number + 1 for count in counts for number in range(count)]
            return {"number": (dim, numbers), "pantograph": (dim, np.repeat(names, counts))}
        if per == channels.WIRE:
            wires = results.wire_columns()
            own = np.repeat(names, [len(one) for one in wires])
            return {
                "wire": (dim, [wire for one in wires for wire in one]),
                "pantograph": (dim, own),
            }
        words = results.contact_columns()
        own = np.repeat(names, [len(one) for one in words])
        return {"contact": [word for one in words for word in one], "pantograph": (dim, own)}

    def _wires_at(self, per: str) -> dict[str, Any]:
        """What tells columns at one place apart, as of two contact wires side by side."""
        results, dim = self._results, _COLUMNS[per]
        if per == channels.ARM:
            return {"wire": (dim, np.array(results.arm_wires(), dtype=str))}
        names = np.array([*results.roles], dtype=str)
        if per == channels.DROPPER:
            upper, lower = results.dropper_wires().T
            return {"hangs_from": (dim, names[upper]), "carries": (dim, names[lower])}
        about = {"long_name": "1 where the wire ends, -1 where it begins"}
        return {
            "wire": (dim, names[results.line("end_wire").astype(int)]),
            "outwards": (dim, results.line("end_outwards").astype(int), about),
        }

    @property
    def force(self) -> xr.DataArray:
        """Contact force of each pantograph, (n_times, n_pantographs) [N], >= 0 in compression.

        Unfiltered, of every time step; ``position`` is where the pantograph is [m].

        Examples
        --------
        >>> float(run.force.min()) >= 0.0
        True
        >>> run.force.isel(pantograph=0).swap_dims(time="position").sel(
        ...     position=480.0, method="nearest"
        ... ).units
        'N'
        """
        return self.channel("contact_force")

    @property
    def filtered_force(self) -> xr.DataArray:
        """Contact force of each pantograph below 20 Hz, (n_times, n_pantographs) [N].

        Below 0 by some newton beside losses of contact, as the filter rings there. Attributes
        ``filter``, ``cut_off_Hz`` and ``order`` name the filter. The file of a run that
        is done holds it; of others it is made of the record.

        Raises
        ------
        InputError
            If the time step is too long for the filter.

        Examples
        --------
        >>> run.filtered_force.attrs["cut_off_Hz"]
        20.0
        >>> bool(run.filtered_force.std() < run.force.std())
        True
        """
        force = self.force
        stored = self._results.stored_filtered_force()
        if stored is None:
            from catenary.postproc.evaluate import filters

            stored = filters.low_pass(force.values, self._results.dt), dict(filters.ABOUT)
        values, about = stored
        name = f"contact force below {about['cut_off_Hz']:g} Hz"
        named = force.copy(data=values).assign_attrs(about, long_name=name)
        return named.rename("filtered_force")

    @property
    def uplift(self) -> xr.Dataset:
        """Uplift of the contact wire at the steady arms, by their places [m].

        ``uplift`` over time (n_times, n_arms) [m], as far as it is recorded; ``largest`` (n_arms,)
        over every step [m]; ``evaluated`` (n_arms,) whether an arm stands in the evaluated stretch.

        Examples
        --------
        >>> own = run.uplift
        >>> bool(own.largest.where(own.evaluated).max() > 0.04)
        True
        """
        import xarray as xr

        found = self._evaluated.supports
        dim = _COLUMNS[channels.ARM]
        about = {"units": "m", "long_name": "largest uplift over every step"}
        recorded = {"uplift": self.channel("arm_uplift")} if self._results.has("arm_uplift") else {}
        return xr.Dataset(
            {**recorded, "largest": (dim, found.uplift.copy(), about)},
            {**self._columns(channels.ARM), "evaluated": (dim, found.evaluated.copy())},
        )

    @property
    def droppers(self) -> xr.Dataset:
        """The droppers, by their places [m]: forces are tensions [N], negative in compression.

        ``force`` over time (n_times, n_droppers), as far as it is recorded; ``largest`` and
        ``smallest`` (n_droppers,) over every step; ``force_at_rest`` (n_droppers,); ``length``
        (n_droppers,) unstretched, as cut [m]; ``slackened`` whether it was slack at some time
        and carried at another.
        Beside them ``span`` (from 1), the wires ``hangs_from`` and ``carries``, and ``evaluated``,
        whether it hangs in the evaluated stretch.

        Examples
        --------
        >>> own = run.droppers
        >>> worst = own.isel(dropper=own.largest.argmax("dropper"))
        >>> bool(worst.largest > worst.force_at_rest), worst.largest.units
        (True, 'N')
        """
        import xarray as xr

        results, found = self._results, self._evaluated.droppers
        dim = _COLUMNS[channels.DROPPER]
        recorded = {"force": self.channel("dropper_force")} if results.has("dropper_force") else {}

        def column(values: np.ndarray, long_name: str, **unit: str) -> tuple[str, np.ndarray, Any]:
            return dim, values.copy(), {**unit, "long_name": long_name}

        return xr.Dataset(
            {
                **recorded,
                "largest": column(found.highest, "largest tension over every step", units="N"),
                "smallest": column(found.lowest, "smallest tension over every step", units="N"),
                "slackened": column(found.slackened, "whether the dropper was slack at some time"),
                "force_at_rest": column(
                    results.static("dropper_force"), "tension at rest", units="N"
                ),
                "length": column(
                    results.static("dropper_length"), "length unstretched, as cut", units="m"
                ),
            },
            {
                **self._columns(channels.DROPPER),
                "span": (dim, results.line("dropper_span").astype(int) + 1),
                "evaluated": (dim, found.evaluated.copy()),
            },
        )

    def close(self) -> None:
        """Close the result file; tables that were not read before cannot be read then.

        Examples
        --------
        >>> catenary.open(folder).close()
        """
        self._is_closed = True
        if "_file" in self.__dict__:
            self._file.close()

    def __reduce__(self) -> tuple[Callable[..., Run], tuple[Any, ...]]:
        """Processes give it to each other: by its folder, or with all of its file in memory."""
        if self._folder is None:
            return _in_memory, (str(self._results.path), self._results.image(), self._ended)
        return Run, (None, self._folder.absolute(), self._ended)

    def __enter__(self) -> Run:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        self.close()

    def __repr__(self) -> str:
        about = self._file.attributes
        where = "in memory" if self._folder is None else f"in {self._folder}"
        return f"<catenary.Run {about['case']}, {where}: {self.outcome}>"


def open(folder: str | Path) -> Run:
    """The results of a run that the program or ``run`` wrote, done or not. Not collective.

    The file is first checked for damage, in a process of its own.

    Parameters
    ----------
    folder : str or Path
        The folder of the run, or its ``run.h5``.

    Returns
    -------
    Run

    Raises
    ------
    InputError
        If there is no such file, or if it is so damaged that nothing can be read.

    Examples
    --------
    >>> with catenary.open(folder) as run:
    ...     print(run.outcome, run.summary["case"])
    done en50318_2002
    """
    from catenary.postproc.read.guard import examined

    path = path_of(folder, "folder")
    results = Results(path, examined(path))
    return Run(results, results.path.parent)


def held(run: Run, comm: Any, in_memory: bool) -> Run:
    """A run with its file open, whatever becomes of its folder. Collective.

    In memory all processes have the file, of which only rank 0 may be able to see it.
    """
    assert run.folder is not None
    path = run.folder / RUN_FILE
    if not in_memory:
        return Run(Results(path), run.folder, run._ended)
    return _in_memory(path, on_root(comm, path.read_bytes), run._ended)


def _in_memory(path: str | Path, image: bytes, ended: RunOutcome | None) -> Run:
    """A run from the bytes of its file, which stood at ``path``."""
    return Run(Results(path, image=image), None, ended)


def _about(channel: channels.Channel) -> dict[str, str]:
    """Unit and meaning, under the names that xarray draws."""
    return {"units": channel.unit, "long_name": channel.meaning}


def _table(rows: list[Mapping[str, Any]]) -> pd.DataFrame:
    """Rows as a table; columns of numbers have NaN where there is none."""
    import pandas as pd

    found = pd.DataFrame(rows)
    numbers = [name for name in found.columns if name not in (*_WORDS, *_TRUE_OR_FALSE)]
    return found.astype(dict.fromkeys(numbers, float))
