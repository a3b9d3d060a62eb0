"""Ways to break a scene of any topology: nonsense in any key that scenes may have, a misspelt key,
or parts in three dimensions that contradict each other.
"""

from __future__ import annotations

import random
from functools import cache
from typing import NamedTuple

from scenes import Scene

from catenary.cases.scene.keys.keys import known_keys

# No value of any key, whatever its type.
_NO_VALUE = ("nan", "[nan]", "[[nan]]", "[[],3]", "{strange=nan}", "2026-01-01")
# Keys below which a scene may write nearly all it likes, until that is applied.
_FREE = ("test", "petsc")
_NAMES = {"pantographs": "reference", "per_component": "droppers", "weights_kg": "contact_wire"}


class Way(NamedTuple):
    """Assignments that break a scene, and a word that the sentence has to have."""

    assignments: tuple[str, ...]
    names: str


@cache
def all_keys() -> tuple[str, ...]:
    """Every key that scenes may have, with a name or the first entry where they choose."""
    return tuple(_named(key) for key in known_keys(Scene) if key.split(".")[0] not in _FREE)


def _named(key: str) -> str:
    parts = key.split(".")
    for i, part in enumerate(parts):
        if part == "*":
            parts[i] = _NAMES.get(parts[i - 1], "0")
    return ".".join(parts)


def nonsense(rng: random.Random, given: dict[str, str]) -> Way:
    """Nonsense in one of all keys, a strange key beside one, or one of the contradictions.

    Parameters
    ----------
    given : assignments of the scene
    """
    key = rng.choice(all_keys())
    kind = rng.random()
    if kind < 0.5:
        return Way((f"{key}={rng.choice(_NO_VALUE)}",), key.split(".")[0])
    if kind < 0.65:
        strange = f"{key}_{rng.randrange(100)}"
        return Way((f"{strange}=1.0",), strange.split(".")[0])
    return _contradiction(rng, given)


def _contradiction(rng: random.Random, given: dict[str, str]) -> Way:
    length = float(given["train.end_m"])
    x = rng.uniform(0.01, 0.99)
    flat = ("effects.lateral_motion=", "line.curve=", "line.messenger_stagger_m=")
    free = given.get("line.topology") == "'free'"
    diameters = () if free else _DIAMETERS
    ways = (
        # What acts only with lateral motion.
        Way((*flat, f"line.curve.radius_m={500 + 1e4 * x!r}"), "line.curve"),
        Way((*flat, f"line.messenger_stagger_m={x!r}"), "messenger_stagger_m"),
        # Curves.
        Way((f"line.curve.radius_m={99 * x!r}",), "line.curve.radius_m"),
        Way(("line.curve.radius_m=-3000",), "line.curve.radius_m"),
        Way(("line.curve={radius_m=3000,from_m=10}",), "line.curve"),
        Way((f"line.curve={{radius_m=3000,from_m={20 * x!r},to_m={19 * x!r}}}",), "line.curve"),
        Way((f"line.curve={{radius_m=3000,transition_m={1 + x!r}}}",), "line.curve"),
        Way((f"line.curve={{radius_m=3000,cant_mm={-x!r}}}",), "line.curve.cant_mm"),
        Way(("line.curve={radius_m=3000,side='up'}",), "line.curve.side"),
        Way(("effects.lateral_motion=true", f"line.stagger_m=[{x!r},{x!r}]"), "stagger_m"),
        # Along the track.
        Way(("effects.axial_motion=true", "line.ends.end.along='loose'"), "line.ends.end.along"),
        Way((f"line.tensioner.ratio={x!r}",), "line.tensioner.ratio"),
        Way((f"line.tensioner.efficiency={0.5 * x!r}",), "line.tensioner.efficiency"),
        Way((f"line.tensioner.travel_m={-x!r}",), "line.tensioner.travel_m"),
        Way((f"line.tensioner.weights_kg.strange={x!r}",), "line.tensioner.weights_kg.strange"),
        Way((f"line.temperature.difference_K={200 / x!r}",), "line.temperature.difference_K"),
        Way((f"line.mid_points_m=[{1 + x!r}]", "effects.axial_motion=true"), ""),
        Way((f"line.contact_wire.axial_stiffness_N={-x!r}",), "axial_stiffness_N"),
        # The wind.
        Way((f"wind={{speed_m_per_s={-x!r}}}",), "wind.speed_m_per_s"),
        Way((f"wind={{speed_m_per_s={80 + 100 * x!r}}}",), "wind.speed_m_per_s"),
        Way(("wind={speed_m_per_s=9,profile='power'}",), "wind"),
        Way((f"wind={{speed_m_per_s=9,exponent={x!r}}}",), "wind"),
        Way(("wind={speed_m_per_s=9,drag='cubic'}",), "wind.drag"),
        Way(("wind={speed_m_per_s=9,gusts={lowest_hz=1.0,highest_hz=0.5}}",), "wind.gusts"),
        Way(("wind={speed_m_per_s=9,gusts={spectrum='von_karman'}}",), "wind.gusts"),
        Way((f"wind={{speed_m_per_s=9,gusts={{length_scale_m={2 + x!r}}}}}",), "wind.gusts"),
        Way((f"wind={{speed_m_per_s=9,gusts={{turbulence_intensity={x!r},"
             f"friction_velocity_m_per_s={x!r}}}}}",), "wind.gusts"),
        Way(("wind={speed_m_per_s=9,stretches=[{from_m=20,to_m=10}]}",), "wind.stretches.0"),
        Way(("wind={speed_m_per_s=9,stretches=[{from_m=1e5,to_m=2e5}]}", *diameters),
            "wind.stretches.0"),
        # Arms and their stops.
        Way((f"line.steady_arm.uplift_stop_m={-x!r}",), "uplift_stop_m"),
        Way(("line.steady_arm.uplift_stop_m=", "line.steady_arm.uplift_stop_stiffness_N_per_m=1e5"),
            "uplift_stop"),
        Way((f"line.steady_arm.inclination_deg={31 + x!r}",), "inclination_deg"),
        Way(("line.steady_arm.inclination_deg=5", "line.steady_arm.holds_height=true"),
            "holds_height"),
        # Windows and ends.
        Way(("window={mode='exact',tolerance=1e-6}",), "window"),
        Way(("window={mode='bounded',spans_ahead=4}",), "window"),
        Way((f"window={{mode='bounded',spans_ahead={2 * x!r},spans_behind=4}}",), "window"),
        Way(("window.mode='exact'", "numerics.scheme='fixed_point'", "numerics.coupling="),
            "window.mode"),
        Way(("line.ends.end={kind='absorbing_layer',spans=9999}",), "line.ends.end.spans"),
        Way(("line.ends.start={kind='periodic',spans=3}",), "line.ends.start"),
        Way(("line.ends.start.kind='tensioner'",), "line.ends.start.kind"),
        Way(("line.ends.end.kind='dashpot'",), "line.ends.end.kind"),
        # Strips, heads, vehicles.
        Way(("pantographs.reference.strips={number=2,length_m=1.2}",), "strips"),
        Way((f"pantographs.reference.strips={{number={rng.choice([0, 3, 7])}}}",), "strips"),
        Way((f"pantographs.reference.roll={{inertia_kg_m2={-x!r},spring_distance_m=1}}",), "roll"),
        Way(("vehicle={lateral={amplitude_m=0.01}}", "effects.vehicle_motion=true"), "vehicle"),
        Way((f"vehicle={{vertical={{by_place=[[0,0],[{x!r},0.1]]}}}}",), "vehicle.vertical"),
        # Topologies.
        Way(("line.topology='quadruple'",), "line.topology"),
        Way((f"line.overlap={{first_span=1,rise_m={x!r}}}",), "line.overlap"),
        Way((f"line.overlap={{first_span=2,n_spans=9,rise_m={x!r}}}",), "line.overlap"),
        Way((f"line.transition.n_spans_end={given['line.n_spans']}",), "line"),
        Way((f"line.twin.spacing_m={-x!r}",), "line.twin"),
        # Irregularities, defects.
        Way((f"irregularities.running_surface.standard_deviation_mm={-x!r}",), "running_surface"),
        Way(("irregularities.contact_wire_height={standard_deviation_mm=1,seed=-1}",),
            "contact_wire_height"),
        Way((f"defects=[{{type='hard_spot',at_m={1e6 + length!r},mass_kg=1.0}}]",), "defects.0"),
        Way((f"defects=[{{type='worn_wire',from_m=1,to_m=2,lost_share={1 + x!r}}}]",), "defects.0"),
        Way(("defects=[{type='rust'}]",), "defects.0"),
        Way((f"line.fittings=[{{kind='splice',at_m={1e6 + length!r},mass_kg=1.0}}]",), "fittings"),
        # What nothing reads.
        Way(("numerics.scheme=", "numerics.coupling=", "numerics.iterations=",
             f"numerics.{rng.choice(['eps_d_m', 'eps_v_m_per_s', 'eps_force_N'])}=1e-3"), "eps_"),
        Way(("line.steady_arm={mass_kg_per_m=1.0}", "effects.arm_inertia="), "line.steady_arm"),
        Way(("irregularities.contact_wire_height={by_place=[[0,0],[1,0]],seed=3}",),
            "contact_wire_height"),
    )  # fmt: skip
    return rng.choice(ways)


# So that a wind finds what it needs on a line that has this table.
_DIAMETERS = ("line.contact_wire.diameter_mm=12.0",)
