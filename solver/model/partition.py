"""Partition of the line among ranks: contiguous runs of stations, cut between links."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catenary.solver.model.gauges import gauges_of
from catenary.solver.model.model import Model

# Nodes whose steps take as long as what rank 0 does for pantographs while the others are at the
# line: some 7 us, more where a long line leaves the caches cold.
PANTOGRAPH_NODES = 1500
# Times as many nodes are the least that a rank is to have before one of them has less.
_LONG = 3


@dataclass(frozen=True)
class Ownership:
    """Contiguous ranges of unknowns, the same on every rank.

    Attributes
    ----------
    bounds : (n_ranks + 1,) rank r owns the unknowns [bounds[r], bounds[r + 1])
    rank : this rank
    """

    bounds: np.ndarray
    rank: int

    @property
    def first(self) -> int:
        return int(self.bounds[self.rank])

    @property
    def last(self) -> int:
        return int(self.bounds[self.rank + 1])

    @property
    def n_local(self) -> int:
        return self.last - self.first

    def owned(self, dofs: np.ndarray) -> np.ndarray:
        """Mask of the unknowns that this rank owns, shape as ``dofs``."""
        return (dofs >= self.first) & (dofs < self.last)


def distribute(model: Model, n_ranks: int, rank: int) -> Ownership:
    """Cut a line into ``n_ranks`` runs that take nearly the same time. Not collective.

    They are of nearly equal size but for rank 0, which has fewer nodes of a long line because it
    moves the pantographs besides. A cut never separates nodes of one station nor the unknowns of a
    link or a gauge, so that their forces need no communication. Ranks beyond the number of stations
    own nothing.
    """
    numbering = model.numbering
    n_stations = numbering.low.size
    # +1 where a link's range of stations begins to forbid cuts, -1 where it ends.
    steps = np.zeros(n_stations + 2)
    together = [links.direction.unknowns for links in model.links]
    together += [watched.unknowns for watched in gauges_of(model).watched.values()]
    for unknowns in together:
        stations = np.searchsorted(numbering.starts, unknowns, side="right") - 1
        np.add.at(steps, stations.min(axis=1) + 1, 1)
        np.add.at(steps, stations.max(axis=1) + 1, -1)
    cuts = np.flatnonzero(np.cumsum(steps)[: n_stations + 1] == 0)
    nodes_of_station = model.mesh.n_nodes / n_stations
    long = model.mesh.n_nodes >= _LONG * PANTOGRAPH_NODES * n_ranks
    spared = PANTOGRAPH_NODES / nodes_of_station if long else 0
    wanted = np.linspace(-spared, n_stations, n_ranks + 1)
    wanted[0] = 0.0
    nearest = cuts[np.clip(np.searchsorted(cuts, wanted), 0, cuts.size - 1)]
    return Ownership(numbering.starts[nearest], rank)
