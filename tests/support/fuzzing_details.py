"""What random scenes of any topology have now and then besides their planes: details of hardware,
of irregularities, of pantographs and vehicles, and effects that are left out.
"""

from __future__ import annotations

import random

from fuzzing_free import masts
from fuzzing_line import strands

Words = dict[str, object]
_NOW_AND_THEN = 0.2
_SPECTRA_OF_TRACKS = ("'fra_4'", "'fra_5'", "'fra_6'", "'german_low'", "'german_high'")
# Irregular heights by place: distance of the places and the most of a height [m].
_COURSES = (("contact_wire_height", 10.0, 0.01), ("running_surface", 0.5, 2e-4))
# Effects that a scene may leave out whatever it has.
_LEFT_OUT = (
    "arm_inertia", "arm_stiffness", "clamp_mass", "dropper_mass", "structural_damping", "gusts",
    "wind", "uplift_stops", "fittings", "contact_wire_height", "dropper_lengths", "missing_dropper",
    "running_surface", "loose_clamp", "worn_wire", "wrong_tension", "hard_spot", "kink", "pre_sag",
    "tensioners", "temperature", "transition_spans", "absorbing_layers", "periodic_ends",
    "pantograph_laws", "flexible_strips", "raked_strips", "regulated_lift", "vehicle_suspension",
    "pantograph_aerodynamics",
)  # fmt: skip


def put_details(rng: random.Random, words: Words) -> None:
    """Now and then each of the parts below."""
    for part in (_profiles, _cuts, _carriage, _clamps, _air_behind, _bogies, _sags):
        if rng.random() < _NOW_AND_THEN:
            part(rng, words)
    if rng.random() < _NOW_AND_THEN:
        words[f"effects.{rng.choice(_LEFT_OUT)}"] = "false"


def _profiles(rng: random.Random, words: Words) -> None:
    """Irregular heights by place, in place of random ones."""
    length = masts(words)[-1]
    name, step, most = rng.choice(
        (("contact_wire_height", 10.0, 0.01), ("running_surface", 0.5, 2e-4))
    )
    if any(key.startswith(f"irregularities.{name}") for key in words):
        return
    begin = rng.uniform(0.0, 0.5) * length
    places = [begin + i * step for i in range(8) if begin + i * step < length]
    pairs = [[x, rng.uniform(-most, most)] for x in places]
    if len(pairs) >= 4:
        pairs[0][1] = pairs[-1][1] = 0.0
        words[f"irregularities.{name}.by_place"] = pairs


def _cuts(rng: random.Random, words: Words) -> None:
    """Single errors of droppers' lengths, and where random ones are cut off."""
    key = "irregularities.dropper_lengths"
    if f"{key}.seed" in words:
        words[f"{key}.cut_off"] = rng.uniform(0.5, 4.0)
    elif words.get("line.dropper") != "":
        words[f"{key}.by_dropper"] = [[1, 1, rng.uniform(-20.0, 20.0)]]


def _carriage(rng: random.Random, words: Words) -> None:
    """What else a pantograph may have."""
    table = "pantographs.reference"
    words[f"{table}.nominal_height_m"] = rng.uniform(4.8, 5.4)
    if rng.random() < 0.5:
        words[f"{table}.static_force_N"] = ""
        words[f"{table}.static_force_by_speed"] = [[5.0, 60.0], [400.0, rng.uniform(60.0, 250.0)]]
    if f"{table}.strips.flexure.modes" in words:
        words[f"{table}.strips.flexure.damping_ratio"] = rng.uniform(0.0, 0.1)
    strips = f"{table}.strips"
    if f"{strips}.length_m" in words and f"{strips}.pitch_inertia_kg_m2" not in words:
        words[f"{strips}.rake_deg"] = rng.uniform(-20.0, 20.0)
        words["effects.raked_strips"] = rng.choice(["true", "false"])
    if f"{table}.regulation.measures" in words:
        words[f"{table}.regulation.from_s"] = rng.uniform(0.0, 0.5)
    if rng.random() < 0.5:
        at, most = rng.uniform(0.0, 0.05), rng.uniform(10.0, 1e4)
        words[f"{table}.laws"] = (
            f"[{{type='limiter',force_by_rise=[[{at!r},0.0],[{at + 0.1!r},{most!r}]]}},"
            f"{{type='damper',force_by_velocity=[[-1.0,{-rng.uniform(0, 300)!r}],[0.0,0.0],"
            f"[1.0,{rng.uniform(0, 300)!r}]]}},"
            f"{{type='friction',force_N=5.0,velocity_m_per_s={10 ** rng.uniform(-4, -1)!r}}}]"
        )


def _clamps(rng: random.Random, words: Words) -> None:
    """Stiffness and mass of clamps of further wires, fittings of a length."""
    for name in ("stitch_wire", "bridle"):
        if words.get(f"line.{name}"):
            words[f"line.{name}.clamp_stiffness_N_per_m"] = 10 ** rng.uniform(4.0, 8.0)
            words[f"line.{name}.clamp_kg"] = rng.uniform(0.0, 0.5)
    if words.get("line.auxiliary_wire"):
        for key, most in (("auxiliary_clamp_kg", 0.3), ("messenger_clamp_kg", 0.3),
                          ("mass_kg_per_m", 0.2)):  # fmt: skip
            words[f"line.auxiliary_wire.dropper.{key}"] = rng.uniform(0.0, most)
    if "line.fittings" in words:
        words["line.fittings.0.length_m"] = rng.uniform(0.0, 3.0)
        if rng.random() < 0.3 and words.get("line.messenger_wire") != "":
            words["line.fittings.0.wire"] = "'messenger_wire'"


def _sags(rng: random.Random, words: Words) -> None:
    """Pre-sags by dropper, and what else hangs an auxiliary wire."""
    places = words.get("line.dropper.positions_m")
    patterns = str(words.get("line.dropper.patterns", ""))
    if isinstance(places, list):
        words["line.dropper.pre_sag_mm"] = [rng.uniform(0.0, 8.0) for _ in places]
    elif patterns:
        count = patterns.partition("positions_m=[")[2].partition("]")[0].count(",") + 1
        sags = [rng.uniform(0.0, 8.0) for _ in range(count)]
        words["line.dropper.patterns"] = patterns.replace("}", f",pre_sag_mm={sags!r}}}")
    hung = "line.auxiliary_wire.dropper"
    if not words.get("line.auxiliary_wire"):
        return
    if rng.random() < 0.5:
        strands(rng, words, hung)
    if "patterns" in str(words["line.auxiliary_wire"]):
        words[f"{hung}.patterns.0.pre_sag_mm"] = [0.0] * (
            str(words["line.auxiliary_wire"])
            .partition("positions_m=[")[2]
            .partition("]")[0]
            .count(",")
            + 1
        )
    elif not isinstance(words["line.span_m"], list) and rng.random() < 0.5:
        count = rng.randint(1, 5)
        words[f"{hung}.positions_m"] = ""
        words[f"{hung}.count"] = count
        words[f"{hung}.spacing_m"] = float(str(words["line.span_m"])) / (count + 1.0)


def _air_behind(rng: random.Random, words: Words) -> None:
    """A pantograph that runs the other way round has an uplift of its own."""
    table = "pantographs.reference.aerodynamics"
    if f"{table}.head_share" not in words:
        return
    words[f"{table}.reversed.head_share"] = rng.uniform(0.0, 1.0)
    if rng.random() < 0.5:
        words[f"{table}.reversed.uplift_polynomial"] = [0.0, 0.0, rng.uniform(0.0, 2e-3)]
    else:
        words[f"{table}.reversed.uplift_by_speed"] = [[50.0, 2.0], [300.0, rng.uniform(9, 90)]]
    words["train.pantographs.0.reversed"] = "true"


def _bogies(rng: random.Random, words: Words) -> None:
    """A track of any spectrum; a car body that also sways, if there is one."""
    if "vehicle.irregularity.spectrum" in words:
        words["vehicle.irregularity.spectrum"] = rng.choice(_SPECTRA_OF_TRACKS)
        shortest = float(str(words["vehicle.irregularity.shortest_m"]))
        words["vehicle.irregularity.longest_m"] = shortest * rng.uniform(1.5, 20.0)
    table = "vehicle.suspension"
    if f"{table}.body_mass_kg" not in words:
        return
    mass = float(str(words[f"{table}.body_mass_kg"]))
    words[f"{table}.lateral.roll_inertia_kg_m2"] = mass * rng.uniform(0.5, 2.0)
    words[f"{table}.lateral.stiffness_N_per_m"] = 10 ** rng.uniform(4.5, 6.0)
    words[f"{table}.lateral.damping_N_s_per_m"] = 10 ** rng.uniform(3.0, 5.0)
    words[f"{table}.lateral.spring_distance_m"] = rng.uniform(1.5, 2.5)
    words[f"{table}.lateral.centre_above_m"] = rng.uniform(0.0, 1.0)
    words[f"{table}.lateral.roof_above_m"] = rng.uniform(0.5, 3.0)
