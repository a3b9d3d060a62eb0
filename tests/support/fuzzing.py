"""Random scenes from a seed: sound ones that must run, broken ones that must be refused."""

from __future__ import annotations

import random
from dataclasses import dataclass

from fuzzing_line import as_assignments
from fuzzing_nonsense import nonsense
from fuzzing_parts import SLACK_DAMPINGS, mechanism, put_more
from fuzzing_planes import put_planes
from fuzzing_topologies import put_as_one, put_topology

# --- random scenes from a seed --------------------------------------------------------------------


BASE = "en50318_2002"
N_STEPS = 200


@dataclass(frozen=True)
class RandomScene:
    """Assignments to a base case, what breaks them, "" if nothing does, and the key that the
    sentence about it has to name."""

    seed: int
    assignments: tuple[str, ...]
    broken_by: str = ""
    base: str = BASE
    names: str = ""

    def assigns(self, word: str) -> bool:
        """Whether an assignment begins so."""
        return any(assignment.startswith(word) for assignment in self.assignments)


def wide_scene(seed: int, n_steps: int = N_STEPS) -> RandomScene:
    """A sound scene with more of the schema in it; one in twenty has a mechanism."""
    rng = random.Random(f"wide {seed}")
    if rng.random() < 0.05:
        return RandomScene(seed, mechanism(rng, n_steps), base="ambrosio2012")
    return sound_scene(seed, n_steps, wide=rng)


def topology_scene(seed: int, n_steps: int = N_STEPS) -> RandomScene:
    """A scene of any topology, with and without an overlap, and more of the schema in it.

    It is valid, or two of its parts do not fit to each other.
    """
    rng = random.Random(f"topology {seed}")
    words = _words(seed, n_steps, rng)
    span = words["line.span_m"]
    name = put_topology(rng, words, float(str(span[0] if isinstance(span, list) else span)))
    put_planes(random.Random(f"planes {seed}"), words, name)
    put_as_one(random.Random(f"as one {seed}"), words)
    return RandomScene(seed, as_assignments(words))


def twin_scene(seed: int, n_steps: int = N_STEPS) -> RandomScene:
    """A sound scene with two wires that hang alike in place of one."""
    rng = random.Random(f"twins {seed}")
    topology = rng.choice(("twin", "twin_messenger"))
    more = f"line.topology={topology}", f"line.twin.spacing_m={rng.uniform(0.02, 0.2)!r}"
    return RandomScene(seed, (*sound_scene(seed, n_steps).assignments, *more))


def sound_scene(
    seed: int, n_steps: int = N_STEPS, wide: random.Random | None = None
) -> RandomScene:
    """A scene that is valid by what the documents say, of any seed.

    It runs for ``n_steps``; with ``wide`` it has parts of `fuzzing_parts`.
    """
    return RandomScene(seed, as_assignments(_words(seed, n_steps, wide)))


def _words(seed: int, n_steps: int, wide: random.Random | None) -> dict[str, object]:
    """Keys and values of `sound_scene`."""
    rng = random.Random(seed)
    span = rng.uniform(30.0, 70.0)
    n_spans = rng.randint(2, 5)
    length = span * n_spans
    tension = 10 ** rng.uniform(3.8, 4.6)
    mass = rng.uniform(0.7, 2.0)
    wave = (tension / mass) ** 0.5
    speed = rng.choice([rng.uniform(5.0, 0.98 * wave), rng.uniform(0.3, 1.4) * wave])
    speed = min(max(speed, 2.0), 270.0)
    dt = 10 ** rng.uniform(-4.3, -2.0)
    way = (n_steps + 0.5) * dt * speed
    if way > 0.8 * length:  # the line is too short for these steps: go slower
        speed *= 0.8 * length / way
        way = 0.8 * length
    behind = sorted(rng.uniform(2.0, 40.0) for _ in range(rng.choice([0, 0, 1, 2, 3])))
    behind = [d for i, d in enumerate(behind) if i == 0 or d - behind[i - 1] > 1.5]
    behind = [d for d in behind if d < 0.95 * (length - way)]
    rear = behind[-1] if behind else 0.0
    start = rng.uniform(rear, length - way - 1e-3)
    if rng.random() < 0.2:
        start = length - way - 1e-3  # runs to the very end
    names = ["{name='reference'}", *(f"{{name='reference',behind_m={d!r}}}" for d in behind)]
    n_masses = rng.randint(1, 3)
    masses = [10 ** rng.uniform(-0.3, 1.3) for _ in range(n_masses)]
    springs = [10 ** rng.uniform(2.5, 4.3) for _ in range(n_masses - 1)]
    springs.append(rng.choice([0.0, rng.uniform(10.0, 500.0)]))
    dampers = [rng.choice([0.0, rng.uniform(1.0, 150.0)]) for _ in range(n_masses)]
    count = rng.randint(1, 9)
    words: dict[str, object] = {
        "line.n_spans": n_spans,
        "line.span_m": span,
        "line.encumbrance_m": 2.5,
        "line.contact_wire.tension_N": tension,
        "line.contact_wire.mass_kg_per_m": mass,
        "line.contact_wire.bending_stiffness_N_m2": rng.choice([0.0, rng.uniform(1.0, 500.0)]),
        "line.messenger_wire.tension_N": 10 ** rng.uniform(4.0, 4.6),
        "line.dropper.stiffness_N_per_m": 10 ** rng.uniform(3.0, 6.0),
        "line.dropper.positions_m": _positions(rng, span, count),
        "line.dropper.contact_clamp_kg": rng.choice([0.0, rng.uniform(0.0, 1.0)]),
        "line.support.stiffness_N_per_m": 10 ** rng.uniform(4.0, 7.0),
        "line.steady_arm.stiffness_N_per_m": rng.choice([0.0, rng.uniform(0.0, 1000.0)]),
        "line.damping.alpha_s": rng.choice([0.0, 10 ** rng.uniform(-5, -2)]),
        "line.damping.beta_per_s": rng.choice([0.0, rng.uniform(0.0, 0.1)]),
        "mesh.elements_per_gap": rng.randint(1, 6),
        "pantographs.reference.masses_kg": masses,
        "pantographs.reference.stiffnesses_N_per_m": springs,
        "pantographs.reference.dampings_N_s_per_m": dampers,
        "pantographs.reference.static_force_N": rng.uniform(20.0, 300.0),
        "train.speed_km_h": 3.6 * speed,
        "train.start_m": start,
        "train.end_m": start + way,
        "train.raise_time_s": rng.choice([0.0, 0.3 * way / speed]),
        "train.start_below_m": rng.choice([0.0, 0.0, rng.uniform(0.0, 0.2)]),
        "contact.stiffness_N_per_m": 10 ** rng.uniform(3.5, 7.5),
        "numerics.dt_s": dt,
        "evaluation.from_m": start - rear + 0.6 * (way + rear),
        "evaluation.to_m": start - rear + 0.7 * (way + rear),
        "effects.supercritical_speed": "true",
        "effects.dropper_slackening": rng.choice(["true", "true", "false"]),
        "effects.contact_loss": rng.choice(["true", "true", "true", "false"]),
    }
    # What is evaluated must have been passed by all pantographs, and after the raising.
    words["evaluation.from_m"] = start + 0.35 * way
    words["evaluation.to_m"] = start + 0.4 * way
    if rear > 0.6 * way:
        behind = []
    words["train.pantographs"] = f"[{','.join(names if behind else names[:1])}]"
    words["line.dropper.slack_damping"] = rng.choice(SLACK_DAMPINGS)
    if random.Random(f"stiff {seed}").random() < 0.3:
        words["effects.stiff_link_damping"] = "false"
    if wide is not None:
        room = min(start - (rear if behind else 0.0), length - way - start)
        put_more(wide, words, span, room, n_steps)
    return words


def _positions(rng: random.Random, span: float, count: int) -> list[float]:
    """Places of droppers in a span, no two nearer than 10 cm."""
    places: list[float] = []
    for place in sorted(rng.uniform(0.5, span - 0.5) for _ in range(count)):
        if not places or place - places[-1] > 0.1:
            places.append(round(place, 3))
    return places


def broken_topology(seed: int) -> RandomScene:
    """A scene of any topology with nonsense in one of all keys."""
    way = nonsense(random.Random(f"nonsense {seed}"))
    words = (*topology_scene(seed).assignments, way.assignment)
    return RandomScene(seed, words, way.assignment, names=way.names)


# --- random scenes at the bounds of what the schema lets pass -------------------------------------


# Steps of a run; a quarter of the step takes four times as many.
STEPS_AT_BOUNDS = 300


def extreme_scene(seed: int) -> RandomScene:
    """A scene with some of its keys at, or near, what is allowed; it may be refused."""
    rng = random.Random(f"extreme {seed}")
    made = rng.choice((sound_scene, sound_scene, topology_scene))(seed, STEPS_AT_BOUNDS)
    more = {
        "effects.contact_loss": "true",
        "effects.dropper_slackening": "true",
        "train.start_below_m": "0.0",
        "line.dropper.stiffness_N_per_m": f"{10 ** rng.uniform(4.0, 9.0)!r}",
        "contact.stiffness_N_per_m": f"{10 ** rng.uniform(4.0, 8.0)!r}",
    }
    if rng.random() < 0.6:
        more |= {"line.damping.alpha_s": "0.0", "line.damping.beta_per_s": "0.0"}
    if rng.random() < 0.4:
        more["wind"] = f"{{speed_m_per_s={rng.uniform(5.0, 60.0)!r},height_m=6.0}}"
        more |= {f"line.{wire}.diameter_mm": "13.0" for wire in ("contact_wire", "messenger_wire")}
        if rng.random() < 0.5:
            more |= {"effects.lateral_motion": "true", "line.stagger_m": "0.2"}
            more["line.steady_arm.length_m"] = f"{rng.uniform(0.5, 1.5)!r}"
    words = (f"{key}={value}" for key, value in more.items())
    return RandomScene(seed, (*made.assignments, *words), base=made.base)
