"""Random scenes from a seed: sound ones that must run, broken ones that must be refused."""

from __future__ import annotations

import random
from dataclasses import dataclass

from fuzzing_broken import INCIDENTS, a_way
from fuzzing_nonsense import nonsense
from fuzzing_parts import SLACK_DAMPINGS, mechanism, put_more
from fuzzing_planes import put_planes
from fuzzing_topologies import put_as_one, put_topology
from fuzzing_words import as_assignments

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


_NUMBERS = (
    "line.contact_wire.tension_N",
    "line.contact_wire.mass_kg_per_m",
    "line.messenger_wire.tension_N",
    "line.dropper.stiffness_N_per_m",
    "line.support.stiffness_N_per_m",
    "line.encumbrance_m",
    "train.speed_km_h",
    "contact.stiffness_N_per_m",
    "numerics.dt_s",
    "line.n_spans",
    "mesh.elements_per_gap",
    "numerics.newmark_beta",
)
_NO_NUMBERS = ("-1", "0", "nan", "inf", "-inf", "'20 kN'", "[]", "true", "{}", "1e400", "-5e-324")
_LETTERS = "abcdefghijklmnopqrstuvwxyz_0123456789"


def broken_scene(seed: int) -> RandomScene:
    """A sound scene with one thing in it that is not."""
    rng = random.Random(~seed)
    sound = sound_scene(seed)
    given = dict(word.split("=", 1) for word in sound.assignments)
    start, length = (
        float(given["train.start_m"]),
        (float(given["line.span_m"]) * int(given["line.n_spans"])),
    )
    ways = (
        lambda: f"{rng.choice(_NUMBERS)}={rng.choice(_NO_NUMBERS)}",
        lambda: f"{_misspelt(rng, rng.choice(list(given)))}=1.0",
        lambda: f"train.start_m={rng.uniform(1.01, 9.0) * length!r}",
        lambda: f"train.end_m={rng.uniform(0.0, 0.99) * start!r}",
        lambda: f"train.end_m={rng.uniform(1.01, 3.0) * length!r}",
        lambda: f"evaluation.to_m={rng.uniform(1.01, 3.0) * length!r}",
        lambda: f"evaluation.from_m={rng.uniform(1.01, 3.0) * length!r}",
        lambda: f"line.dropper.positions_m=[{rng.uniform(71.0, 400.0)!r}]",
        lambda: "line.dropper.positions_m=[5.0, 4.0]",
        lambda: f"numerics.dt_s={rng.uniform(0.0251, 10.0)!r}",
        lambda: f"train.pantographs=[{{name='{_word(rng)}'}}]",
        lambda: f"train.pantographs=[{{name='reference',behind_m={rng.uniform(0.1, 9.0)!r}}}]",
        lambda: "pantographs.reference.masses_kg=[1.0,-2.0]",
        lambda: "pantographs.reference.masses_kg=[1.0,2.0,3.0,4.0]",
        lambda: f"effects.{_word(rng)}=true",
        lambda: "effects={gravity=false,dropper_slackening=true}",
        lambda: f"numerics.scheme='{_word(rng)}'",
        lambda: f"contact.law='{_word(rng)}'",
        lambda: "numerics.newmark_gamma=0.4",
        lambda: "numerics.newmark_gamma=0.9",
        lambda: f"line.dropper.residual_stiffness_ratio={rng.uniform(1.0, 5.0)!r}",
        lambda: f"mesh.file='{_word(rng)}.msh'",
        lambda: f"train.speed_km_h.{_word(rng)}=3",
        lambda: f"{_word(rng)}",
        lambda: f"line.encumbrance_m={rng.uniform(1e-3, 5e-3)!r}",
    )
    word = rng.choice(ways)()
    return RandomScene(seed, (*sound.assignments, word), word)


def broken_happening(seed: int) -> RandomScene:
    """A sound scene with incidents, in which one of these or of the numerics cannot be."""
    rng = random.Random(f"happening {seed}")
    sound = sound_scene(seed)
    given = dict(word.split("=", 1) for word in sound.assignments)
    dt = float(given["numerics.dt_s"])
    incidents = INCIDENTS.format(rng.uniform(0.0, 9.0) * dt, 20 * dt, rng.randint(0, 99) * dt)
    way = a_way(rng, N_STEPS, dt, given["train.pantographs"])
    kept = (
        "effects.contact_loss=true",
        "effects.dropper_slackening=true",
        "train.start_below_m=0.0",
        incidents,
    )
    words = (*sound.assignments, *kept, *way.assignments)
    return RandomScene(seed, words, " ".join(way.assignments), names=way.key)


def broken_topology(seed: int) -> RandomScene:
    """A scene of any topology with nonsense in one of all keys, or with parts that contradict."""
    made = topology_scene(seed)
    given = dict(word.split("=", 1) for word in made.assignments)
    way = nonsense(random.Random(f"nonsense {seed}"), given)
    words = (*made.assignments, *way.assignments)
    return RandomScene(seed, words, " ".join(way.assignments), names=way.names)


def _word(rng: random.Random) -> str:
    return "x" + "".join(rng.choice(_LETTERS) for _ in range(rng.randint(3, 12)))


def _misspelt(rng: random.Random, key: str) -> str:
    place = rng.randrange(1, len(key))
    return f"{key[:place]}{rng.choice(_LETTERS)}q{key[place:]}"
