"""Wires over a canted track in a curve, in whose plane heights and lateral positions are measured.

A wire between two masts is a parabola in an upright plane over the chord, which lies inside of the
curve by d = s (L - s) / 2R. With the cant angle p its place in the canted plane follows from a
rotation, whatever equations are solved there: heights h - sag cos p + d sin p, lateral positions
d cos p + sag sin p.
"""

from __future__ import annotations

import numpy as np
import pytest
from measuring import check

import catenary

RADIUS, CANT, RAILS, SPAN, N_SPANS = 400.0, 150.0, 1500.0, 30.0, 6
MASS, TENSION = 0.95, 10e3
TILT = np.arcsin(CANT / RAILS)


def bare_wire(side: str, wind: float) -> catenary.Scene:
    """A string from bracket to bracket, none of which gives, above the axis of the canted track."""
    return catenary.load("tramway", short=True).replace(
        {
            "line.n_spans": N_SPANS,
            "line.stagger_m": 0.0,
            "line.curve": {"radius_m": RADIUS, "side": side, "cant_mm": CANT},
            "line.contact_wire.bending_stiffness_N_m2": 0.0,
            "line.contact_wire.diameter_mm": 12.0,
            "line.support.stiffness_N_per_m": 1e8,
            "line.steady_arm.clamp_kg": 0.0,
            "pantographs.two_masses.strips.length_m": 1.2,
            "wind": {"speed_m_per_s": wind, "height_m": 10.0},
            "evaluation.from_m": 65.0,
            "evaluation.to_m": 110.0,
            "mesh.elements_per_gap": 120,  # round kinks at masts off, by 1e-3 m
            "train.start_m": 31.0,
            "train.end_m": 170.0,
            "effects.lateral_motion": True,
        }
    )


@pytest.mark.parametrize("wind", [0.0, 20.0])
@pytest.mark.parametrize("side", ["left", "right"])
def test_a_string_between_masts_is_where_its_parabola_is(side: str, wind: float) -> None:
    """Weights and curvature are taken as they are along the canted plane, not with the cosine of
    the cant, 0.995: 0.005 of sag and d. The curve makes 28 mm of height at mid-span."""
    wires = catenary.static(bare_wire(side, wind)).contact_wires
    x, z, y = (wires[name].to_numpy() for name in ("x_m", "height_m", "y_m"))
    # Elements round off the kinks at masts.
    inner = np.abs(x % SPAN - SPAN / 2) < SPAN / 3
    x, z, y = x[inner], z[inner], y[inner]
    s = x % SPAN
    parabola = s * (SPAN - s) / 2
    towards = 1.0 if side == "left" else -1.0
    pressure = 0.5 * 1.225 * wind**2 * 0.012 * 1.2
    # In the frame of the ground, from the chord: towards the centre, and down.
    inside = parabola * (1 / RADIUS + towards * pressure / TENSION)
    down = parabola * MASS * 9.81 / TENSION
    height = 5.5 + inside * np.sin(TILT) - down * np.cos(TILT)
    level = towards * (inside * np.cos(TILT) + down * np.sin(TILT))
    # What the brackets give: the weight of a span over 1e8 N/m, some micrometres.
    left_out = (1 - np.cos(TILT)) * (np.abs(inside) + down).max() + 1e-5
    check("height [m]", z, height, within=left_out)
    check("to the left [m]", y, level, within=left_out)
    assert (inside * np.sin(TILT)).max() > 8 * left_out


def test_droppers_carry_what_the_tension_does_not() -> None:
    """Where droppers hold a contact wire level along the canted track, its tension lifts it by
    T sin p / R a length: of the middle span they carry that much less than on a straight track."""

    def carried(curve: dict[str, object] | None) -> float:
        scene = catenary.load("ac_simple_3d", short=True)
        line = {"n_spans": 16, "stagger_m": [0.0] * 17, "curve": curve}
        arm = {"length_m": 0.0, "mass_kg_per_m": None, "inclination_deg": None}
        droppers = catenary.static(scene.replace(line=line | {"steady_arm": arm})).droppers
        # Upwards, of droppers that lean by up to 0.3 m in 1 m.
        return float(droppers[droppers.span == 8].force_N.sum())

    straight, curved = carried(None), carried({"radius_m": 1000.0, "cant_mm": 100.0})
    less = 22e3 * 55.0 / 1000.0 * 100.0 / RAILS
    print(straight, curved, less)
    check("less on all droppers [N]", straight - curved, less, within=0.1 * less)
