"""Random scenes with parts of the schema besides the usual: each now and then, from a seed."""

from __future__ import annotations

import random

from fuzzing_contact import damped, hertz, impact, kinematic, linear
from fuzzing_defects import put_defects
from fuzzing_incidents import put_incidents
from fuzzing_line import (
    arms,
    clamps,
    damping,
    droppers,
    droppers_by_span,
    mesh,
    spans,
    wind,
    wires,
)
from fuzzing_numerics import put_numerics
from fuzzing_train import air, nonlinear_laws, regulation, second_kind, strips, vehicle
from fuzzing_words import NOW_AND_THEN, Words, as_assignments

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
