"""Everything that a run is made of, in SI units, and what of it the run simulates.

``Problem`` is what a scene says once units are converted. ``Simulated`` are the laws, motions and
incidents that are simulated: data only, set by the effects.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from catenary.mbs.air import Tunnel
from catenary.mbs.vehicle import Vehicle, VehicleMotion
from catenary.meshgen.line import DropperPlace, Line
from catenary.meshgen.slowest_wave import slowest_wave
from catenary.meshgen.wires import Profile, Role, Wire
from catenary.solver.problem.contact_laws import ContactLaw
from catenary.solver.problem.defects import (
    Defect,
    Heights,
    Irregularities,
    LengthErrors,
    LineIncident,
    Surface,
    TensionLoss,
    WrongTension,
)
from catenary.solver.problem.ends import AlongTrack, EndCondition, Fixed, Tensioner
from catenary.solver.problem.wind import Wind

if TYPE_CHECKING:
    from catenary.mbs.build import PantographData
    from catenary.mbs.head.laws import Regulator
    from catenary.mbs.head.stepping import Lowering

OFF, EXACT, BOUNDED = "off", "exact", "bounded"
# Of motions in an exact window, in terms of the largest one: below that they are round-off.
ROUND_OFF = 1e-14
# Halvings of a step where the scene names no smallest one.
DEFAULT_HALVINGS = 5


@dataclass(frozen=True)
class Damping:
    """Proportional damping C = alpha K + beta M (paper, section 2).

    ``alpha`` [s] acts on stiffness, ``beta`` [1/s] on mass. ``per_component`` replaces both for
    the components that it names (wires and groups of droppers, arms and supports, by
    their names in the line) with a pair (alpha, beta), ``lateral`` for the motion of all wires
    across the track.
    """

    alpha: float
    beta: float
    per_component: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    lateral: tuple[float, float] | None = None


@dataclass(frozen=True)
class Placement:
    """A pantograph on the train.

    ``behind`` [m] is its distance behind the train's reference point (0 for the leading one),
    ``static_force`` [N] the force on the wire at rest at ``nominal_height`` [m] of the head;
    None stands for the mean height of the wire under the static force. ``lowering`` is how it is
    lowered on the way, with the effect of that name; ``regulator`` what regulates its lift, with
    the effect ``regulated_lift``: data, or what makes a controller of one's own.
    """

    data: PantographData
    static_force: float
    behind: float
    nominal_height: float | None = None
    lowering: Lowering | None = None
    regulator: Regulator | None = None


@dataclass(frozen=True)
class Train:
    """``speed`` [m/s]; ``start`` and ``end`` [m] of the leading pantograph; ``raise_time`` [s] in
    which the static force grows from zero to its value; ``vehicle`` is how the pantographs' bases
    move, with the effect ``vehicle_motion``; heads start ``start_below`` [m] below the wire at
    rest."""

    speed: float
    start: float
    end: float
    raise_time: float
    placements: tuple[Placement, ...]
    vehicle: VehicleMotion | None = None
    start_below: float = 0.0


@dataclass(frozen=True)
class WindowChoice:
    """Choice of the stations that move.

    ``mode`` is ``off`` (all), ``exact`` (all that any wave has reached) or ``bounded``: those whose
    motion exceeds ``tolerance`` times the largest one of the line, or those from ``spans_behind``
    behind the last pantograph to ``spans_ahead`` ahead of the first one. Both ends of the window
    are damped on mass, by ``fading`` [m2/s] over the square of their length. An ``optional`` one is
    left out where steps take on the whole line; another is refused there.
    """

    mode: str = OFF
    tolerance: float | None = None
    spans_ahead: float = 0.0
    spans_behind: float = 0.0
    fading: float = 0.0
    optional: bool = False

    @property
    def moves(self) -> bool:
        """Whether there is a window."""
        return self.mode != OFF

    @property
    def by_motion(self) -> float:
        """Share of the largest motion above which stations move, 0 if spans decide."""
        if self.mode == EXACT:
            return ROUND_OFF
        return self.tolerance or 0.0


@dataclass(frozen=True)
class Numerics:
    """Time step [s], scheme, integrator, tolerances of the fixed-point correction.

    ``integrator`` of the line is ``newmark`` with ``beta`` and ``gamma``, or ``hht`` or
    ``generalized_alpha`` with ``spectral_radius``; ``beta`` and ``gamma`` are also those of the
    pantographs, which step by Newmark's method always.

    ``scheme`` is ``one_solve`` or ``fixed_point`` (paper eqs. 2.4-2.7); ``eps_d`` [m] and
    ``eps_v`` [m/s] end its iteration, at most ``max_iterations`` times a step.
    ``coupling`` of ``one_solve`` is ``implicit``, ``iterated`` (until contact forces change by
    less than ``eps_force`` [N], at most ``max_iterations`` times) or ``explicit``. ``iterations``
    of ``fixed_point`` are done in every step whatever they reach; None iterates until it agrees.

    ``adaptive_tolerance`` [N] is the error of a contact force accepted in one step: steps are
    halved where they need it, down to ``smallest_dt`` [s]. None leaves all steps as they are.
    """

    dt: float
    scheme: str
    beta: float
    gamma: float
    eps_d: float
    eps_v: float
    max_iterations: int
    coupling: str = "implicit"
    eps_force: float = 1e-6
    integrator: str = "newmark"
    spectral_radius: float = 1.0
    iterations: int | None = None
    adaptive_tolerance: float | None = None
    smallest_dt: float | None = None


@dataclass(frozen=True)
class Problem:
    """One run. ``effects`` holds the names of the effects that are simulated, and no others.

    ``evaluation`` (from, to) [m] is the stretch whose statistics are judged;
    ``residual_stiffness_ratio`` is the share of its stiffness that a compressed dropper keeps;
    ``slack_dampers_act`` whether the damper of a dropper goes on acting when its spring is slack;
    ``irregularities`` and ``defects`` are what is wrong with the line from the start;
    ``incidents`` are what happens to the line on the way; ``ends`` how it begins and ends;
    ``window`` which part of it steps take on; ``tunnels`` and ``wind`` on the way; ``along`` what
    holds wires along the track.
    """

    line: Line
    damping: Damping
    contact: ContactLaw
    train: Train
    numerics: Numerics
    evaluation: tuple[float, float]
    residual_stiffness_ratio: float
    effects: frozenset[str]
    gravity: float = 9.81
    incidents: tuple[LineIncident, ...] = ()
    slack_dampers_act: bool = False
    ends: tuple[EndCondition, EndCondition] = (Fixed(), Fixed())
    window: WindowChoice = WindowChoice()
    tunnels: tuple[Tunnel, ...] = ()
    wind: Wind | None = None
    along: AlongTrack = AlongTrack()
    irregularities: Irregularities = Irregularities()
    defects: tuple[Defect, ...] = ()


def steps_of(problem: Problem) -> int:
    """Steps from the start of a run to its end."""
    train = problem.train
    return max(1, math.floor((train.end - train.start) / train.speed / problem.numerics.dt + 1e-9))


def n_halvings(dt: float, smallest: float | None) -> int:
    """Number of halvings of a step of ``dt`` that keep it no shorter than ``smallest`` [s]."""
    if smallest is None:
        return DEFAULT_HALVINGS
    return math.floor(math.log2(dt / smallest) + 1e-9)


def slowest_wave_speed(problem: Problem) -> float:
    """Slowest wave of the contact wires in a run, wrong and lost tensions included [m/s].

    ``problem`` is as a scene has it: its wires are those for which droppers are cut.
    """
    losses = [loss for loss in problem.incidents if isinstance(loss, TensionLoss)]
    wrong = [defect for defect in problem.defects if isinstance(defect, WrongTension)]
    shares = {
        wire.name: min((loss.share for loss in losses if loss.wire == wire.name), default=1.0)
        * min((defect.factor for defect in wrong if defect.wire == wire.name), default=1.0)
        for wire in problem.line.wires_of(Role.CONTACT)
    }
    return slowest_wave(problem.line, shares)


# Height [m] above ``Profile.height`` that a wire with a profile is to have at positions x [m].
TargetHeight = Callable[[Profile, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Simulated:
    """All of a run that is no matrix and no load; the defaults are a run without effects.

    `all_effects.simulated` makes it, each active effect setting its own fields.

    Attributes
    ----------
    contact : law of the contact; without its damping, unless an effect adds it
    gravity : of all masses [m/s2]; at 0 nothing has weight and droppers carry nothing at rest
    target_heights : functions whose sum is the height at rest of wires with a profile above
        ``Profile.base`` [m]
    damping : of the line's components
    added_alpha : by component the part of its alpha that is numerical damping [s]
    slackening : whether droppers slacken
    kept_ratio : share of its stiffness that a pushed dropper keeps; 1 if droppers do not slacken
    contact_loss : whether heads leave the wire; without it the contact force may pull
    head_roll : whether heads roll
    flexible_strips : whether strips bend
    raked_strips : whether strips may stand at an angle to the cross-section
    meets_air : whether the air has forces on pantographs
    pantograph_laws : whether laws of pantographs act that are not linear
    regulated_lift : whether lifts are regulated as their placements say
    wind : that blows on wires and pantographs, None in still air
    lowering : whether pantographs are lowered as their placements say
    vehicle : motion of the pantographs' bases, None if they move along a straight line
    suspension : of the vehicle between the track and these bases, None if they follow the track
    incidents : of the line, in the order of ``Problem.incidents``
    tensioner : at the ends of wires that have one, None if all are held along the track
    warmer : temperature less that of the installation [K]
    goes_on : whether the line goes on beyond its start and beyond its end
    lateral : whether wires move sideways
    relative_motion : whether twin wires move relative to each other; if not, they move as one
    uplift_stops : whether stops end the uplift at steady arms
    irregular_heights : added to the heights of contact wires at rest where they are held
    length_errors : of the droppers, None if all are cut to length
    missing, loose : places of droppers that are not there, and of those that carry nothing
    surface : running surfaces above the axes of the contact wires, each adding to the others
    """

    contact: ContactLaw
    gravity: float = 0.0
    target_heights: tuple[TargetHeight, ...] = ()
    damping: Damping = Damping(0.0, 0.0)
    added_alpha: Mapping[str, float] = field(default_factory=dict)
    slackening: bool = False
    kept_ratio: float = 1.0
    contact_loss: bool = False
    head_roll: bool = False
    flexible_strips: bool = False
    raked_strips: bool = False
    meets_air: bool = False
    pantograph_laws: bool = False
    regulated_lift: bool = False
    wind: Wind | None = None
    lowering: bool = False
    vehicle: VehicleMotion | None = None
    suspension: Vehicle | None = None
    incidents: tuple[LineIncident, ...] = ()
    tensioner: Tensioner | None = None
    warmer: float = 0.0
    goes_on: tuple[bool, bool] = (False, False)
    lateral: bool = False
    relative_motion: bool = False
    uplift_stops: bool = False
    irregular_heights: Heights | None = None
    length_errors: LengthErrors | None = None
    missing: tuple[DropperPlace, ...] = ()
    loose: tuple[DropperPlace, ...] = ()
    surface: tuple[Surface, ...] = ()

    def target_height(self, wire: Wire, x: np.ndarray) -> np.ndarray:
        """Height that a wire with a profile is to have at rest at positions ``x``, shape as x [m].

        ValueError if it has none.
        """
        if wire.profile is None:
            raise ValueError(f"nothing says at what height {wire.name} is to be held")
        height = wire.profile.base(x)
        for above in self.target_heights:
            height += above(wire.profile, x)
        if self.irregular_heights is not None and wire.role is Role.CONTACT:
            height += self.irregular_heights.at(wire.name, x)[0]
        return height
