"""From a scene's tables of pantographs to the data of their models, in SI units."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from catenary.cases.scene.convert.train.aerodynamics import uplift_of
from catenary.cases.scene.convert.train.head import strips_of, turning_of
from catenary.cases.scene.convert.train.laws import laws_of
from catenary.cases.scene.convert.train.static_force import wanted_force
from catenary.cases.scene.tables.train.pantograph import MultibodyTable, PantographTable
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
            crosswind_factor=table.crosswind_factor,
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
        else turning_of(roll.inertia_kg_m2, roll.spring_distance_m, spring, damper),
        uplift_of(table.aerodynamics, reversed),
        laws_of(table.laws, len(table.masses_kg)),
        table.crosswind_factor,
    )


def static_force(name: str, table: PantographTable, speed_km_h: float) -> float | None:
    """Static force [N] at a speed, None if its table does not reach that speed.

    That of a multibody pantograph that is not calibrated follows from its mechanism.
    """
    if isinstance(table, MultibodyTable) and not table.calibrate:
        from catenary.cases.scene.convert.train.mechanism import multibody_of
        from catenary.mbs.mechanism.pantograph_data import stand

        return stand(multibody_of(name, table, speed_km_h)).static_force
    return wanted_force(table, speed_km_h)
