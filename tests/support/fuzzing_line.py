"""What random lines and trains have besides the usual."""

from __future__ import annotations

import random

# --- words of a random scene ----------------------------------------------------------------------


Words = dict[str, object]
# Share of the scenes that have each of the parts that are drawn now and then.
NOW_AND_THEN = 0.2


def as_assignments(words: Words) -> tuple[str, ...]:
    """``key=value`` each."""
    return tuple(
        f"{key}={value if isinstance(value, str) else repr(value)}" for key, value in words.items()
    )


# --- what random lines have besides the usual -----------------------------------------------------


def wires(rng: random.Random, words: Words, span: float) -> None:
    """Messenger wire and contact height."""
    words["line.messenger_wire.mass_kg_per_m"] = rng.uniform(0.4, 1.5)
    words["line.messenger_wire.bending_stiffness_N_m2"] = rng.choice([0.0, rng.uniform(1.0, 300.0)])
    words["line.contact_height_m"] = rng.uniform(4.5, 7.0)


def spans(rng: random.Random, words: Words, span: float) -> None:
    """Two lengths in turn, with a pattern of droppers for each; the line gets longer by that."""
    other = span + rng.uniform(1.0, 10.0)
    words["line.span_m"] = [span, other]
    count = rng.randint(2, 6)
    del words["line.dropper.positions_m"]
    words["line.dropper.positions_m"] = ""
    words["line.dropper.patterns"] = "[" + ",".join(
        f"{{span_m={length!r},positions_m={_even(length, count)!r}}}" for length in (span, other)
    ) + "]"  # fmt: skip


def droppers(rng: random.Random, words: Words, span: float) -> None:
    """By their count, with a sag given at mid-span, as strands with a modulus."""
    if "line.dropper.patterns" in words:
        return
    count = rng.randint(2, 9)
    words["line.dropper.positions_m"] = ""
    words["line.dropper.count"] = count
    words["line.dropper.spacing_m"] = span / (count + rng.uniform(0.5, 1.5))
    sag = rng.uniform(-5.0, 30.0)
    if count > 2:  # of two there is none in between
        # Thousandths of a millimetre are taken for metres.
        words["line.dropper.pre_sag_mid_mm"] = sag if abs(sag) > 1.0 else 0.0
    strands(rng, words, "line.dropper")


def strands(rng: random.Random, words: Words, hung: str) -> None:
    """Droppers of a table as strands with a modulus, or with a curve that softens and stiffens."""
    stiffness = 10 ** rng.uniform(4.0, 6.3)
    own = random.Random(stiffness)
    words[f"{hung}.stiffness_N_per_m"] = ""
    if own.random() < 0.7:
        words[f"{hung}.axial_stiffness_N"] = stiffness
        return
    points = [[0.0, 0.0]]
    for _ in range(own.randint(1, 4)):
        tension = points[-1][1] + 10 ** own.uniform(0.7, 2.3)
        strain = (tension - points[-1][1]) / (stiffness * 10 ** own.uniform(-0.3, 0.7))
        points.append([points[-1][0] + strain, tension])
    words[f"{hung}.curve"] = points


def clamps(rng: random.Random, words: Words, span: float) -> None:
    """Masses of droppers and of their upper clamps."""
    words["line.dropper.mass_kg_per_m"] = rng.uniform(0.0, 0.3)
    words["line.dropper.messenger_clamp_kg"] = rng.uniform(0.0, 0.4)


def arms(rng: random.Random, words: Words, span: float) -> None:
    """Steady arms with masses, stops, and stiffness of their radial force."""
    words["line.steady_arm.length_m"] = rng.uniform(0.5, 1.5)
    words["line.steady_arm.mass_kg_per_m"] = rng.uniform(0.1, 2.0)
    words["line.steady_arm.clamp_kg"] = rng.uniform(0.0, 0.5)
    words["line.steady_arm.holds_height"] = rng.choice(["true", "false"])
    if rng.random() < 0.3:
        words["line.steady_arm.uplift_stop_m"] = rng.uniform(0.005, 0.15)
        words["line.steady_arm.uplift_stop_stiffness_N_per_m"] = 10 ** rng.uniform(3.0, 6.0)
    words["line.stagger_m"] = rng.uniform(-0.3, 0.3)
    if rng.random() < 0.3:
        words["line.steady_arm.stiffness_by_radial_force"] = "true"
        words["line.steady_arm.stiffness_N_per_m"] = 0.0


def damping(rng: random.Random, words: Words, span: float) -> None:
    """Damping of some components."""
    names = ("contact_wire", "messenger_wire", "droppers", "steady_arms", "supports")
    for name in rng.sample(names, rng.randint(1, 5)):
        values = (10 ** rng.uniform(-5, -2), rng.choice([0.0, rng.uniform(0.0, 0.1)]))
        words[f"line.damping.per_component.{name}"] = (
            f"{{alpha_s={values[0]!r},beta_per_s={values[1]!r}}}"
        )


def mesh(rng: random.Random, words: Words, span: float) -> None:
    """Finer elements at the supports, and beside all droppers."""
    finer = rng.randint(2, 4)
    words |= {"mesh.support_refinement": finer, "mesh.grading": 2.5 * finer}


def droppers_by_span(words: Words) -> list[int]:
    """How many droppers stand in each span."""
    count = words.get("line.dropper.count")
    if count is None:
        # Of patterns the last: they have as many each.
        places = words.get("line.dropper.patterns", words["line.dropper.positions_m"])
        count = str(places).rpartition("[")[2].count(",") + 1
    return [int(str(count))] * int(str(words["line.n_spans"]))


def wind(rng: random.Random, words: Words) -> None:
    """A steady wind, or gusts of few waves; further wires of topologies have a diameter."""
    for wire in ("contact_wire", "messenger_wire"):
        words[f"line.{wire}.diameter_mm"] = rng.uniform(5.0, 20.0)
    words["wind.speed_m_per_s"] = rng.uniform(1.0, 40.0)
    words["wind.direction_deg"] = rng.uniform(-180.0, 180.0)
    words["wind.drag"] = rng.choice(["'linear'", "'quadratic'"])
    if rng.random() < 0.5:
        words["wind.gusts.highest_hz"] = rng.uniform(0.1, 1.0)
        words["wind.gusts.seed"] = rng.randrange(1000)


def _even(span: float, count: int) -> list[float]:
    """Places of droppers, evenly."""
    return [round(span * (i + 0.5) / count, 3) for i in range(count)]


# --- what random trains have besides the usual ----------------------------------------------------


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
