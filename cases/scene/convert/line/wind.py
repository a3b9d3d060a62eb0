"""From a scene's table of the wind to its data, in SI units."""

from __future__ import annotations

from catenary.cases.scene.tables.run.wind import GustsTable, WindTable
from catenary.cases.scene.tables.units import angle_from_deg
from catenary.solver.problem.wind import Gusts, Profile, Stretch, Wind, friction_velocity_of


def wind_of(table: WindTable | None) -> Wind | None:
    """The wind of a scene, None if there is none or a calm."""
    if table is None or table.speed_m_per_s == 0.0:
        return None
    wind = Wind(
        speed=table.speed_m_per_s,
        direction=angle_from_deg(table.direction_deg),
        height=table.height_m,
        reference_height=table.reference_height_m,
        profile=Profile(table.roughness_length_m, table.exponent),
        density=table.air_density_kg_per_m3,
        quadratic=table.drag == "quadratic",
        stretches=tuple(
            Stretch(own.from_m, own.to_m, own.speed_factor, own.height_m) for own in table.stretches
        ),
    )
    if table.gusts is None:
        return wind
    return wind.with_gusts(_gusts(wind, table.gusts))


def _gusts(wind: Wind, table: GustsTable) -> Gusts:
    velocity = table.friction_velocity_m_per_s
    if table.turbulence_intensity is not None:
        velocity = friction_velocity_of(table.turbulence_intensity, wind.mean)
    return Gusts(
        friction_velocity=wind.friction_velocity if velocity is None else velocity,
        spectrum=table.spectrum,
        length_scale=table.length_scale_m or 0.0,
        decay=(table.decay, table.decay, table.decay_upward),
        lowest=table.lowest_hz,
        highest=table.highest_hz,
        spacing=table.spacing_m,
        growth=table.growth_s,
        seed=table.seed,
    )
