"""A pantograph of a head on springs over a reduced raising mechanism, with the line's fixed step.

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

from dataclasses import dataclass

import numpy as np

from catenary.mbs.air import AirForces
from catenary.mbs.head.laws import Law
from catenary.mbs.head.pantograph import SteppedHead
from catenary.mbs.head.stepping import Stepping
from catenary.mbs.head.strips import ONE_STRIP, Strips, head_parts
from catenary.mbs.mechanism.multibody_pantograph import Head
from catenary.mbs.mechanism.reduction import ReducedMechanism
from catenary.solver.kernels import native


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
    laws: tuple[Law, ...] = ()
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
