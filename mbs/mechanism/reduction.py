"""A mechanism that can only raise and lower, reduced to the height of one of its points.

With h the height, m(h) dh^2/dt^2 + 1/2 dm/dh (dh/dt)^2 = F(h) - c(h) dh/dt + p, where p is a force
that lifts the point: Lagrange's equation of the mechanism with everything but h eliminated. Tables
of m, F and c over h hold all of it, so that a step costs a few interpolations.

A pantograph of a head on springs over such a mechanism moves with the line's fixed step:

    m_head y'' = -k (y - z) - c (y' - z') - f
    m(h) (z'' - b'') + 1/2 dm/dh (z' - b')^2
        = r(t) S(h) - c_frame(h) (z' - b') - s(h) b'' + k (y - z) + c (y' - z')

y is the head's height, z the height at which the arm below would carry it without contact,
h the arm's height above the base, S the static force at that height: the mechanism's lift less the
head's weight; r grows from 0 to 1 while the pantograph is raised. b is the height of a base that
moves (Lagrange's equation with the kinetic energy 1/2 m h'^2 + s h' b'), s the mass that the base
carries along with the arm. The head may stand on several strips, roll and pitch (`strips`); it is
not carried along the track, and links between two balls do not spin. The air adds forces on the
head, on the arm, and on bodies of the mechanism, whose lift is a column of the tables.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from catenary.base.errors import InputError, RunBroken
from catenary.mbs.air import AirForces
from catenary.mbs.head import laws as head_laws
from catenary.mbs.head.pantograph import SteppedHead
from catenary.mbs.head.stepping import Stepping
from catenary.mbs.head.strips import ONE_STRIP, Strips, Turning, head_parts
from catenary.mbs.interface import spline_tables, tables_at
from catenary.mbs.rigid.bodies import Law, Motion, Vector, point
from catenary.mbs.rigid.forces import Actuator, PointForce, gradient_of
from catenary.mbs.rigid.joints import ORIGIN, PrescribedPoint
from catenary.mbs.rigid.statics import at_rest
from catenary.mbs.rigid.system import System, least_squares, null_space
from catenary.solver.kernels import native

# Closer than this no heights are put in [m]: a stop of 1e5 N/m is then off by some 5 N over 1 mm.
FINEST = 5e-4
# A mechanism whose equivalent mass is so many times that at the start nearly locks: tables would
# not follow it.
LOCKING = 4.0
# Work of an actuator on motions besides the raising, over its force, that counts as none.
_NO_WORK = 1e-9


@dataclass(frozen=True)
class ReducedMechanism:
    """Tables over the height of a point, joined by cubic splines.

    ``heights`` [m], growing; ``masses`` [kg], equivalent mass at the point; ``lifts`` [N], upward
    force on the point at rest; ``dampings`` [N s/m]; ``carried`` [kg], the sum of m dz/dh, force on
    the point per upward acceleration of the base; all of shape (n,), n >= 4. ``name`` is the
    pantograph's, for messages. ``blown`` [N], shape (n,): upward force on the point by the air on
    the bodies; None if it has none.
    """

    heights: np.ndarray
    masses: np.ndarray
    lifts: np.ndarray
    dampings: np.ndarray
    carried: np.ndarray
    name: str = ""
    blown: np.ndarray | None = None

    def at(self, height: float) -> tuple[np.ndarray, np.ndarray]:
        """Mass, lift and damping at a height [m], shape (3,), and their slopes, per metre."""
        values, slopes = tables_at(self.tables, height)
        return values[:3], slopes[:3]

    @cached_property
    def tables(self) -> native.SplineTables:
        """Splines of mass, lift, damping, carried mass and, of a mechanism that meets the air, the
        upward force of the air on its bodies."""
        listed = [self.masses, self.lifts, self.dampings, self.carried]
        columns = np.stack(listed if self.blown is None else [*listed, self.blown], axis=1)
        spline = CubicSpline(self.heights, columns)
        return spline_tables(spline.x, spline.c)

    def blown_at(self, height: float) -> float:
        """Upward force on the point by the air on the bodies at a height [m], 0 without air."""
        return 0.0 if self.blown is None else float(CubicSpline(self.heights, self.blown)(height))

    def left(self, height: float, time: float) -> RunBroken:
        """The error of a mechanism that has left its tables at a height [m] and a time [s]."""
        who = f"of pantograph {self.name!r} " if self.name else ""
        return RunBroken(
            f"At {time:.4g} s the arm {who}is at {height:.4g} m above its base, but its mechanism "
            f"moves between {self.heights[0]:.4g} m and {self.heights[-1]:.4g} m only: it was "
            "thrown off the wire, or the line's heights are beyond its reach; take a smaller "
            "numerics.dt_s or a mechanism that reaches"
        )


def reduce_mechanism(
    system: System,
    body: str,
    heights: Vector,
    at: Vector = ORIGIN,
    start: Motion | None = None,
    as_far_as_it_goes: bool = False,
    tolerance: float | None = None,
    name: str = "",
    blowing: Sequence[PointForce] = (),
    places: Raised | None = None,
    riding: tuple[float, Vector] = (0.0, ORIGIN),
) -> ReducedMechanism:
    """Tables of a mechanism for heights of the point ``at`` of a body.

    Forces must not depend on time. What moves besides the raising (links
    that spin between two balls) is taken to stay at rest, as it does in a plane mechanism.

    Parameters
    ----------
    system : System
        Bodies with their joints and forces.
    body : str
        Name of the body that carries the point.
    heights : array_like, shape (n,)
        Heights [m], growing, n >= 4.
    at : array_like, shape (3,), optional
        The point in the axes of the body [m].
    start : Motion, optional
        A motion near by to assemble from, that of the system's data if None.
    as_far_as_it_goes : bool, optional
        Leave out the heights beyond the first one, above and below the start, that the
        mechanism does not reach or where it nearly locks.
    tolerance : float, optional
        Tolerance of the lift between heights [N]; where it is missed further ones are put
        in, down to half a millimetre; None for the given heights alone.
    name : str, optional
        Name of the pantograph, for messages.
    blowing : sequence of PointForce, optional
        Forces of the air, of which the tables have a column of their own.
    places : Raised, optional
        Places that earlier calls have found for the same ``body`` and ``at`` and a system
        that differs in the force of an actuator alone.
    riding : tuple, optional
        A mass [kg] that ``body`` carries along and across the track, but not upward, and its place
        (3,) in the axes of the body [m].

    Raises
    ------
    InputError
        Heights do not grow, or the mechanism does not reach one of them.
    """
    table = np.asarray(heights, dtype=float)
    if len(table) < 4 or np.any(np.diff(table) <= 0.0):
        raise InputError(f"A mechanism is reduced for at least four growing heights, not {table}.")
    # Heights are visited from the one that is nearest to the start, each from its neighbour.
    raised = places or Raised(system, body, at)
    more = raised.more(system)
    motion = raised.assembled(start)
    first = int(np.argmin(np.abs(table - point(motion, body, at).value[2])))
    found = [raised.to(table[first], motion)]
    for way in (table[first + 1 :], table[:first][::-1]):
        there = found[0]
        for height in way:
            try:
                there = raised.from_near(height, there)
            except (InputError, RunBroken):
                if not as_far_as_it_goes:
                    raise
                break
            if as_far_as_it_goes and there.columns[0] > LOCKING * found[0].columns[0]:
                break
            found.append(there)
    if len(found) < 4:
        raise InputError(
            f"The mechanism moves by less than {4 * np.diff(table).min():g} m from the height of "
            f"{table[first]:g} m before it locks or comes apart."
        )
    found.sort(key=lambda place: place.height)
    if tolerance is not None:
        found = _refined(raised, more, found, tolerance)
    masses, dampings, carried = np.array([place.columns for place in found]).T
    mass, its_place = riding
    for axis in np.eye(3)[:2] if mass else ():
        push = PointForce("riding", body, tuple(axis), tuple(its_place))
        masses += mass * np.array([p.way @ push.generalised(p.motion, 0.0) for p in found]) ** 2
    lifts = np.array([raised.lift(place, more) for place in found])
    if np.isnan(lifts).any():  # the actuator moves more than the raising: nothing can be shared
        options = heights, at, start, as_far_as_it_goes, tolerance, name, blowing, None, riding
        return reduce_mechanism(system, body, *options)
    blown = None
    if blowing:
        blown = np.array(
            [sum(p.way @ f.generalised(p.motion, 0.0) for f in blowing) for p in found]
        )
    reached = np.array([place.height for place in found])
    return ReducedMechanism(reached, masses, lifts, dampings, carried, name, blown)


class _Place(NamedTuple):
    """A mechanism at rest at a ``height``: ``columns`` (3,) of its tables there but for the lift
    [N], and its ``way`` (6 n,), the displacement per metre of height."""

    height: float
    motion: Motion
    columns: np.ndarray
    lift: float
    way: np.ndarray


class Raised:
    """A mechanism at rest with the point ``at`` of a body held at heights, found so far for any
    constant force of an ``actuator``; without one all forces stay as they are."""

    def __init__(
        self, system: System, body: str, at: Vector = ORIGIN, actuator: str | None = None
    ) -> None:
        self._system, self._height = system, 0.0
        self._actuator = None if actuator is None else _actuator(system, actuator)
        # Its law reads the height of the moment, so that the system is made once.
        self._held = system.with_joints(PrescribedPoint("height", body, self._law, at))
        self._places: dict[float, _Place] = {}
        self._gains: dict[float, float] = {}

    def more(self, system: System) -> float:
        """By how much more the actuator pushes in a ``system`` than in this one [N]."""
        if self._actuator is None:
            return 0.0
        return _actuator(system, self._actuator.name).force - self._actuator.force

    def assembled(self, start: Motion | None) -> Motion:
        """A motion that joints allow, near by, or near the data's if None."""
        return self._system.assemble(self._system.start() if start is None else start)

    def _law(self, time: float) -> Law:
        return Law(self._height, 0.0, 0.0)

    def lift(self, place: _Place, more: float) -> float:
        """Upward force at a place if the actuator pushes with so much ``more`` [N]; no number
        where that changes the place."""
        if not more:
            return place.lift
        if place.height not in self._gains:
            self._gains[place.height] = self._gain(place)
        return place.lift + more * self._gains[place.height]

    def _gain(self, place: _Place) -> float:
        """Upward force at a place per force of the actuator."""
        assert self._actuator is not None
        pull = gradient_of(self._actuator, place.motion)
        self._height = place.height
        free = null_space(self._held.constraints(place.motion, 0.0).jacobian)
        if np.abs(free.T @ pull).max(initial=0.0) > _NO_WORK * np.abs(pull).max():
            return np.nan
        return float(place.way @ pull)

    def from_near(self, height: float, near: _Place) -> _Place:
        """The system at rest with the point at a height [m], from a place near by."""
        if (found := self._places.get(float(height))) is not None:
            return found
        try:
            return self.to(height, near.motion.moved((height - near.height) * near.way))
        except (InputError, RunBroken):  # a way that turns soon leads nowhere
            return self.to(height, near.motion)

    def to(self, height: float, near: Motion) -> _Place:
        """The system at rest with the point at a height [m], assembled from a motion near by."""
        height = float(height)
        if height not in self._places:
            self._places[height] = self._found(height, near)
        return self._places[height]

    def _found(self, height: float, near: Motion) -> _Place:
        system, self._height = self._system, height
        motion = at_rest(self._held, near)
        jacobian = self._held.constraints(motion, 0.0).jacobian
        # Of all velocities with unit speed of the point those of least kinetic energy.
        root = np.sqrt(system.inverse_mass)
        unit_speed = np.append(np.zeros(len(jacobian) - 1), 1.0)
        way = root * least_squares(jacobian * root, unit_speed, 1e-8)
        lift = way @ system.generalised_forces(motion, 0.0)
        damping = lift - way @ system.generalised_forces(motion.with_velocities(way), 0.0)
        # The third of the six numbers of a body is its velocity upward.
        carried = system.mass[2::6] @ way[2::6]
        columns = np.array([system.mass @ way**2, damping, carried])
        return _Place(height, motion, columns, float(lift), way)


def _actuator(system: System, name: str) -> Actuator:
    found = system.force(name)
    assert isinstance(found, Actuator)
    return found


def _refined(raised: Raised, more: float, places: list[_Place], tolerance: float) -> list[_Place]:
    """Add places at heights in between where splines miss the lift, such as at stops.

    Splines through every second place are compared at the others, which costs no further place; one
    through all of them misses less. Where that is too much, places are put in between.
    """
    doubtful = _beside(_missed(raised, more, places[::2], places[1::2], tolerance), places)
    while doubtful:
        wide = [(low, high) for low, high in doubtful if high.height - low.height > 2.0 * FINEST]
        between = [raised.from_near(0.5 * (low.height + high.height), low) for low, high in wide]
        missed = _missed(raised, more, places, between, tolerance)
        places = sorted([*places, *missed], key=lambda place: place.height)
        doubtful = _beside(missed, places)
    return places


def _missed(
    raised: Raised, more: float, places: list[_Place], others: list[_Place], tolerance: float
) -> list[_Place]:
    """Places of ``others`` whose lift differs by over ``tolerance`` from a spline of ``places``."""
    lift = CubicSpline([p.height for p in places], [raised.lift(p, more) for p in places])
    expected = lift([place.height for place in others])
    return [
        place
        for place, value in zip(others, expected, strict=True)
        if abs(value - raised.lift(place, more)) > tolerance
    ]


def _beside(missed: list[_Place], places: list[_Place]) -> list[tuple[_Place, _Place]]:
    """Neighbours among ``places`` between which places that were missed change the spline: next to
    them and, by a quarter, one interval on."""
    heights = {place.height for place in missed}
    new = [k for k, place in enumerate(places) if place.height in heights]
    near = {i for k in new for i in range(max(k - 2, 0), min(k + 2, len(places) - 1))}
    return [(places[i], places[i + 1]) for i in sorted(near)]


class Head(NamedTuple):
    """The head on its arm: ``mass`` [kg], ``stiffness`` [N/m] and ``damping`` [N s/m] of what
    carries it, ``weight`` [N], ``offset`` [m] above the arm at rest without contact; ``roll`` about
    the track and ``pitch`` across it, None if its joints do not allow it."""

    mass: float
    stiffness: float
    damping: float
    weight: float
    offset: float
    roll: Turning | None = None
    pitch: Turning | None = None


@dataclass(frozen=True)
class RaisingData:
    """A head on a mechanism.

    ``frame``: mass, lift and damping over the arm's height above the base; ``base_height`` [m] of
    the base, in the line's heights. ``strips`` are part of the head. ``blown_head`` [N] is what the
    air on bodies lifts the head by, where it meets them as the frame's tables have it. ``laws``
    that are not linear act on head and arm besides; both are at the heights ``rest`` [m] where the
    static force holds.
    """

    frame: ReducedMechanism
    head: Head
    base_height: float = 0.0
    strips: Strips = ONE_STRIP
    blown_head: float = 0.0
    laws: tuple[head_laws.Law, ...] = ()
    rest: tuple[float, float] = (0.0, 0.0)


class RaisingPantograph(SteppedHead):
    """The equations above by Newmark's method, implicit in the contact forces.

    The mechanism's tables are taken at the predicted height and its lift is linear from there: an
    error of order dt^2 in coefficients, so that a step stays affine in the contact forces.

    Parameters
    ----------
    data : RaisingData
    stepping : Stepping
    air : forces of the air; without it there are none
    """

    def __init__(self, data: RaisingData, stepping: Stepping, air: AirForces | None = None) -> None:
        roll = data.head.roll if stepping.lateral is not None else None
        head = head_parts(*data.head[:3], data.strips, roll)
        super().__init__(head, head.n + 1, stepping, air is None or air.is_steady)
        self._air = air
        self._data, self._foot = data, data.base_height
        head_number = int(np.flatnonzero(head.level)[-1])
        self._put_laws(data.laws, (head_number, head.n), data.rest)
        self._masses = np.append(head.masses, 0.0)
        self._stiffness, self._damping = head.stiffness, head.damping
        self._carrier = head.n
        zero = data.head.offset + data.base_height
        self._mechanism = native.ReducedMechanism(data.frame.tables, data.head.weight, zero)
        self._step_by(self._on_springs(self._arrays))

    def _refuse(self, left: native.Head, time: float) -> None:
        # NaN is none: the coupling refuses it.
        raise self._data.frame.left(left.height, time)

    def _put_inputs(self, times: np.ndarray, rows: np.ndarray, lifts: np.ndarray | None) -> None:
        rows["part"] = self._part(times)
        if lifts is not None:
            rows["base"], rows["base_velocity"], rows["base_acceleration"] = lifts
        if self._air is not None:
            rows["head_air"], rows["arm_air"], rows["bodies_air"] = self._air.at(times).T
            rows["head_air"] += self._data.blown_head * rows["bodies_air"]
