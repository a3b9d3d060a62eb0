"""Data of a run for a film, read once: the line at rest, the train's course, the forces."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.line import DropperPlace, droppers_at
from catenary.postproc.evaluate import filters
from catenary.postproc.read.line_of_run import ContactProfile
from catenary.postproc.read.results import Results
from catenary.solver.waves.excitation import Excitation, MovingForce, excitation_of_facts

# Defects and incidents after which a dropper is not there.
_GONE = ("missing_dropper", "dropper_break")


@dataclass(frozen=True)
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
    """

    title: str
    speed: float
    points: np.ndarray
    wires: dict[str, np.ndarray]
    profiles: dict[str, ContactProfile]
    elements: dict[str, np.ndarray]
    droppers: np.ndarray
    gone: np.ndarray
    supports: np.ndarray
    time: np.ndarray
    position: np.ndarray
    force: np.ndarray
    filtered: np.ndarray
    head_height: np.ndarray
    names: list[str]
    excitation: Excitation | None = None

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


def film_data(results: Results) -> FilmData:
    """Read what a film of a run shows.

    Raises
    ------
    InputError
        If the run has no two records.
    """
    if results.n_steps < 1:
        raise InputError(f"{results.path} holds no step, of which a film could be made")
    force = results.channel("contact_force")
    points, droppers = results.line("node_points"), results.line("droppers")
    data = FilmData(
        str(results.attributes.get("title", "")),
        results.fact("speed"),
        points,
        results.wires(),
        results.contact_profiles(),
        results.elements(),
        droppers,
        _gone(results, points[droppers[:, 1], 0]),
        results.line("support_x"),
        results.time,
        results.channel("contact_position"),
        force,
        _filtered(results, force),
        results.channel("head_height"),
        results.pantograph_names(),
    )
    facts = results.attributes.get("excitation")
    return _excited(data, excitation_of_facts(facts)) if facts else data


def _excited(data: FilmData, excitation: Excitation) -> FilmData:
    """Data of a film of a line that an excitation sets into motion."""
    position, force = (of(data.time)[:, None] for of in (excitation.place, excitation.value))
    return replace(
        data,
        speed=excitation.speed if isinstance(excitation, MovingForce) else 0.0,
        position=position,
        force=force,
        filtered=force,
        head_height=data.rest_height(position[:, 0])[:, None],
        names=[excitation.kind],
        excitation=excitation,
    )


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
