"""What a film shows of a run, read once: the line at rest, the train's course, the forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catenary.postproc.evaluate import filters
from catenary.postproc.read.results import Results
from catenary.solver.base.errors import InputError


@dataclass(frozen=True)
class FilmData:
    """A run as a film needs it; n records of p pantographs.

    Attributes
    ----------
    title : of the case
    speed : of the train [m/s]
    points : (n_nodes, 3) nodes of the line at rest [m]
    wires : name -> nodes in order of x; ``contact`` names the one that pantographs touch
    elements : name -> (n, 2) nodes of the wire's elements
    droppers : (n_droppers, 2) nodes
    supports : (n_supports,) masts along the track [m]
    time : (n,) [s]
    position, force, filtered, head_height : (n, p) [m], [N], [N] below 20 Hz, [m]; filtered is all
        NaN where the record is too coarse for it
    names : of the pantographs
    """

    title: str
    speed: float
    points: np.ndarray
    wires: dict[str, np.ndarray]
    contact: str
    elements: dict[str, np.ndarray]
    droppers: np.ndarray
    supports: np.ndarray
    time: np.ndarray
    position: np.ndarray
    force: np.ndarray
    filtered: np.ndarray
    head_height: np.ndarray
    names: list[str]

    @property
    def n_pantographs(self) -> int:
        """Number of pantographs."""
        return len(self.names)

    def rest_height(self, x: np.ndarray) -> np.ndarray:
        """Height of the contact wire at rest at places along the track [m]."""
        nodes = self.wires[self.contact]
        return np.interp(x, self.points[nodes, 0], self.points[nodes, 2])

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
    wires = results.wires()
    return FilmData(
        str(results.attributes.get("title", "")),
        results.fact("speed"),
        results.line("node_points"),
        wires,
        lowest(wires, results.line("node_points")),
        results.elements(),
        results.line("droppers"),
        results.line("support_x"),
        results.time,
        results.channel("contact_position"),
        force,
        _filtered(force, results.dt),
        results.channel("head_height"),
        results.pantograph_names(),
    )


def lowest(wires: dict[str, np.ndarray], points: np.ndarray) -> str:
    """Name of the wire that hangs lowest on the whole, which is the one that is touched."""
    return min(wires, key=lambda name: float(points[wires[name], 2].mean()))


def _filtered(force: np.ndarray, dt: float) -> np.ndarray:
    try:
        columns = [filters.low_pass(column, dt) for column in force.T]
    except InputError:
        return np.full_like(force, np.nan)
    return np.column_stack(columns)
