"""What random scenes have besides the usual: each part of the schema now and then, from a seed.

Each function puts its keys into the words of a scene that is sound and leaves it sound.
"""

from __future__ import annotations

import random

from fuzzing_defects import put_defects
from fuzzing_incidents import put_incidents
from fuzzing_numerics import is_second_opinion, put_numerics

Words = dict[str, object]
# Share of the scenes that have each of these.
_NOW_AND_THEN = 0.2
# Droppers in each span of the case with a mechanism.
_DROPPERS_OF_MECHANISM = 8
# Whether the damper of a slack dropper is released with its spring, or goes on acting.
SLACK_DAMPINGS = ("'released'", "'kept'")
_IMPACTS = ("lankarani_nikravesh", "hunt_crossley", "flores", "gonthier")


def put_more(rng: random.Random, words: Words, span: float, room: float, n_steps: int) -> None:
    """Now and then each of the parts below.

    ``span`` [m] of the line; ``room`` [m] before and behind the run that strips may take;
    ``n_steps`` of the run.
    """
    for part in (_wires, _spans, _droppers, _clamps, _arms, _damping, _mesh, _second_kind):
        if rng.random() < _NOW_AND_THEN:
            part(rng, words, span)
    if room > 1.0 and rng.random() < _NOW_AND_THEN:
        _strips(rng, words)
    if rng.random() < _NOW_AND_THEN:
        _vehicle(rng, words)
    own = random.Random(f"laws {rng.random()}")
    if own.random() < _NOW_AND_THEN:
        _laws(own, words)
    if own.random() < _NOW_AND_THEN:
        _regulation(own, words)
    if rng.random() < _NOW_AND_THEN:
        _air(rng, words)
    if rng.random() < _NOW_AND_THEN:
        _wind(rng, words)
    # Droppers must be able to slacken if they are to keep a share of their stiffness then.
    if words["effects.dropper_slackening"] == "true" and rng.random() < _NOW_AND_THEN:
        words["line.dropper.residual_stiffness_ratio"] = rng.uniform(1e-3, 0.5)
        words["effects.residual_dropper_stiffness"] = "true"
    laws = (_linear, _linear, _damped, _damped, _hertz, _hertz, _impact, _impact, _kinematic)
    rng.choice(laws)(rng, words)
    put_numerics(rng, words)
    if rng.random() < _NOW_AND_THEN and words.get("contact.law") != "'kinematic'":
        words["train.start_below_m"] = 5.0 * rng.random() ** 3
    if rng.random() < 2 * _NOW_AND_THEN and not is_second_opinion(words):
        placed = str(words["train.pantographs"]).count("name=")
        put_incidents(rng, words, n_steps, _droppers_by_span(words), placed)
    if rng.random() < 2 * _NOW_AND_THEN:
        # Of spans of two lengths this is the shorter one.
        length = 0.99 * span * int(str(words["line.n_spans"]))
        droppers = _droppers_by_span(words)
        put_defects(rng, words, droppers, length, smooth=is_second_opinion(words))


def _wires(rng: random.Random, words: Words, span: float) -> None:
    words["line.messenger_wire.mass_kg_per_m"] = rng.uniform(0.4, 1.5)
    words["line.messenger_wire.bending_stiffness_N_m2"] = rng.choice([0.0, rng.uniform(1.0, 300.0)])
    words["line.contact_height_m"] = rng.uniform(4.5, 7.0)


def _spans(rng: random.Random, words: Words, span: float) -> None:
    """Two lengths in turn, with a pattern of droppers for each; the line gets longer by that."""
    other = span + rng.uniform(1.0, 10.0)
    words["line.span_m"] = [span, other]
    count = rng.randint(2, 6)
    del words["line.dropper.positions_m"]
    words["line.dropper.positions_m"] = ""
    words["line.dropper.patterns"] = "[" + ",".join(
        f"{{span_m={length!r},positions_m={_even(length, count)!r}}}" for length in (span, other)
    ) + "]"  # fmt: skip


def _droppers(rng: random.Random, words: Words, span: float) -> None:
    """By their count, with a sag given at mid-span, as strands with a modulus."""
    if "line.dropper.patterns" in words:
        return
    count = rng.randint(2, 9)
    words["line.dropper.positions_m"] = ""
    words["line.dropper.count"] = count
    words["line.dropper.spacing_m"] = span / (count + rng.uniform(0.5, 1.5))
    words["line.dropper.pre_sag_mid_mm"] = rng.uniform(-5.0, 30.0)
    words["line.dropper.stiffness_N_per_m"] = ""
    words["line.dropper.axial_stiffness_N"] = 10 ** rng.uniform(4.0, 6.3)


def _clamps(rng: random.Random, words: Words, span: float) -> None:
    words["line.dropper.mass_kg_per_m"] = rng.uniform(0.0, 0.3)
    words["line.dropper.messenger_clamp_kg"] = rng.uniform(0.0, 0.4)


def _arms(rng: random.Random, words: Words, span: float) -> None:
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


def _damping(rng: random.Random, words: Words, span: float) -> None:
    names = ("contact_wire", "messenger_wire", "droppers", "steady_arms", "supports")
    for name in rng.sample(names, rng.randint(1, 5)):
        values = (10 ** rng.uniform(-5, -2), rng.choice([0.0, rng.uniform(0.0, 0.1)]))
        words[f"line.damping.per_component.{name}"] = (
            f"{{alpha_s={values[0]!r},beta_per_s={values[1]!r}}}"
        )


def _mesh(rng: random.Random, words: Words, span: float) -> None:
    words["mesh.support_refinement"] = rng.randint(2, 4)


def _second_kind(rng: random.Random, words: Words, span: float) -> None:
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


def _droppers_by_span(words: Words) -> list[int]:
    """How many droppers stand in each span."""
    count = words.get("line.dropper.count")
    if count is None:
        # Of patterns the last: they have as many each.
        places = words.get("line.dropper.patterns", words["line.dropper.positions_m"])
        count = str(places).rpartition("[")[2].count(",") + 1
    return [int(str(count))] * int(str(words["line.n_spans"]))


def _strips(rng: random.Random, words: Words) -> None:
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


def _vehicle(rng: random.Random, words: Words) -> None:
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


def _laws(rng: random.Random, words: Words) -> None:
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
                    f"[[-0.1,{-rng.uniform(0.0, 900.0)!r}],[-0.02,-3.0],[0.05,0.0]]}}",
                )
            )
        )
    words["pantographs.reference.laws"] = f"[{','.join(laws)}]"


def _regulation(rng: random.Random, words: Words) -> None:
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


def _wind(rng: random.Random, words: Words) -> None:
    """A steady wind, or gusts of few waves; further wires of topologies have a diameter."""
    for wire in ("contact_wire", "messenger_wire"):
        words[f"line.{wire}.diameter_mm"] = rng.uniform(5.0, 20.0)
    words["wind.speed_m_per_s"] = rng.uniform(1.0, 40.0)
    words["wind.direction_deg"] = rng.uniform(-180.0, 180.0)
    words["wind.drag"] = rng.choice(["'linear'", "'quadratic'"])
    if rng.random() < 0.5:
        words["wind.gusts.highest_hz"] = rng.uniform(0.1, 1.0)
        words["wind.gusts.seed"] = rng.randrange(1000)


def _air(rng: random.Random, words: Words) -> None:
    """Uplift by a polynomial or a table, now and then in a tunnel."""
    table = "pantographs.reference.aerodynamics"
    if rng.random() < 0.5:
        words[f"{table}.uplift_polynomial"] = [0.0, rng.uniform(0.0, 0.01), rng.uniform(0.0, 2e-3)]
    else:
        words[f"{table}.uplift_by_speed"] = [[50.0, rng.uniform(0, 9)], [300.0, rng.uniform(9, 90)]]
    words[f"{table}.head_share"] = rng.uniform(0.0, 1.0)
    if rng.random() < 0.5:
        start, factor = float(str(words["train.start_m"])), rng.uniform(0.8, 2.0)
        words["line.tunnels"] = (
            f"[{{from_m={start + 1.0!r},to_m={start + 500.0!r},force_factor={factor!r},"
            f"portal_m={rng.choice([0.0, 20.0])!r}}}]"
        )


# ---- contact ------------------------------------------------------------------------------------


def _linear(rng: random.Random, words: Words) -> None:
    """As it is."""


def _damped(rng: random.Random, words: Words) -> None:
    words["contact.damping_N_s_per_m"] = rng.uniform(1.0, 300.0)
    words["effects.contact_damping"] = "true"


def _hertz(rng: random.Random, words: Words) -> None:
    words["contact.law"] = "'hertz'"
    words["effects.contact_loss"] = "true"
    if rng.random() < 0.5:
        words["contact.stiffness_N_per_m"] = ""
        words["contact.hertz_stiffness_N_per_m1_5"] = 10 ** rng.uniform(5.0, 9.0)


def _impact(rng: random.Random, words: Words) -> None:
    words["contact.law"] = f"'{rng.choice(_IMPACTS)}'"
    words["contact.restitution"] = rng.uniform(0.1, 0.95)
    words["contact.least_impact_speed_m_per_s"] = 10 ** rng.uniform(-2.0, 0.0)
    words["effects.contact_damping"] = words["effects.contact_loss"] = "true"


def _kinematic(rng: random.Random, words: Words) -> None:
    words["contact.law"] = "'kinematic'"
    words["contact.stiffness_N_per_m"] = ""
    words["train.start_below_m"] = 0.0
    words["numerics.newmark_gamma"], words["numerics.newmark_beta"] = 0.55, 0.28


_KEYS_OF_LAWS = (
    "law",
    "damping_N_s_per_m",
    "hertz_stiffness_N_per_m1_5",
    "restitution",
    "least_impact_speed_m_per_s",
)
_LAWS = {
    "linear": _linear,
    "damped": _damped,
    "hertz": _hertz,
    **dict.fromkeys(_IMPACTS, _impact),
    "kinematic": _kinematic,
}


def law_variants(rng: random.Random) -> dict[str, list[str]]:
    """Assignments that give a scene each of the contact laws in turn, by the law's name.

    They take away what the scene says of another law and, for the kinematic one, of numerics.
    """
    cleared: Words = {f"contact.{key}": "" for key in _KEYS_OF_LAWS}
    cleared |= {"contact.stiffness_N_per_m": "", "effects.contact_damping": ""}
    cleared |= {"effects.contact_loss": "true"}
    found = {}
    for name, law in _LAWS.items():
        words = dict(cleared)
        law(rng, words)
        if name in _IMPACTS:
            words["contact.law"] = f"'{name}'"
        if name == "kinematic":
            of_numerics = ("scheme", "coupling", "integrator", "spectral_radius", "iterations")
            words = {**{f"numerics.{key}": "" for key in of_numerics}, **words}
        found[name] = list(as_assignments(words))
    return found


def mechanism(rng: random.Random, n_steps: int) -> tuple[str, ...]:
    """Assignments to the case with a mechanism of seven bodies, for so many steps of its run."""
    n_spans = rng.randint(7, 10)
    speed, dt = rng.uniform(20.0, 85.0), 10 ** rng.uniform(-3.7, -2.7)
    way = (n_steps + 0.5) * dt * speed
    start = rng.uniform(110.0, 120.0)
    room = 54.0 * n_spans - 291.0  # from any start to where the line's last spans begin
    if way > room:  # the line is too short for these steps: go slower
        speed, way = speed * room / way, room
    words: Words = {
        "line.n_spans": n_spans,
        "train.speed_km_h": 3.6 * speed,
        "train.start_m": start,
        "train.end_m": start + way,
        "train.raise_time_s": rng.choice([0.0, 0.3 * way / speed]),
        "evaluation.from_m": start + 0.35 * way,
        "evaluation.to_m": start + 0.4 * way,
        "contact.stiffness_N_per_m": 10 ** rng.uniform(4.0, 6.0),
        "numerics.dt_s": dt,
        "mesh.elements_per_gap": rng.randint(2, 5),
        "pantographs.seven_body.static_force_N": rng.uniform(80.0, 200.0),
        "train.pantographs.0.reversed": rng.choice(["true", "false"]),
        "effects.residual_dropper_stiffness": rng.choice(["true", "false"]),
    }
    if rng.random() < _NOW_AND_THEN:
        words["train.start_below_m"] = rng.uniform(0.0, 0.3)
    if rng.random() < 0.5:
        way_kept = rng.choice(["coordinate_partitioning", "augmented_lagrangian", "baumgarte"])
        words["pantographs.seven_body.motion"] = "'all_bodies'"
        words["pantographs.seven_body.constraint_handling"] = f"'{way_kept}'"
        words["pantographs.seven_body.substeps"] = rng.randint(1, 4)
    rng.choice((_linear, _damped, _hertz, _impact))(rng, words)
    put_numerics(rng, words, with_second_opinion=False)
    if rng.random() < 2 * _NOW_AND_THEN:
        put_incidents(rng, words, n_steps, [_DROPPERS_OF_MECHANISM] * n_spans, 1, deepest_m=0.3)
    words["line.dropper.slack_damping"] = rng.choice(SLACK_DAMPINGS)
    return as_assignments(words)


def as_assignments(words: Words) -> tuple[str, ...]:
    """``key=value`` each."""
    return tuple(
        f"{key}={value if isinstance(value, str) else repr(value)}" for key, value in words.items()
    )


def _even(span: float, count: int) -> list[float]:
    """Places of droppers, evenly."""
    return [round(span * (i + 0.5) / count, 3) for i in range(count)]
