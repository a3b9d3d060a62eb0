"""The load that an excitation is on a contact wire.

The shape functions of an element share a force at a point among the unknowns of its two nodes.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from catenary.solver.model.beam import shape_values
from catenary.solver.model.loads import FieldLoad, Load, ShapeLoad, table
from catenary.solver.model.model import Model
from catenary.solver.waves.excitation import Blow, Excitation

# Points in time by which half a sine or a whole cosine is drawn.
_POINTS = 641


def load_of(excitation: Excitation, model: Model, interval: float) -> Load:
    """The load that an excitation is on the first contact wire. Not collective.

    Parameters
    ----------
    excitation : Excitation
        Force on the wire over time and place.
    model : Model
        Discrete line.
    interval : float
        Time between the instants at which a force that moves is found, linear in between;
        the time step is best [s].
    """
    nodes = model.contact_nodes
    x = model.mesh.x(nodes)
    unknowns = np.stack([model.dofs(nodes), model.dofs(nodes, "theta_y")], axis=1).ravel()
    if isinstance(excitation, Blow):
        values = np.zeros((1, unknowns.size))
        spread(x, np.array([excitation.at]), np.array([excitation.peak]), 0, values)
        acts = np.flatnonzero(values[0])
        share = np.linspace(0.0, 1.0, _POINTS)
        course = table(list(excitation.duration * share), list(excitation.shape(share)))
        return ShapeLoad(unknowns[acts], values[0, acts], course)

    def fill(first: int, part: slice, slices: np.ndarray) -> None:
        times = interval * (first + np.arange(slices.shape[0]))
        places = excitation.place(times)
        slices[:] = 0.0
        spread(x, places, excitation.value(times), part.start, slices)

    return FieldLoad(unknowns, sparse.identity(unknowns.size, format="csr"), interval, fill)


def spread(
    x: np.ndarray, places: np.ndarray, forces: np.ndarray, first: int, loads: np.ndarray
) -> None:
    """Add forces at single places to loads on deflections and slopes of nodes.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Places of the nodes of a wire, ascending [m].
    places, forces : ndarray, shape (m,)
        Places and forces [m], [N]; what lies beyond the ends is left out.
    first : int
        Number of the unknown that the first column stands for: w and theta of each node in
        turn.
    loads : ndarray, shape (m, k)
        Loads, a row for each force [N], [N m].
    """
    row = np.flatnonzero((places >= x[0]) & (places <= x[-1]))
    element = np.clip(np.searchsorted(x, places[row], side="right") - 1, 0, x.size - 2)
    length = x[element + 1] - x[element]
    shares = shape_values((places[row] - x[element]) / length, length)
    for j, share in enumerate(shares):
        column = 2 * element + j - first
        there = (column >= 0) & (column < loads.shape[1])
        loads[row[there], column[there]] += (forces[row] * share)[there]
