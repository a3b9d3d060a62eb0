"""Laws, motions and incidents that a run simulates: data only, set by its effects."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from catenary.mbs.vehicle.base_motion import VehicleMotion
from catenary.mbs.vehicle.suspension import Vehicle
from catenary.meshgen.line import DropperPlace
from catenary.meshgen.wires import Profile, Role, Wire
from catenary.solver.problem.contact_laws import ContactLaw
from catenary.solver.problem.ends import Tensioner
from catenary.solver.problem.incidents import LineIncident
from catenary.solver.problem.irregularities import Heights, LengthErrors, Surface
from catenary.solver.problem.problem import Damping
from catenary.solver.problem.wind import Wind

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
