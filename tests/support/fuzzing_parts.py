"""Random scenes with parts of the schema besides the usual: each now and then, from a seed."""

from __future__ import annotations

import random
import re

from fuzzing_line import (
    NOW_AND_THEN,
    Words,
    air,
    arms,
    as_assignments,
    clamps,
    damping,
    droppers,
    droppers_by_span,
    mesh,
    nonlinear_laws,
    regulation,
    second_kind,
    spans,
    strips,
    vehicle,
    wind,
    wires,
)

# --- contact laws of random scenes, and each of them in turn for a scene --------------------------


_IMPACTS = ("lankarani_nikravesh", "hunt_crossley", "flores", "gonthier")


def linear(rng: random.Random, words: Words) -> None:
    """As it is."""


def damped(rng: random.Random, words: Words) -> None:
    """Linear with a damper."""
    words["contact.damping_N_s_per_m"] = rng.uniform(1.0, 300.0)
    words["effects.contact_damping"] = "true"


def hertz(rng: random.Random, words: Words) -> None:
    """Hertz's law, its stiffness given or found."""
    words["contact.law"] = "'hertz'"
    words["effects.contact_loss"] = "true"
    if rng.random() < 0.5:
        words["contact.stiffness_N_per_m"] = ""
        words["contact.hertz_stiffness_N_per_m1_5"] = 10 ** rng.uniform(5.0, 9.0)


def impact(rng: random.Random, words: Words) -> None:
    """A law of impacts with restitution."""
    words["contact.law"] = f"'{rng.choice(_IMPACTS)}'"
    words["contact.restitution"] = rng.uniform(0.1, 0.95)
    words["contact.least_impact_speed_m_per_s"] = 10 ** rng.uniform(-2.0, 0.0)
    words["effects.contact_damping"] = words["effects.contact_loss"] = "true"


def kinematic(rng: random.Random, words: Words) -> None:
    """A contact without elasticity, and steps that damp what it excites."""
    words["contact.law"] = "'kinematic'"
    words["contact.stiffness_N_per_m"] = words["effects.contact_loss"] = ""
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
    "linear": linear,
    "damped": damped,
    "hertz": hertz,
    **dict.fromkeys(_IMPACTS, impact),
    "kinematic": kinematic,
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


# --- random ways through time ---------------------------------------------------------------------


def put_numerics(rng: random.Random, words: Words) -> None:
    """A scheme with its coupling or iterations, and an integrator.

    With a kinematic contact all stays as it is.
    """
    if words.get("contact.law") == "'kinematic'":
        return
    rng.choice((_implicit, _implicit, _exchanging, _correcting))(rng, words)
    integrators = (_average, _average, _numerically_damped, _hht, _generalized_alpha)
    rng.choice(integrators)(rng, words)


# ---- schemes ------------------------------------------------------------------------------------


def _implicit(rng: random.Random, words: Words) -> None:
    """As it is."""


def _exchanging(rng: random.Random, words: Words) -> None:
    words["numerics.coupling"] = rng.choice(["'iterated'", "'explicit'"])


def _correcting(rng: random.Random, words: Words) -> None:
    words["numerics.scheme"] = "'fixed_point'"
    if rng.random() < 0.5:
        words["numerics.iterations"] = rng.choice([1, 2, rng.randint(1, 12), rng.randint(1, 60)])


# ---- integrators --------------------------------------------------------------------------------


def _average(rng: random.Random, words: Words) -> None:
    """As it is."""


def _numerically_damped(rng: random.Random, words: Words) -> None:
    gamma = rng.uniform(0.5, 0.7)
    words["numerics.newmark_gamma"] = gamma
    words["numerics.newmark_beta"] = rng.uniform(1.0, 1.2) * 0.25 * (gamma + 0.5) ** 2


def _hht(rng: random.Random, words: Words) -> None:
    words["numerics.integrator"] = "'hht'"
    words["numerics.spectral_radius"] = rng.choice([0.5, 1.0, rng.uniform(0.5, 1.0)])


def _generalized_alpha(rng: random.Random, words: Words) -> None:
    words["numerics.integrator"] = "'generalized_alpha'"
    words["numerics.spectral_radius"] = rng.choice([0.0, 0.8, 1.0, rng.random()])


# --- what is wrong with the lines of random scenes ------------------------------------------------


def put_defects(rng: random.Random, words: Words, droppers: list[int], length: float) -> None:
    """Some of each, in a scene that is valid and stays so; incidents stand in it already.

    Parameters
    ----------
    droppers : how many stand in each span
    length : of the line [m]
    """
    if rng.random() < 0.5 and any(droppers):
        words["irregularities.dropper_lengths.standard_deviation_mm"] = 10 ** rng.uniform(-1, 1.5)
        words["irregularities.dropper_lengths.seed"] = rng.randrange(2**31)
    # Heights below a tenth of a millimetre are taken for metres, but for those of a surface.
    kinds = (("contact_wire_height", 10.0, -1.0), ("running_surface", 0.3, -2.0))
    for name, shortest, lowest in kinds:
        if rng.random() < 0.4:
            least = rng.uniform(1.0, 3.0) * shortest
            key = f"irregularities.{name}"
            words[f"{key}.standard_deviation_mm"] = 10 ** rng.uniform(lowest, 1.0)
            words[f"{key}.exponent"] = rng.uniform(0.0, 4.0)
            words[f"{key}.shortest_m"], words[f"{key}.longest_m"] = least, 8.0 * least
            words[f"{key}.seed"] = rng.randrange(2**31)
            words[f"{key}.from_m"], words[f"{key}.to_m"] = 0.0, length
    entries = []
    broken = re.findall(r"'span': (\d+), 'dropper': (\d+)", str(words.get("incidents", "")))
    broken += re.findall(r"span=(\d+),dropper=(\d+)", str(words.get("incidents", "")))
    free = [(i + 1, k + 1) for i, n in enumerate(droppers) for k in range(n)]
    free = [place for place in free if tuple(map(str, place)) not in broken]
    rng.shuffle(free)
    for _ in range(rng.randint(0, 5)):
        kind = rng.choice(("missing_dropper", "loose_clamp", "worn_wire", "hard_spot", "kink"))
        entry: dict[str, object] = {"type": kind}
        if kind in ("missing_dropper", "loose_clamp"):
            if not free:
                continue
            entry["span"], entry["dropper"] = free.pop()
        elif kind == "worn_wire":
            # One stretch in each fifth, so that none reaches into another one.
            part = len(entries)
            begin, end = sorted(rng.uniform(part, part + 1) * length / 5 for _ in range(2))
            entry |= {"from_m": begin, "to_m": end + 1e-3, "lost_share": rng.uniform(0.01, 0.5)}
        elif kind == "hard_spot":
            entry |= {"at_m": rng.uniform(0.0, length), "mass_kg": 10 ** rng.uniform(-2, 1.5)}
            entry["stiffness_N_per_m"] = rng.choice([0.0, 10 ** rng.uniform(0.0, 5.0)])
        elif words.get("line.contact_wire.bending_stiffness_N_m2") == 0.0:
            continue
        else:
            entry |= {"at_m": rng.uniform(0.0, length), "angle_deg": rng.uniform(-2.0, 2.0)}
        entries.append(entry)
    if rng.random() < 0.3:
        entries.append(
            {"type": "wrong_tension", "wire": "contact_wire", "factor": rng.uniform(1.0, 1.2)}
        )
    words["defects"] = "[" + ",".join(map(_table, entries)) + "]"
    if rng.random() < 0.3:
        place = rng.uniform(0.0, 0.9) * length
        fitting = {"kind": "splice", "at_m": place, "mass_kg": rng.uniform(0.1, 20.0)}
        words["line.fittings"] = f"[{_table(fitting)}]"


def _table(entry: dict[str, object]) -> str:
    """A table of TOML on one line."""
    return "{" + ",".join(f"{key}={value!r}" for key, value in entry.items()) + "}"


# --- what happens during random runs --------------------------------------------------------------


_KINDS = ("dropper_break", "tension_loss", "lowering")


def put_incidents(
    rng: random.Random,
    words: Words,
    n_steps: int,
    droppers: list[int],
    n_pantographs: int,
    deepest_m: float = 5.0,
) -> None:
    """One to six incidents, now and then with a kind that is not simulated.

    Parameters
    ----------
    n_steps : of the run, in the last of which nothing may happen
    droppers : how many stand in each span
    n_pantographs : of the train, any of which may be lowered
    deepest_m : how far a pantograph reaches down
    """
    dt = float(str(words["numerics.dt_s"]))
    steps: list[int] = []
    entries: list[dict[str, object]] = []
    places = [(i + 1, k + 1) for i, n in enumerate(droppers) for k in range(n)]
    rng.shuffle(places)
    trains = rng.sample(range(1, n_pantographs + 1), n_pantographs)
    can_be_lowered = words.get("effects.contact_loss", "true") == "true"
    can_be_lowered &= words.get("contact.law") != "'kinematic'"
    for _ in range(rng.randint(1, 6)):
        kind = rng.choice(_KINDS)
        step = _step(rng, n_steps, steps)
        entry: dict[str, object] = {"type": kind, "at_s": _time(rng, step, dt)}
        if kind == "dropper_break" and places:
            entry["span"], entry["dropper"] = places.pop()
        elif kind == "tension_loss":
            entry["wire"] = rng.choice(("contact_wire", "messenger_wire"))
            entry["share"] = 10 ** rng.uniform(-1.99, -0.01)
        elif kind == "lowering" and trains and can_be_lowered:
            entry |= _lowering(rng, trains.pop(), deepest_m)
        else:
            continue
        steps.append(step)
        entries.append(entry)
    _let_tensions_fall(entries, steps)
    words["effects.supercritical_speed"] = "true"
    words["incidents"] = "[" + ",".join(map(_table, entries)) + "]"
    if rng.random() < 0.2:
        words[f"effects.{rng.choice(_KINDS)}"] = "false"


def _step(rng: random.Random, n_steps: int, taken: list[int]) -> int:
    """Before the first step, before the last one, in one that has an incident, or in any."""
    choices = [0, 1, n_steps - 1, rng.randrange(n_steps), rng.randrange(n_steps)]
    return rng.choice([*choices, *taken[-1:]])


def _time(rng: random.Random, step: int, dt: float) -> float:
    """Exactly at the end of a step, or anywhere that is rounded to it."""
    off = rng.choice([0.0, 0.0, rng.uniform(-0.49, 0.49)])
    return max(0.0, (step + off) * dt)


def _lowering(rng: random.Random, number: int, deepest_m: float) -> dict[str, object]:
    """A lowering with some of its keys; what is left out has its default."""
    entry: dict[str, object] = {"pantograph": number}
    entry["drop_m"] = min(10 ** rng.uniform(-4.0, 0.69), deepest_m)
    if rng.random() < 0.7:
        entry["force_N"] = -(10 ** rng.uniform(-1.0, 3.0))
    if rng.random() < 0.7:
        entry["within_s"] = 10 ** rng.uniform(-2.0, 1.0)
    return entry


def _let_tensions_fall(entries: list[dict[str, object]], steps: list[int]) -> None:
    """A wire loses tension once a step, and more each time; what does not is taken away."""
    for wire in ("contact_wire", "messenger_wire"):
        losses = [i for i, entry in enumerate(entries) if entry.get("wire") == wire]
        losses.sort(key=lambda i: steps[i])
        shares = sorted((float(str(entries[i]["share"])) for i in losses), reverse=True)
        again = {i for i, j in zip(losses[1:], losses, strict=False) if steps[i] == steps[j]}
        for i, share in zip(losses, shares, strict=True):
            entries[i]["share"] = share
        for i in sorted(again, reverse=True):
            del entries[i], steps[i]


# --- random scenes with parts of the schema besides the usual -------------------------------------


# Droppers in each span of the case with a mechanism.
_DROPPERS_OF_MECHANISM = 8
# Whether the damper of a slack dropper is released with its spring, or goes on acting.
SLACK_DAMPINGS = ("'released'", "'kept'")


def put_more(rng: random.Random, words: Words, span: float, room: float, n_steps: int) -> None:
    """Now and then each of the parts below.

    ``span`` [m] of the line; ``room`` [m] before and behind the run that strips may take;
    ``n_steps`` of the run.
    """
    for part in (wires, spans, droppers, clamps, arms, damping, mesh, second_kind):
        if rng.random() < NOW_AND_THEN:
            part(rng, words, span)
    if room > 1.0 and rng.random() < NOW_AND_THEN:
        strips(rng, words)
    if rng.random() < NOW_AND_THEN:
        vehicle(rng, words)
    own = random.Random(f"laws {rng.random()}")
    if own.random() < NOW_AND_THEN:
        nonlinear_laws(own, words)
    if own.random() < NOW_AND_THEN:
        regulation(own, words)
    if rng.random() < NOW_AND_THEN:
        air(rng, words)
    if rng.random() < NOW_AND_THEN:
        wind(rng, words)
    else:
        words.pop("pantographs.reference.crosswind_factor", None)
    # Droppers must be able to slacken if they are to keep a share of their stiffness then.
    if words["effects.dropper_slackening"] == "true" and rng.random() < NOW_AND_THEN:
        words["line.dropper.residual_stiffness_ratio"] = rng.uniform(1e-3, 0.5)
        words["effects.residual_dropper_stiffness"] = "true"
    of_contact = (linear, linear, damped, damped, hertz, hertz, impact, impact, kinematic)
    rng.choice(of_contact)(rng, words)
    put_numerics(rng, words)
    if rng.random() < NOW_AND_THEN and words.get("contact.law") != "'kinematic'":
        words["train.start_below_m"] = 5.0 * rng.random() ** 3
    if rng.random() < 2 * NOW_AND_THEN:
        placed = str(words["train.pantographs"]).count("name=")
        put_incidents(rng, words, n_steps, droppers_by_span(words), placed)
    if rng.random() < 2 * NOW_AND_THEN:
        # Of spans of two lengths this is the shorter one.
        length = 0.99 * span * int(str(words["line.n_spans"]))
        counts = droppers_by_span(words)
        put_defects(rng, words, counts, length)


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
    if rng.random() < NOW_AND_THEN:
        words["train.start_below_m"] = rng.uniform(0.0, 0.3)
    if rng.random() < 0.5:
        way_kept = rng.choice(["coordinate_partitioning", "augmented_lagrangian", "baumgarte"])
        words["pantographs.seven_body.motion"] = "'all_bodies'"
        words["pantographs.seven_body.constraint_handling"] = f"'{way_kept}'"
        words["pantographs.seven_body.substeps"] = rng.randint(1, 4)
    rng.choice((linear, damped, hertz, impact))(rng, words)
    put_numerics(rng, words)
    if rng.random() < 2 * NOW_AND_THEN:
        put_incidents(rng, words, n_steps, [_DROPPERS_OF_MECHANISM] * n_spans, 1, deepest_m=0.3)
    words["line.dropper.slack_damping"] = rng.choice(SLACK_DAMPINGS)
    return as_assignments(words)
