"""Links: droppers, clamps, arms, stops, each a direction in the line's unknowns and a law.

The stretch of a link is e = L d, a sum of m displacements times weights. Its law is
T = rest + k e + c e', and it acts on the unknowns with -L T. A link that only pulls has no T < 0,
one that only pushes no T > 0. With a gap a link stands open at rest: it is then no part of K.
Where its stiffness changes besides, it has bends: beyond one its force differs from what it would
be by a slope times the way beyond.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from catenary.meshgen.mesh import DROPPERS

# Directions in which a link has a force: tension and compression, or one of both.
BOTH, PULLS, PUSHES = 0, 1, 2
# Force at rest [N], of an open link that of its spring drawn on through the gap; stiffness [N/m];
# damping [N s/m] beside that of its component; place along the track [m]; which forces it has;
# whether it stands open at rest.
LAW = np.dtype(
    [
        ("rest", np.float64),
        ("stiffness", np.float64),
        ("damping", np.float64),
        ("place", np.float64),
        ("acts", np.int64),
        ("open", np.bool_),
    ]
)


class Direction(NamedTuple):
    """Directions L of n links: ``weights`` (n, m) of displacements of ``unknowns`` (n, m)."""

    unknowns: np.ndarray
    weights: np.ndarray

    def matrices(self, factor: np.ndarray) -> np.ndarray:
        """``factor`` L L^T of each, (n, m, m), such as a stiffness (n,)."""
        weights = self.weights
        return np.asarray(factor[:, None, None] * weights[:, :, None] * weights[:, None, :])

    def some(self, which: np.ndarray) -> Direction:
        """Those of some of the links."""
        return Direction(self.unknowns[which], self.weights[which])


class Bends(NamedTuple):
    """Bends in the laws of links, beyond which their slope differs.

    Attributes
    ----------
    link : (k,) number of the link
    stretch : (k,) stretch at which its law bends, beyond that at rest [m]
    side : (k,) 1 if the other slope holds for longer stretches, -1 if for shorter ones
    change : (k,) slope beyond the bend less that before it [N/m]
    """

    link: np.ndarray
    stretch: np.ndarray
    side: np.ndarray
    change: np.ndarray


_NONE = np.zeros(0)
NO_BENDS = Bends(np.zeros(0, dtype=np.int64), _NONE, _NONE, _NONE)


@dataclass(frozen=True)
class Links:
    """Links of one component of the line.

    Attributes
    ----------
    component : its name, which decides on damping (``line.damping.per_component``)
    direction : Direction of each
    law : (n,) records of ``LAW``
    of_shape : whether form finding finds their forces at rest; those of others are given
    bends : Bends beside the one where a link of one sign switches
    """

    component: str
    direction: Direction
    law: np.ndarray
    of_shape: bool = False
    bends: Bends = NO_BENDS

    @property
    def stiffness_matrices(self) -> np.ndarray:
        """k L L^T of each, shape (n, m, m) [N/m]; zero of open links."""
        return self.direction.matrices(np.where(self.law["open"], 0.0, self.law["stiffness"]))


# Of a line to which none were added yet.
NO_DROPPERS = Links(
    DROPPERS,
    Direction(np.zeros((0, 1), dtype=np.int64), np.zeros((0, 1))),
    np.zeros(0, dtype=LAW),
    of_shape=True,
)


def law(
    place: np.ndarray,
    stiffness: float | np.ndarray,
    rest: float | np.ndarray = 0.0,
    acts: int = BOTH,
    gap: float | np.ndarray | None = None,
) -> np.ndarray:
    """Laws of n links as records of ``LAW``.

    Parameters
    ----------
    place : ndarray, shape (n,)
        Places along the track [m].
    stiffness : float or ndarray
        Stiffness [N/m], > 0.
    rest : float or ndarray, optional
        Force at rest [N], > 0 in tension, which the rest shape is found with.
    acts : int, optional
        ``BOTH``, ``PULLS`` or ``PUSHES``.
    gap : float or ndarray, optional
        Stretch [m] by which an open link of one sign is away from acting at rest, >= 0;
        None for links of K.

    Raises
    ------
    ValueError
        If a link with a gap acts both ways or has a force at rest.
    """
    if gap is not None and (acts == BOTH or np.any(rest) or np.any(np.asarray(gap) < 0.0)):
        raise ValueError("a link with a gap >= 0 acts one way and carries nothing at rest")
    result = np.zeros(np.shape(place), dtype=LAW)
    result["place"], result["stiffness"] = place, stiffness
    result["acts"], result["rest"] = acts, rest
    if gap is not None:
        sign = -1.0 if acts == PULLS else 1.0
        result["rest"], result["open"] = sign * np.asarray(stiffness) * gap, True
    return result


def slips(place: np.ndarray, holds: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """Laws of n links at ``place`` (n,) [m] that let dampers of the line slip, records of ``LAW``.

    A damper of ``damping`` (n,) [N s/m] and its link together resist shortening with
    min(-damping e', holds): the link cancels the damper's force beyond ``holds`` (n,) >= 0 [N].
    """
    result = np.zeros(np.shape(place), dtype=LAW)
    result["place"], result["rest"], result["damping"] = place, holds, damping
    result["acts"] = PULLS
    return result
