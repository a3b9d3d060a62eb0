"""The mesh of a line as arrays: nodes, wires as chains of nodes, and what hangs between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Names of the physical groups of a mesh file: lines, then points.
CONTACT_WIRE = "contact_wire"
MESSENGER_WIRE = "messenger_wire"
DROPPERS = "droppers"
STEADY_ARMS = "steady_arms"
SUPPORTS = "supports"
ANCHORS = "anchors"


@dataclass(frozen=True)
class LineMesh:
    """A line mesh, independent of how it was made.

    Attributes
    ----------
    points : (n_nodes, 3) [m]
        x along the track, y lateral, z up.
    wires : name -> (n,) int
        The nodes of each wire in order of x; element e of a wire joins nodes e and e + 1.
        A simple catenary has ``contact_wire`` and ``messenger_wire``.
    droppers : (n_droppers, 2) int
        Upper (messenger) and lower (contact) node of each dropper, in order of x.
    steady_arms : (n_arms,) int
        Contact-wire nodes at which a steady arm is clamped, in order of x.
    supports : (n_supports,) int
        Messenger-wire nodes carried by a support, in order of x.
    anchors : (n_anchors,) int
        Wire ends held by the tensioners: no vertical motion.
    """

    points: np.ndarray
    wires: dict[str, np.ndarray]
    droppers: np.ndarray
    steady_arms: np.ndarray
    supports: np.ndarray
    anchors: np.ndarray

    @property
    def n_nodes(self) -> int:
        return int(self.points.shape[0])

    def x(self, nodes: np.ndarray) -> np.ndarray:
        """Positions of ``nodes`` along the track [m]."""
        return np.asarray(self.points[nodes, 0])
