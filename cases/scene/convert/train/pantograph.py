"""From a scene's tables of pantographs to the data of their models, in SI units."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from catenary.cases.scene.convert.train.aerodynamics import uplift_of
from catenary.cases.scene.convert.train.laws import laws_of
from catenary.cases.scene.tables.train.head import StripsTable
from catenary.cases.scene.tables.train.pantograph import MultibodyTable, PantographTable
from catenary.mbs.head.flexure import Flexure
from catenary.mbs.head.strips import Strips, Suspension, Turning
from catenary.mbs.library import READY
from catenary.mbs.lumped_data import LumpedData

if TYPE_CHECKING:
    from catenary.mbs.build import PantographData


def pantograph_of(
    name: str, table: PantographTable, speed_km_h: float, *, reversed: bool = False
) -> PantographData:
    """The data of a pantograph's model under way with a speed, which may run the other way round.

    Raises
    ------
    InputError
        Published numbers of a multibody pantograph are not allowed.
    """
    if isinstance(table, MultibodyTable):
        from catenary.cases.scene.convert.train.mechanism import multibody_of, turned

        data = replace(
            multibody_of(name, table, speed_km_h),
            uplift=uplift_of(table.aerodynamics, reversed),
            laws=laws_of(table.laws, 2),
        )
        return turned(data) if reversed else data
    spring, damper = table.stiffnesses_N_per_m[0], table.dampings_N_s_per_m[0]
    roll = table.roll
    return LumpedData(
        tuple(table.masses_kg),
        tuple(table.stiffnesses_N_per_m),
        tuple(table.dampings_N_s_per_m),
        strips_of(table.strips, spring, damper),
        None
        if roll is None
        else _turning(roll.inertia_kg_m2, roll.spring_distance_m, spring, damper),
        uplift_of(table.aerodynamics, reversed),
        laws_of(table.laws, len(table.masses_kg)),
    )


def strips_of(table: StripsTable, spring: float = 0.0, damper: float = 0.0) -> Strips:
    """Strips of a head whose own spring [N/m] and damper [N s/m] also hold its pitch."""
    suspension = pitch = None
    if table.mass_kg is not None and table.stiffness_N_per_m is not None:
        suspension = Suspension(table.mass_kg, table.stiffness_N_per_m, table.damping_N_s_per_m)
    inertia, distance = table.pitch_inertia_kg_m2, table.pitch_spring_distance_m
    if inertia is not None and distance is not None:
        pitch = _turning(inertia, distance, spring, damper)
    flexure = None
    if table.flexure is not None:
        own = table.flexure
        flexure = Flexure(
            own.bending_stiffness_N_m2, own.spring_distance_m, own.modes, own.damping_ratio
        )
    spacing = table.spacing_m or 0.0
    rake = math.radians(table.rake_deg)
    length = table.length_m
    return Strips(table.number, spacing, length, suspension, pitch, flexure=flexure, rake=rake)


def _turning(inertia: float, distance: float, spring: float, damper: float) -> Turning:
    """A head on two halves of its spring and damper at a distance [m] from each other."""
    square = (0.5 * distance) ** 2
    return Turning(inertia, spring * square, damper * square)


def static_force(name: str, table: PantographTable, speed_km_h: float) -> float | None:
    """Static force [N] at a speed, None if its table does not reach that speed.

    That of a multibody pantograph that is not calibrated follows from its mechanism.
    """
    if isinstance(table, MultibodyTable) and not table.calibrate:
        from catenary.cases.scene.convert.train.mechanism import multibody_of
        from catenary.mbs.mechanism.pantograph_data import stand

        return stand(multibody_of(name, table, speed_km_h)).static_force
    return wanted_force(table, speed_km_h)


def wanted_force(table: PantographTable, speed_km_h: float) -> float | None:
    """Static force [N] of a table at a speed, None if it has none for it."""
    if table.static_force_N is not None:
        return table.static_force_N
    if table.static_force_by_speed is None:
        ready = None if isinstance(table, MultibodyTable) else table.model
        return None if ready is None else READY[ready].force_at(speed_km_h)
    speeds, forces = np.array(table.static_force_by_speed).T
    if not speeds[0] <= speed_km_h <= speeds[-1]:
        return None
    return float(np.interp(speed_km_h, speeds, forces))
