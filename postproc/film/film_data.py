"""Data of a run for a film: the line at rest, the train's course, the forces, and the snapshots.

`FilmData` is read once from the result file; `Snapshots` reads the motion of the line's nodes from
``fields.h5``, finished or not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.line import DropperPlace, droppers_at
from catenary.postproc.evaluate import filters
from catenary.postproc.files.hdf5 import Damage, open_own
from catenary.postproc.files.own_files import FIELD_FILES
from catenary.postproc.read.guard import survives
from catenary.postproc.read.results import Results
from catenary.postproc.record.snapshots.contents import OTHER_PARTS, PLACES, BlockTables
from catenary.postproc.record.snapshots.fields_schema import read_fields, xdmf_of
from catenary.solver.waves.excitation import Excitation, MovingForce, excitation_of_facts

# Defects and incidents after which a dropper is not there.
_GONE = ("missing_dropper", "dropper_break")
# Snapshots that are looked through for the largest motion.
_SAMPLED = 200
# Share of them that the ends of a scale hold.
_ALMOST_ALL = 0.98
# Snapshots that are kept for the next picture.
_KEPT = 6
# Times that are no further apart are the same [s].
_SAME_TIME = 1e-9
_UP = 2


class FilmData:
    """A run as a film needs it; n records of p pantographs.

    Attributes
    ----------
    title : of the case
    speed : of the train [m/s]
    points : (n_nodes, 3) nodes of the line at rest [m]
    wires : name -> nodes in order of x
    profiles : name -> each contact wire at rest, in the order of the line
    elements : name -> (n, 2) nodes of the wire's elements
    droppers : (n_droppers, 2) nodes
    gone : (n_droppers,) time from which a dropper is not there, infinite of those that stay [s]
    supports : (n_supports,) masts along the track [m]
    time : (n,) [s]
    position, force, filtered, head_height : (n, p) [m], [N], [N] below 20 Hz, [m]; filtered is all
        NaN where the record is too coarse for it, and the force itself where that is given
    names : of the pantographs
    excitation : of the line in place of a train, whose place and force then
        stand in place of those of a pantograph; None with a train

    Raises
    ------
    InputError
        If the run has no two records.
    """

    def __init__(self, results: Results) -> None:
        if results.n_steps < 1:
            raise InputError(f"{results.path} holds no step, of which a film could be made")
        about = results.attributes
        self.title, self.time = str(about.get("title", "")), results.time
        self.points, self.droppers = results.line("node_points"), results.line("droppers")
        self.wires, self.elements = results.wires(), results.elements()
        self.profiles, self.supports = results.contact_profiles(), results.line("support_x")
        self.gone = _gone(results, self.points[self.droppers[:, 1], 0])
        facts = about.get("excitation")
        self.excitation: Excitation | None = excitation_of_facts(facts) if facts else None
        if self.excitation is None:
            self.names, self.speed = results.pantograph_names(), results.fact("speed")
            self.position, self.force = (
                results.channel(f"contact_{name}") for name in ("position", "force")
            )
            self.filtered = _filtered(results, self.force)
            self.head_height = results.channel("head_height")
        else:
            own = self.excitation
            self.names = [own.kind]
            self.speed = own.speed if isinstance(own, MovingForce) else 0.0
            self.position, self.force = (of(self.time)[:, None] for of in (own.place, own.value))
            self.filtered = self.force
            self.head_height = self.rest_height(self.position[:, 0])[:, None]

    @property
    def n_pantographs(self) -> int:
        """Number of pantographs."""
        return len(self.names)

    @property
    def contacts(self) -> list[str]:
        """Names of the contact wires, in the order of the line."""
        return list(self.profiles)

    @property
    def contact(self) -> str:
        """Name of the first contact wire."""
        return self.contacts[0]

    def rest_height(self, x: np.ndarray) -> np.ndarray:
        """Height of the lowest contact wire at rest at places along the track [m]."""
        return self._at_rest(x).min(axis=0)

    def touched(self, x: float) -> str:
        """Name of the contact wire that is lowest at rest at a place along the track [m]."""
        return self.contacts[int(self._at_rest(np.array([x]))[:, 0].argmin())]

    def lowest_contact_nodes(self) -> np.ndarray:
        """Nodes of contact wires where no other contact wire is lower at rest, (n,) along x."""
        own = []
        for number, name in enumerate(self.contacts):
            nodes = self.wires[name]
            own.append(nodes[self._at_rest(self.points[nodes, 0]).argmin(axis=0) == number])
        found = np.concatenate(own)
        return found[np.argsort(self.points[found, 0], kind="stable")]

    def contacts_at(self, x: float) -> list[str]:
        """Names of the contact wires at a place along the track, all beyond their ends [m]."""
        there = [
            name for name, own in self.profiles.items() if np.isfinite(own.height_at(np.array(x)))
        ]
        return there or self.contacts

    def _at_rest(self, x: np.ndarray) -> np.ndarray:
        """Heights of the contact wires (n_wires, n) [m], inf where a wire is absent; extrapolated
        where all are."""
        heights = np.array([own.height_at(x) for own in self.profiles.values()])
        beyond = [np.interp(x, own.x, own.height) for own in self.profiles.values()]
        return np.where(np.isinf(heights).all(axis=0), beyond, heights)

    def row_at(self, time: float) -> int:
        """The record nearest to a time [s]."""
        after = int(np.clip(self.time.searchsorted(time), 1, self.time.size - 1))
        return after - int(time - self.time[after - 1] < self.time[after] - time)


def _gone(results: Results, x: np.ndarray) -> np.ndarray:
    """Times at which droppers at places [m] break [s]; minus infinity for missing ones."""
    gone = np.full(x.size, np.inf)
    for fact in (*results.attributes.get("defects", []), *results.attributes.get("incidents", [])):
        # Files of earlier versions do not say where a dropper breaks.
        if fact.get("type") in _GONE and "at_m" in fact and x.size:
            place = DropperPlace(fact["at_m"], int(fact.get("nth", 0)))
            gone[droppers_at(x, [place])] = fact.get("time_s", -np.inf)
    return gone


def _filtered(results: Results, force: np.ndarray) -> np.ndarray:
    try:
        columns = [filters.contact_force(results, p) for p in range(force.shape[1])]
    except InputError:
        return np.full_like(force, np.nan)
    return np.column_stack(columns)


@dataclass(frozen=True)
class _Wire:
    """A wire in snapshots.

    Attributes
    ----------
    block : its points, and which of them each snapshot shows
    start : (n_snapshots,) rows before those of a snapshot
    values : ``displacement`` if that was recorded, or ``uplift``
    rests : whether points that a snapshot does not show are at rest
    """

    block: BlockTables
    start: np.ndarray
    values: h5py.Dataset
    rests: bool

    @classmethod
    def of(cls, block: BlockTables, group: h5py.Group, rests: bool) -> _Wire:
        """Wire of a group of the file."""
        values = group["displacement" if "displacement" in group else "uplift"]
        return cls(block, np.cumsum(block.count) - block.count, values, rests)

    @property
    def has_vectors(self) -> bool:
        """Whether its motion along the track and sideways was recorded."""
        return self.values.ndim == 2

    def shown(self, number: int) -> tuple[int, int]:
        """Its first point in a snapshot, and the number of points."""
        return int(self.block.first[number]), int(self.block.count[number])

    def motion(self, number: int) -> np.ndarray:
        """Motion of the points in a snapshot, (count, 3) [m]."""
        begin = int(self.start[number])
        values = np.asarray(self.values[begin : begin + self.shown(number)[1]], dtype=float)
        return values if self.has_vectors else values[:, None] * [0.0, 0.0, 1.0]


class Frame(NamedTuple):
    """A line and its pantographs at a time.

    ``moved`` (n_nodes, 3) is the displacement of the nodes [m], NaN where it is not known;
    ``places`` are the base, and the masses or bodies, of each pantograph, see `mbs.interface`.
    """

    moved: np.ndarray
    places: list[tuple[float, np.ndarray]]


class Snapshots:
    """Motion of the nodes at the times of the snapshots. A context manager; not collective.

    Attributes
    ----------
    times : (n,) times of the snapshots that are there, ascending [s]
    parts : names of the wires and other parts of the line that are shown
    field : name of the field that lifts points, as ParaView's calculator has it
    whole : whether the motion of all nodes is known in each snapshot
    has_vectors : whether motions along the track and sideways are there, zero as they may be

    Parameters
    ----------
    folder : of a run, which may go on
    n_nodes : nodes of its line
    until : later snapshots are left out, as those of a run that goes on and whose records were read
        before [s]

    Raises
    ------
    InputError
        If the folder has no snapshots, or damaged ones, those of another line or without wires or
        uplift.
    """

    def __init__(self, folder: Path, n_nodes: int, until: float = np.inf) -> None:
        path = folder / FIELD_FILES[0]
        if not path.is_file():
            raise InputError(
                f"{path} does not exist: a film needs snapshots of the line; run the scene again "
                "with an output.field_every_s above 0"
            )
        if not survives(path):
            raise InputError(f"{path} is damaged: HDF5 does not read it")
        self._path, self._n_nodes, self._until = path, n_nodes, until
        self._kept: dict[int, Frame] = {}
        # Without a lock: a run may be writing it, or be continued while this is open.
        self._file = open_own(path, locking=False)
        try:
            self._open()
        except BaseException:
            self._file.close()
            raise

    def _open(self) -> None:
        path, file = self._path, self._file
        try:
            tables = read_fields(file)
        except Damage as error:
            if "uplift" in file:
                raise InputError(
                    f"{path} was written by an earlier version of Catenary; run the scene again"
                ) from error
            raise InputError(f"{path} is damaged: {error}") from error
        self.times = tables.times[tables.times <= self._until + _SAME_TIME]
        self._tables = tables._replace(times=self.times)
        if self.times.size < 2:
            raise InputError(
                f"{path} has fewer than two snapshots; if its run has just begun, wait for more"
            )
        self.parts = tuple(tables.blocks)
        self._of_this_line = tables.n_nodes == self._n_nodes
        self._blocks, self._sizes = tables.blocks, tables.n_places
        wires = [name for name in self.parts if name not in OTHER_PARTS]
        if not wires:
            raise InputError(
                f"{path} shows no wire of the line; run the scene again with wires in "
                "output.field_parts"
            )
        if not all({"uplift", "displacement"} & set(file[name]) for name in wires):
            raise InputError(
                f"{path} has neither uplift nor displacement; run the scene again with one of "
                "them in output.fields"
            )
        self._wires = {
            name: _Wire.of(tables.blocks[name], file[name], tables.rests_beyond) for name in wires
        }
        scalar = all("uplift" in file[name] for name in wires)
        self.field = "uplift" if scalar else "displacement_Z"
        self.has_vectors = all(wire.has_vectors for wire in self._wires.values())
        shown = sum(len(w.block.points) if w.rests else w.block.count for w in self._wires.values())
        self.whole = bool(np.all(shown == self._n_nodes))

    def __enter__(self) -> Snapshots:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        self._file.close()

    def xdmf(self, path: str) -> str:
        """XDMF of the snapshots, whose file is at ``path`` beside the text."""
        return xdmf_of(self._file, self._tables, path)

    def block(self, name: str) -> BlockTables:
        """Points of a part of the line that is no wire, and the nodes that they move with."""
        if not self._of_this_line:
            raise InputError(f"{self._path} does not belong to the run.h5 beside it")
        return self._blocks[name]

    def shown(self, number: int) -> tuple[float, float]:
        """From and to of the wires that are known in snapshot ``number``, as far as each reaches
        [m]."""
        return self._ends(number, at_rest=True)

    def moving(self, number: int) -> tuple[float, float]:
        """The same without what is known to rest beyond a window."""
        return self._ends(number, at_rest=False)

    def _ends(self, number: int, at_rest: bool) -> tuple[float, float]:
        ends = []
        for wire in self._wires.values():
            whole = wire.rests and at_rest
            first, count = (0, len(wire.block.points)) if whole else wire.shown(number)
            if count:
                ends.append(wire.block.points[[first, first + count - 1], 0])
        low, high = np.array(ends).reshape(-1, 2).T
        return float(low.min(initial=np.inf)), float(high.max(initial=-np.inf))

    @property
    def n_pantographs(self) -> int:
        """Number of pantographs whose masses or bodies are known."""
        return int(self._sizes.size)

    def pantographs(self, number: int) -> list[tuple[float, np.ndarray]]:
        """Base, and masses or bodies, of each pantograph in a snapshot; see `mbs.interface`."""
        row = np.asarray(self._file[PLACES][number], dtype=float)
        if not np.isfinite(row).all():
            raise InputError(f"{self._path} is damaged at t = {self.times[number]:g} s")
        n = self._sizes.size
        places = np.split(row[n:], np.cumsum(self._sizes)[:-1]) if n else []
        return list(zip(row[:n].tolist(), places, strict=True))

    def need_whole(self) -> None:
        """Raise InputError unless each snapshot shows all nodes, as a space-time picture needs."""
        if not self.whole:
            raise InputError(
                f"{self._path} shows a part of the line only, and a space-time picture needs all "
                "of it; run the scene again without output.field_window_m, field_spans and "
                "field_parts"
            )

    def extremes(
        self, numbers: np.ndarray, seen: Callable[[int], np.ndarray] | None = None
    ) -> np.ndarray:
        """Smallest and largest motion along x, y, z in some snapshots, (2, 3) [m], zero included.

        Of many snapshots some are looked through, and the rare ones that exceed almost all others
        are left out.

        Parameters
        ----------
        numbers : ndarray of int
            Numbers of the snapshots.
        seen : callable, optional
            Mask (n_nodes,) of the nodes that count in a snapshot of a number, one at least; None
            for all nodes.
        """
        some = numbers[:: max(1, numbers.size // _SAMPLED)].tolist()
        moved = [self.displacement(one) for one in some]
        if seen is not None:
            moved = [own[seen(one)] for one, own in zip(some, moved, strict=True)]
        low = np.quantile([np.nanmin(one, axis=0) for one in moved], 1.0 - _ALMOST_ALL, axis=0)
        high = np.quantile([np.nanmax(one, axis=0) for one in moved], _ALMOST_ALL, axis=0)
        return np.array([np.minimum(low, 0.0), np.maximum(high, 0.0)])

    def frame(self, time: float) -> Frame:
        """The line and its pantographs at a time [s]: a snapshot, or a cubic of the four around.

        Where a neighbour does not show a point, the nearest snapshot that does stands for it.
        """
        last = self.times.size - 1
        after = int(np.clip(self.times.searchsorted(time - _SAME_TIME), 0, last))
        if after == 0 or abs(self.times[after] - time) <= _SAME_TIME:
            return self._frame(after)
        numbers = np.clip(np.arange(after - 2, after + 2), 0, last).tolist()
        begin, end = self.times[[after - 1, after]]
        share = float((time - begin) / (end - begin))
        nearest = after if share > 0.5 else after - 1
        fallback = np.nan_to_num(self._frame(nearest).moved)
        shown = [self._frame(number) for number in numbers]
        moved = _between(share, [np.where(np.isnan(f.moved), fallback, f.moved) for f in shown])
        places = [
            (float(_between(share, [f.places[p][0] for f in shown])),
             np.asarray(_between(share, [f.places[p][1] for f in shown])))
            for p in range(self.n_pantographs)
        ]  # fmt: skip
        return Frame(np.asarray(moved), places)

    def _frame(self, number: int) -> Frame:
        """A snapshot; those around a time are kept."""
        if number not in self._kept:
            self._kept[number] = Frame(self.displacement(number), self.pantographs(number))
            if len(self._kept) > _KEPT:
                del self._kept[next(iter(self._kept))]
        return self._kept[number]

    def uplift(self, number: int) -> np.ndarray:
        """Uplift of the nodes in a snapshot, (n_nodes,) [m], as ``displacement``."""
        return self.displacement(number)[:, _UP]

    def displacement(self, number: int) -> np.ndarray:
        """Displacement of the nodes in a snapshot, NaN where it is not known, (n_nodes, 3) [m].

        Where the snapshots have the uplift alone, nothing moves along the track and sideways.

        Raises
        ------
        InputError
            If it is not of this line, or not finite.
        """
        moved = np.full((self._n_nodes, 3), np.nan)
        valid = self._of_this_line
        try:
            for wire in self._wires.values() if valid else ():
                if wire.rests:
                    moved[wire.block.nodes] = 0.0
                first, count = wire.shown(number)
                shown = wire.motion(number)
                moved[wire.block.nodes[first : first + count]] = shown
                valid = valid and bool(np.isfinite(shown).all())
        except (IndexError, KeyError, OSError, TypeError, ValueError) as error:
            raise InputError(
                f"{self._path} is damaged at t = {self.times[number]:g} s: {error}"
            ) from error
        if not valid:
            raise InputError(
                f"{self._path} does not belong to the run.h5 beside it, or is damaged at "
                f"t = {self.times[number]:g} s"
            )
        return moved


def _between(share: float, four: Sequence[Any]) -> Any:
    """A cubic between the second and the third of four values, with the slopes of their neighbours
    (Catmull and Rom, 1974)."""
    before, begin, end, after = four
    bend = 2.0 * before - 5.0 * begin + 4.0 * end - after
    steep = 3.0 * (begin - end) + after - before
    return begin + 0.5 * share * (end - before + share * (bend + share * steep))
