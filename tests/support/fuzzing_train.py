"""What random trains have besides the usual: strips, laws, regulation, air, vehicle, two kinds.

Each function puts its keys into the words of a scene that is valid and leaves it valid.
"""

from __future__ import annotations

import random

from fuzzing_words import Words


def second_kind(rng: random.Random, words: Words, span: float) -> None:
    """A train of two kinds of pantographs, if there are several."""
    placed = str(words["train.pantographs"])
    if placed.count("name=") < 2:
        return
    first, others = placed.split(",{", 1)
    words["train.pantographs"] = f"{first},{{{others.replace('reference', 'other', 1)}"
    table = "pantographs.other"
    if rng.random() < 0.3:
        words[f"{table}.model"] = rng.choice(["'dsa380'", "'en50318_2002'", "'ambrosio2012'"])
        return
    words[f"{table}.masses_kg"] = [10 ** rng.uniform(-0.3, 1.3), 10 ** rng.uniform(-0.3, 1.3)]
    words[f"{table}.stiffnesses_N_per_m"] = [10 ** rng.uniform(2.5, 4.3), rng.uniform(0.0, 500.0)]
    words[f"{table}.dampings_N_s_per_m"] = [rng.uniform(0.0, 150.0), rng.uniform(0.0, 150.0)]
    words[f"{table}.static_force_N"] = rng.uniform(20.0, 300.0)


def strips(rng: random.Random, words: Words) -> None:
    """Two strips, now and then on springs of their own, and a head that may roll."""
    table = "pantographs.reference"
    masses = words[f"{table}.masses_kg"]
    assert isinstance(masses, list)
    words[f"{table}.strips.number"] = 2
    words[f"{table}.strips.length_m"] = 1.2
    words[f"{table}.strips.spacing_m"] = rng.uniform(0.2, 0.45)
    if rng.random() < 0.5:
        words[f"{table}.strips.mass_kg"] = rng.uniform(0.1, 0.4) * masses[0]
        words[f"{table}.strips.stiffness_N_per_m"] = 10 ** rng.uniform(3.0, 4.5)
        words[f"{table}.strips.damping_N_s_per_m"] = rng.choice([0.0, rng.uniform(1.0, 50.0)])
        if rng.random() < 0.5:
            words[f"{table}.strips.flexure.bending_stiffness_N_m2"] = 10 ** rng.uniform(1.0, 4.0)
            words[f"{table}.strips.flexure.spring_distance_m"] = rng.uniform(0.1, 1.2)
            words[f"{table}.strips.flexure.modes"] = rng.randint(1, 6)
            words["line.stagger_m"] = rng.uniform(-0.3, 0.3)
    if len(masses) > 1 and rng.random() < 0.5:
        words[f"{table}.strips.pitch_inertia_kg_m2"] = rng.uniform(0.05, 1.0)
        words[f"{table}.strips.pitch_spring_distance_m"] = rng.uniform(0.2, 0.6)
    elif rng.random() < 0.5:
        words[f"{table}.strips.rake_deg"] = rng.uniform(-20.0, 20.0)
    if len(masses) > 1 and rng.random() < 0.5:
        inertia, distance = rng.uniform(0.5, 5.0), rng.uniform(0.5, 1.2)
        words[f"{table}.roll"] = f"{{inertia_kg_m2={inertia!r},spring_distance_m={distance!r}}}"
        words["line.stagger_m"] = rng.uniform(-0.3, 0.3)
        words["effects.head_roll"] = "true"


def vehicle(rng: random.Random, words: Words) -> None:
    """A base that follows a sine, or an irregular track whose waves the steps resolve."""
    words["effects.vehicle_motion"] = "true"
    shortest = max(
        3.0, 8.5 * float(str(words["train.speed_km_h"])) / 3.6 * float(str(words["numerics.dt_s"]))
    )
    if shortest < 50.0 and rng.random() < 0.5:
        words["vehicle.irregularity.spectrum"] = rng.choice(["'fra_5'", "'german_low'"])
        words["vehicle.irregularity.shortest_m"] = shortest
        words["vehicle.irregularity.seed"] = rng.randrange(1000)
        if rng.random() < 0.5:
            _suspension(rng, words)
        return
    words["vehicle.vertical.amplitude_m"] = rng.uniform(1e-3, 0.03)
    words["vehicle.vertical.frequency_hz"] = rng.uniform(0.3, 5.0)
    words["vehicle.vertical.phase_deg"] = rng.uniform(-180.0, 180.0)


def nonlinear_laws(rng: random.Random, words: Words) -> None:
    """Some laws that are not linear, on any mass."""
    masses = words["pantographs.reference.masses_kg"]
    assert isinstance(masses, list)
    laws = []
    for _ in range(rng.randint(1, 3)):
        at = f"at_mass={rng.randint(1, len(masses))}"
        up, down = (rng.choice([0.0, 10 ** rng.uniform(0.0, 3.0)]) for _ in range(2))
        laws.append(
            rng.choice(
                (
                    f"{{type='limiter',{at},rise_m={rng.uniform(0.0, 0.1)!r},"
                    f"stiffness_N_per_m={10 ** rng.uniform(2.0, 7.0)!r}}}",
                    f"{{type='damper',{at},up_N_s_per_m={up!r},down_N_s_per_m={down!r}}}",
                    f"{{type='friction',{at},force_N={rng.uniform(0.1, 30.0)!r}}}",
                    f"{{type='spring',{at},force_by_extension="
                    f"[[-0.1,{-3.0 - rng.uniform(0.0, 900.0)!r}],[-0.02,-3.0],[0.05,0.0]]}}",
                )
            )
        )
    words["pantographs.reference.laws"] = f"[{','.join(laws)}]"


def regulation(rng: random.Random, words: Words) -> None:
    """A regulated lift, stable or not; its limits keep it sound."""
    sample = float(str(words["numerics.dt_s"])) * rng.uniform(1.0, 20.0)
    table = "pantographs.reference.regulation"
    height = rng.random() < 0.5
    words[f"{table}.measures"] = "'head_height'" if height else "'contact_force'"
    words[f"{table}.target"] = rng.uniform(4.8, 5.5) if height else rng.uniform(50.0, 200.0)
    scale = 1e3 if height else 1.0
    gains = ",".join(
        f"{{at={at!r},error={scale * rng.uniform(0.0, 0.5)!r},"
        f"integral_per_s={scale * rng.uniform(0.1, 5.0)!r},rate_s={scale * 1e-3 * rng.random()!r}}}"
        for at in ((4.0, 6.0) if height else (0.0, 150.0))
    )
    words[f"{table}.gains"] = f"[{gains}]"
    words[f"{table}.sample_s"] = sample
    words[f"{table}.delay_s"] = rng.choice([0, 1, 5]) * sample
    words[f"{table}.filter_s"] = rng.choice([0.0, 20.0 * sample])
    words[f"{table}.least_N"], words[f"{table}.most_N"] = -15.0, rng.uniform(5.0, 60.0)


def _suspension(rng: random.Random, words: Words) -> None:
    """A car body between the track and the base, with bogies of their own now and then."""
    table = "vehicle.suspension"
    words[f"{table}.body_mass_kg"] = rng.uniform(1e4, 6e4)
    words[f"{table}.pitch_inertia_kg_m2"] = rng.uniform(5e5, 3e6)
    words[f"{table}.stiffness_N_per_m"] = 10 ** rng.uniform(5.3, 6.5)
    words[f"{table}.damping_N_s_per_m"] = 10 ** rng.uniform(3.0, 5.5)
    words[f"{table}.bogie_distance_m"] = rng.uniform(6.0, 20.0)
    words[f"{table}.wheelbase_m"] = rng.uniform(1.8, 3.0)
    words[f"{table}.pantograph_ahead_m"] = rng.uniform(-10.0, 10.0)
    if rng.random() < 0.5:
        words[f"{table}.bogie_mass_kg"] = rng.uniform(1e3, 6e3)
        words[f"{table}.primary_stiffness_N_per_m"] = 10 ** rng.uniform(6.0, 7.3)
        words[f"{table}.primary_damping_N_s_per_m"] = 10 ** rng.uniform(3.0, 5.0)


def air(rng: random.Random, words: Words) -> None:
    """Uplift by a polynomial or a table, now and then in a tunnel."""
    table = "pantographs.reference.aerodynamics"
    if rng.random() < 0.5:
        words[f"{table}.uplift_polynomial"] = [0.0, rng.uniform(0.0, 0.01), rng.uniform(0.0, 2e-3)]
    else:
        words[f"{table}.uplift_by_speed"] = [[50.0, rng.uniform(0, 9)], [300.0, rng.uniform(9, 90)]]
    words[f"{table}.head_share"] = rng.uniform(0.0, 1.0)
    apart = random.Random(str(words[f"{table}.head_share"]))
    if apart.random() < 0.5:
        words["pantographs.reference.crosswind_factor"] = apart.uniform(0.0, 1.0)
    if rng.random() < 0.5:
        start, end = (float(str(words[f"train.{name}_m"])) for name in ("start", "end"))
        first, factor = start + rng.uniform(0.0, 1.0) * (end - start), rng.uniform(0.8, 2.0)
        words["line.tunnels"] = (
            f"[{{from_m={first!r},to_m={start + 500.0!r},force_factor={factor!r},"
            f"portal_m={rng.choice([0.0, 20.0])!r}}}]"
        )
