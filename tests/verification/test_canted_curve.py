"""Wires over a canted track in a curve, in whose plane heights and lateral positions are measured.

A wire between two masts is a parabola in an upright plane over the chord, which lies inside of the
curve by d = s (L - s) / 2R. With the cant angle p its place in the canted plane follows from a
rotation, whatever equations are solved there: heights h - sag cos p + d sin p, lateral positions
d cos p + sag sin p. Where the cant begins and ends the track twists, and so does that plane: a wire
that is straight in space is not where the track has its axis.
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


def seen_from_the_track(
    x: np.ndarray, stagger: np.ndarray, tension: float, curve: dict[str, float], towards: float
) -> tuple[np.ndarray, np.ndarray]:
    """Height above and place to the left of a track of a string between its masts, (n,) each [m].

    In space: the track is a clothoid and an arc in plan, masts stand square on it, and wires are
    parabolas in upright planes between them, which are looked for in the plane across the track at
    each of the places ``x`` (n,) along it [m]. All plans are complex numbers.
    """
    along = np.linspace(0.0, SPAN * N_SPANS, 180_001)

    def integral(rate: np.ndarray) -> np.ndarray:
        steps = 0.5 * (rate[1:] + rate[:-1]) * np.diff(along)
        return np.concatenate([[0.0], np.cumsum(steps)])

    inside = np.minimum(along - curve["from_m"], curve["to_m"] - along)
    share = np.clip(inside / curve["transition_m"], 0.0, 1.0)
    heading = np.exp(1j * integral(towards * share / curve["radius_m"]))
    roll = towards * share * np.arcsin(curve["cant_mm"] / RAILS)
    track = integral(heading)

    def at(place: np.ndarray, values: np.ndarray) -> np.ndarray:
        return np.interp(place, along, values)

    masts = SPAN * np.arange(N_SPANS + 1)
    aside = stagger * np.cos(at(masts, roll)) + 5.5 * np.sin(at(masts, roll))
    foot = at(masts, track) + 1j * at(masts, heading) * aside
    top = 5.5 * np.cos(at(masts, roll)) - stagger * np.sin(at(masts, roll))
    span = np.minimum(x // SPAN, N_SPANS - 1).astype(int)
    chord = np.diff(foot)[span]
    back = np.conj(at(x, heading))
    share = ((at(x, track) - foot[span]) * back).real / (chord * back).real
    left = ((foot[span] + share * chord - at(x, track)) * back).imag
    sag = MASS * 9.81 / tension * abs(chord) ** 2 * share * (1.0 - share) / 2.0
    up = top[span] + share * np.diff(top)[span] - sag
    turned = (left + 1j * up) * np.exp(1j * at(x, roll))
    return turned.imag, turned.real


@pytest.mark.parametrize("factor", [1.0, 0.8])
@pytest.mark.parametrize("side", ["left", "right"])
def test_a_string_over_a_track_that_twists_is_straight_in_space(side: str, factor: float) -> None:
    """Transitions begin and end within spans. Also where the wire hangs with a tension that it is
    not cut for, which moves what is straight nowhere."""
    curve = {"radius_m": 1000.0, "cant_mm": 100.0}
    curve |= {"from_m": 41.0, "to_m": 165.0, "transition_m": 60.0}
    stagger = np.resize([0.2, -0.2], N_SPANS + 1)
    changes = {
        "line.curve": {"side": side} | curve,
        "line.stagger_m": stagger.tolist(),
        "defects": [{"type": "wrong_tension", "wire": "contact_wire", "factor": factor}],
    }
    wires = catenary.static(bare_wire(side, 0.0).replace(changes)).contact_wires
    x, z, y = (wires[name].to_numpy() for name in ("x_m", "height_m", "y_m"))
    inner = np.abs(x % SPAN - SPAN / 2) < SPAN / 3
    x, z, y = x[inner], z[inner], y[inner]
    towards = 1.0 if side == "left" else -1.0
    height, level = seen_from_the_track(x, stagger, TENSION * factor, curve, towards)
    # As on a track that does not twist, and elements that round kinks off at their ends.
    sag = SPAN**2 / 8 * (1 / 1000.0 + MASS * 9.81 / (TENSION * factor))
    left_out = (1 - np.cos(np.arcsin(100.0 / RAILS))) * sag + 0.5e-3
    check("height [m]", z, height, within=left_out)
    check("to the left [m]", y, level, within=left_out)
    # What a wire that is level and straight above the axis would be off by.
    flat = curve | {"cant_mm": 0.0}
    assert np.abs(level - seen_from_the_track(x, stagger, TENSION, flat, towards)[1]).max() > 0.04


def test_droppers_keep_wires_together_over_a_track_that_twists() -> None:
    """In the plan of the ground each span has chords from dropper to dropper, which pull the wires
    together by their tension over their length."""
    span, n, tensions, cant = 55.0, 16, np.array([[16e3], [22e3]]), 100.0
    curve = {"radius_m": 1e5, "cant_mm": cant}
    curve |= {"from_m": 247.5, "to_m": 800.0, "transition_m": 60.0}
    arm = {"length_m": 0.0, "mass_kg_per_m": None, "inclination_deg": None}
    line = {"n_spans": n, "stagger_m": 0.0, "curve": {"side": "left"} | curve, "steady_arm": arm}
    for wire in ("contact_wire", "messenger_wire"):
        line[wire] = {"bending_stiffness_N_m2": 0.0}
    rest = catenary.static(catenary.load("ac_simple_3d", short=True).replace(line=line))
    wire, droppers = rest.contact_wires, rest.droppers

    def share(x: np.ndarray) -> np.ndarray:
        inside = np.minimum(x - curve["from_m"], curve["to_m"] - x)
        return np.asarray(np.clip(inside / curve["transition_m"], 0.0, 1.0))

    def roll(x: np.ndarray) -> np.ndarray:
        return share(x) * np.arcsin(cant / RAILS)

    for number in (5, 6, 14):  # the transition begins, ends, and that behind the curve does
        mine = droppers[droppers.span == number]
        x = np.concatenate([[number - 1], mine.x_m / span, [number]]) * span
        pull = mine.force_N.to_numpy() / mine.length_m.to_numpy()
        # At masts the wires, upper and lower, are above the axis.
        held = np.array([[6.28], [5.08]]) * np.sin(roll(x[[0, -1]]))
        taut = tensions / np.diff(x)
        k = len(mine)
        matrix, load = np.zeros((2 * k, 2 * k)), np.zeros(2 * k)
        for plane in (0, 1):
            own, t = slice(plane * k, (plane + 1) * k), taut[plane]
            matrix[own, own] = np.diag(t[1:] + t[:-1] + pull)
            matrix[own, own] -= np.diag(t[1:-1], 1) + np.diag(t[1:-1], -1)
            matrix[own, (1 - plane) * k : (2 - plane) * k] = -np.diag(pull)
            load[own] = tensions[plane] / 1e5 * share(x[1:-1]) * (x[2:] - x[:-2]) / 2
            load[own][[0, -1]] += t[[0, -1]] * held[plane]
        left = np.linalg.solve(matrix, load)[k:]
        x = x[1:-1]
        height, y = (np.interp(x, wire.x_m, wire[name]) for name in ("height_m", "y_m"))
        expected = (left - height * np.sin(roll(x))) / np.cos(roll(x))
        # Elements of 0.72 m round kinks of up to 5 mrad off, by 0.12 of their length. A wire that
        # is straight above the axis would be at zero.
        check("to the left [m]", y, expected, within=0.5e-3)
        assert np.abs(expected).max() > 0.02
