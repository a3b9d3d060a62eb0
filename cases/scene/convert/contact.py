"""The contact law of a scene, in SI units."""

from __future__ import annotations

from catenary.cases.scene.tables.run.contact import HERTZ, ContactTable
from catenary.solver.problem.contact_laws import (
    HYSTERESIS,
    ContactLaw,
    HertzLaw,
    KinematicLaw,
    LinearLaw,
)

# Hertz's power for two bodies that touch in a point [-].
_EXPONENT = 1.5


def contact_law_of(table: ContactTable, static_force: float) -> ContactLaw:
    """The law of a table.

    ``static_force`` [N] is the force at which Hertz's spring has the secant ``stiffness_N_per_m``.
    """
    if table.law == "kinematic":
        return KinematicLaw()
    if table.law not in HERTZ:
        return LinearLaw(table.stiffness_N_per_m, table.damping_N_s_per_m)
    stiffness = table.hertz_stiffness_N_per_m1_5
    if stiffness is None:
        depth = static_force / table.stiffness_N_per_m
        stiffness = static_force / depth**_EXPONENT
    hysteresis = 0.0
    if table.restitution is not None:
        hysteresis = HYSTERESIS[table.law](table.restitution)
    return HertzLaw(stiffness, _EXPONENT, hysteresis, table.least_impact_speed_m_per_s)
