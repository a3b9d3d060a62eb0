"""From a scene's table of the vehicle to the motion of its pantographs' bases, in SI units."""

from __future__ import annotations

from catenary.cases.scene.tables.train.vehicle import (
    Course,
    MotionTable,
    SidewaysTable,
    SuspensionTable,
    VehicleTable,
)
from catenary.cases.scene.tables.units import angle_from_deg
from catenary.mbs.vehicle.base_motion import Harmonic, Source, Table, VehicleMotion
from catenary.mbs.vehicle.irregularity import Irregularity
from catenary.mbs.vehicle.suspension import Sideways, Vehicle


def vehicle_of(table: VehicleTable) -> VehicleMotion:
    """All that moves the bases, in both directions."""
    track = table.irregularity
    both: tuple[Source, ...] = ()
    if track is not None:
        both = (Irregularity(track.spectrum, track.shortest_m, track.longest_m, track.seed),)
    suspension = None if table.suspension is None else _suspension(table.suspension)
    vertical, lateral = _sources(table.vertical) + both, _sources(table.lateral) + both
    return VehicleMotion(vertical, lateral, suspension)


def _suspension(table: SuspensionTable) -> Vehicle:
    return Vehicle(
        mass=table.body_mass_kg,
        pitch_inertia=table.pitch_inertia_kg_m2,
        stiffness=table.stiffness_N_per_m,
        damping=table.damping_N_s_per_m,
        bogie_distance=table.bogie_distance_m,
        wheelbase=table.wheelbase_m,
        bogie_mass=table.bogie_mass_kg or 0.0,
        primary_stiffness=table.primary_stiffness_N_per_m or 0.0,
        primary_damping=table.primary_damping_N_s_per_m or 0.0,
        pantograph_ahead=table.pantograph_ahead_m,
        sideways=None if table.lateral is None else _sideways(table.lateral),
    )


def _sideways(table: SidewaysTable) -> Sideways:
    return Sideways(
        table.roll_inertia_kg_m2,
        table.stiffness_N_per_m,
        table.damping_N_s_per_m,
        table.spring_distance_m,
        table.centre_above_m,
        table.roof_above_m,
    )


def _sources(table: MotionTable | None) -> tuple[Source, ...]:
    if table is None:
        return ()
    found: list[Source] = []
    if table.by_time is not None:
        found.append(_table(table.by_time, along_track=False))
    if table.by_place is not None:
        found.append(_table(table.by_place, along_track=True))
    if table.amplitude_m is not None and table.frequency_hz is not None:
        phase = angle_from_deg(table.phase_deg)
        found.append(Harmonic(table.amplitude_m, table.frequency_hz, phase))
    return tuple(found)


def _table(pairs: Course, along_track: bool) -> Table:
    points, values = zip(*pairs, strict=True)
    return Table(points, values, along_track)
