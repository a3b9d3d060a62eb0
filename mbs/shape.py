"""A pantograph as lines to be drawn: the bodies of a mechanism, or arms that carry lumped masses.

Points count along the track from the pantograph's place, across it and up from the top of rail. Of
each there are two places: at rest, with the head at the height of the wire at rest, and now.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple, Protocol

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial.distance import cdist

from catenary.base.errors import InputError
from catenary.mbs.lumped import LumpedData
from catenary.mbs.mechanism.multibody_pantograph import HOLDER, MultibodyData, stand
from catenary.mbs.rigid.bodies import SPACE, Motion, rotation_matrix
from catenary.mbs.rigid.forces import BetweenPoints
from catenary.mbs.rigid.joints import Constant, PrescribedPoint
from catenary.mbs.rigid.statics import equilibrium

# Parts that a line belongs to.
BODY, HEAD, SPRING = 0, 1, 2
# Half the length of strips that have none [m], and how far a head reaches beyond its strips.
_HALF_STRIP, _BEYOND = 0.8, 0.15
# Heights over which a mechanism is drawn, to either side of its working height, and their distance.
_REACH, _SPACING = 0.6, 0.1
# Arms of lumped masses [m]: how far the roof is below the head, and the apex of the arms; the arms;
# how far the foot stands ahead of the head, towards the knee; half the base and half the apex.
BELOW_HEAD, _APEX = 1.6, 0.25
LOWER_ARM, UPPER_ARM, _FOOT_AHEAD = 1.55, 1.75, 0.6
_HALF_BASE, _HALF_APEX = (0.7, 0.55), 0.4
# Turns of a spring between apex and head, and half their width [m].
_TURNS, _HALF_TURN = 4, 0.08


class Pose(NamedTuple):
    """Places of all points of a pantograph, (n, 3) each [m]: at rest, and now."""

    rest: np.ndarray
    now: np.ndarray


class Shape(Protocol):
    """A pantograph as lines: ``cells`` (m, 2) of its points, and what each is of, ``kinds`` (m,).

    Its base is ``below`` [m] under the head where it stands at rest. ``schematic`` says whether
    its arms are a drawing of what the model has no shape for.
    """

    cells: np.ndarray
    kinds: np.ndarray
    below: float
    schematic: bool

    def pose(self, places: np.ndarray, base: float, head: float, wire: float) -> Pose:
        """Positions of the points.

        Parameters
        ----------
        places, base : ndarray
            What `Pantograph.places` and `Pantograph.base` returned.
        head : float
            Height of the head [m].
        wire : float
            Height of the wire at rest where the pantograph is [m].
        """


def shape_of(data: LumpedData | MultibodyData) -> Shape:
    """The shape of a pantograph. Not collective.

    Raises
    ------
    InputError
        If a mechanism cannot stand.
    """
    if isinstance(data, LumpedData):
        return LumpedShape(data)
    return MechanismShape(data)


class LumpedShape:
    """Lumped masses as a pantograph that could have them: head, apex and knee of two arms, base.

    Masses have heights and no shape. The first is the head, the second the apex; the knee moves as
    a mass halfway between apex and roof does, of three masses the third.
    """

    schematic = True

    def __init__(self, data: LumpedData) -> None:
        self._n, self.below = data.n_masses, BELOW_HEAD
        head = _head_lines(data.strips.contact_offsets, data.strips.length)
        arms = _arms()
        spring = _spring()
        self._points, self.cells = _joined([head, arms, spring[:2]])
        apex = 1.0 if self._n > 1 else 0.0
        roof = float(self._n)
        # Number of the mass that each point moves with: the head is 0, the roof n.
        of_arms = [apex] * 3 + [0.5 * (apex + roof)] + [roof] * 5
        self._share = np.concatenate([np.zeros(len(head[0])), of_arms, apex * spring[2]])
        self.kinds = np.repeat([HEAD, BODY, SPRING], [len(own[1]) for own in (head, arms, spring)])

    def pose(self, places: np.ndarray, base: float, head: float, wire: float) -> Pose:
        """Places of the points, see `Shape`."""
        lower = places[places.size - self._n + 1 :] if self._n > 1 and places.size else np.zeros(0)
        # All masses are at one height with the springs relaxed; the last place is the roof's.
        lifted = np.concatenate([[head], lower, [wire + base]]) - wire
        rest = self._points + np.array([0.0, 0.0, wire])
        now = rest.copy()
        now[:, 2] += np.interp(self._share, np.linspace(0.0, self._n, lifted.size), lifted)
        return Pose(rest, now)


def schematic() -> Shape:
    """Schematic shape of a pantograph whose head's height alone is known."""
    return LumpedShape(LumpedData((1.0,), (1.0,), (0.0,)))


@dataclass(frozen=True)
class _Points:
    """Points fixed on bodies: numbers of the bodies, and places in their axes (n, 3) [m]."""

    bodies: np.ndarray
    local: np.ndarray

    def at(self, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
        """Positions (n, 3) of the points."""
        turned = np.einsum("nij,nj->ni", rotation[self.bodies], self.local)
        return np.asarray(position[self.bodies] + turned)


class MechanismShape:
    """The bodies of a mechanism, each as the shortest lines through the points of its joints."""

    schematic = False

    def __init__(self, data: MultibodyData) -> None:
        standing = stand(data)
        self._data, numbers = data, standing.motion.numbers
        fixed = _attachments(data)
        parts: list[tuple[np.ndarray, np.ndarray]] = []
        bodies, kinds = [], []
        for name, points in fixed.items():
            own = np.unique(np.round(points, 9), axis=0)
            cells = _shortest_lines(own)
            if name == data.head:
                strips = _head_lines(data.strips.contact_offsets, data.strips.length)
                own, cells = _joined([strips, (own, cells)])
            parts.append((own, cells))
            bodies.append(np.full(len(own), numbers[name]))
            kinds.append(np.full(len(cells), HEAD if name == data.head else BODY))
        for force in data.system.forces:
            if isinstance(force, BetweenPoints):
                parts.append((np.array([force.at_i, force.at_j], dtype=float), np.array([[0, 1]])))
                bodies.append(np.array([numbers[force.i], numbers[force.j]]))
                kinds.append(np.array([SPRING]))
        local, self.cells = _joined(parts)
        self._points = _Points(np.concatenate(bodies), local)
        self.kinds = np.concatenate(kinds)
        at_head = standing.motion.position[numbers[data.head]]
        self._on_head = self._points.bodies == numbers[data.head]
        # The pantograph's place is that of its head.
        self._ahead, self.below = float(at_head[0]), float(at_head[2])
        self._poses = _poses(data, self._points)
        self._head_above_arm = standing.head.offset

    def pose(self, places: np.ndarray, base: float, head: float, wire: float) -> Pose:
        """Places of the points, see `Shape`; of a reduced mechanism those of its arm's height."""
        rest = self._raised(wire - base - self._head_above_arm, wire - base)
        n = self._data.system.start().n_bodies
        if places.size == 7 * n:
            position = np.vstack([places[: 3 * n].reshape(n, 3), np.zeros(3)])
            turns = np.vstack([places[3 * n :].reshape(n, 4), [1.0, 0.0, 0.0, 0.0]])
            now = self._points.at(position, rotation_matrix(turns))
        else:
            arm = float(places[-1]) - base - self._head_above_arm
            now = self._raised(arm, head - base)
        to = np.array([-self._ahead, 0.0, base])
        return Pose(rest + to, now + to)

    def _raised(self, arm: float, head: float) -> np.ndarray:
        """Points with the arm and the head at heights above the base [m]."""
        low, high = self._poses.x[[0, -1]]
        points = np.array(self._poses(np.clip(arm, low, high))).reshape(-1, 3)
        own = points[self._on_head]
        # Strips stand at the height of the head.
        points[self._on_head, 2] += head - own[0, 2]
        return points


@lru_cache(maxsize=64)
def _table(data: MultibodyData) -> tuple[np.ndarray, list[Motion]]:
    """Heights of the arm that a mechanism reaches, and where its bodies are there."""
    standing = stand(data)
    found = {standing.working_height: standing.motion}
    for way in (1.0, -1.0):
        motion = standing.motion
        for step in np.arange(_SPACING, _REACH + 0.5 * _SPACING, _SPACING):
            height = standing.working_height + way * float(step)
            held = standing.system.with_joints(PrescribedPoint(HOLDER, data.arm, Constant(height)))
            try:
                motion = equilibrium(held, motion).motion
            except InputError:
                break
            found[height] = motion
    heights = sorted(found)
    return np.array(heights), [found[height] for height in heights]


def _poses(data: MultibodyData, points: _Points) -> CubicSpline:
    """Places of points (3 n,) over the height of the arm."""
    heights, motions = _table(data)
    if heights.size == 1:
        heights, motions = np.array([heights[0], heights[0] + 1e-3]), motions * 2
    there = [points.at(motion.position, motion.rotation).ravel() for motion in motions]
    return CubicSpline(heights, np.array(there), bc_type="natural")


def _attachments(data: MultibodyData) -> dict[str, np.ndarray]:
    """Points at which joints and forces take hold of the bodies, in the bodies' axes."""
    found: dict[str, list[Any]] = {body.name: [(0.0, 0.0, 0.0)] for body in data.system.bodies}
    found[SPACE] = []
    for part in (*data.system.joints, *data.system.forces):
        for side in ("i", "j"):
            name, at = getattr(part, side, None), getattr(part, f"at_{side}", None)
            if name is not None and at is not None:
                found[name].append(tuple(at))
    for name, points in found.items():
        # Of a body with joints its centre of mass is not shown.
        if name != SPACE and len(set(points)) > 2:
            points.remove((0.0, 0.0, 0.0))
    return {name: np.array(points, dtype=float) for name, points in found.items() if points}


def _shortest_lines(points: np.ndarray) -> np.ndarray:
    """Pairs of points (m, 2) that join all of them on the shortest way."""
    if len(points) < 2:
        return np.zeros((0, 2), dtype=int)
    return np.argwhere(minimum_spanning_tree(cdist(points, points)).toarray() > 0.0)


def _head_lines(offsets: tuple[float, ...], length: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Strips across the track, and the frame of the head around them."""
    half = _HALF_STRIP if length is None else 0.5 * length
    ahead = max(offsets) + _BEYOND, min(offsets) - _BEYOND
    points = [(x, side * half, 0.0) for x in offsets for side in (-1.0, 1.0)]
    cells = [(k, k + 1) for k in range(0, len(points), 2)]
    n = len(points)
    points += [(x, side * 0.5 * half, 0.0) for x in ahead for side in (-1.0, 1.0)]
    cells += [(n, n + 1), (n + 2, n + 3), (n, n + 2), (n + 1, n + 3)]
    return np.array(points), np.array(cells)


def _arms() -> tuple[np.ndarray, np.ndarray]:
    """Two arms from the base to the apex: points of apex, knee and base, and their lines."""
    foot, apex = np.array([_FOOT_AHEAD, -BELOW_HEAD]), np.array([0.0, -_APEX])
    distance = float(np.hypot(*(apex - foot)))
    # Law of cosines: how far along the line from foot to apex the knee stands, and beside it.
    along = (LOWER_ARM**2 - UPPER_ARM**2 + distance**2) / (2.0 * distance)
    unit = (apex - foot) / distance
    beside = np.sqrt(LOWER_ARM**2 - along**2) * np.array([unit[1], -unit[0]])
    knee = foot + along * unit + beside
    length, half = _HALF_BASE
    base = [(x, y, -BELOW_HEAD) for x in (-length, length) for y in (-half, half)]
    points = [
        (0.0, -_HALF_APEX, -_APEX), (0.0, 0.0, -_APEX), (0.0, _HALF_APEX, -_APEX),
        (knee[0], 0.0, knee[1]), (foot[0], 0.0, -BELOW_HEAD), *base,
    ]  # fmt: skip
    cells = [(0, 1), (1, 2), (1, 3), (0, 3), (2, 3), (3, 4), (5, 6), (7, 8), (5, 7), (6, 8)]
    return np.array(points), np.array(cells)


def _spring() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A zigzag line from the head down to the apex, and how far along it each point is, from 0 to
    1."""
    share = np.linspace(0.0, 1.0, _TURNS + 2)
    beside = _HALF_TURN * np.concatenate([[0.0], np.resize([1.0, -1.0], _TURNS), [0.0]])
    points = np.column_stack([beside, np.zeros(share.size), -_APEX * share])
    first = np.arange(share.size - 1)
    return points, np.column_stack([first, first + 1]), share


def _joined(
    parts: list[tuple[np.ndarray, np.ndarray]],
) -> tuple[np.ndarray, np.ndarray]:
    """Points and cells of several parts as one."""
    starts = np.cumsum([0, *(len(points) for points, _ in parts)])
    cells = [part[1].reshape(-1, 2) + start for part, start in zip(parts, starts, strict=False)]
    return np.concatenate([points for points, _ in parts]), np.concatenate(cells)
