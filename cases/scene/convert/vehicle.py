"""From a scene's table of the vehicle to the motion of its pantographs' bases, in SI units."""

from __future__ import annotations

from catenary.cases.scene.tables.train.vehicle import Course, MotionTable, VehicleTable
from catenary.cases.scene.tables.units import angle_from_deg
from catenary.mbs.vehicle.irregularity import Irregularity
from catenary.mbs.vehicle.motion_sources import Harmonic, Source, Table, VehicleMotion


def vehicle_of(table: VehicleTable) -> VehicleMotion:
    """All that moves the bases, in both directions."""
    track = table.irregularity
    both: tuple[Source, ...] = ()
    if track is not None:
        both = (Irregularity(track.spectrum, track.shortest_m, track.longest_m, track.seed),)
    return VehicleMotion(_sources(table.vertical) + both, _sources(table.lateral) + both)


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
