"""Ways to break what happens in a run and how it is stepped, each with the key that is to be named.

A way is a list of assignments to a sound scene with ``INCIDENTS``, of which one thing cannot be.
"""

from __future__ import annotations

import random
from typing import NamedTuple

# All kinds, in the first steps; each may be broken in each of its keys.
INCIDENTS = (
    "incidents=[{{type='dropper_break',at_s={0!r},span=1,dropper=1}},"
    "{{type='tension_loss',at_s={1!r},wire='contact_wire',share=0.8}},"
    "{{type='lowering',at_s={2!r},pantograph=1,force_N=-60.0,within_s=0.2,drop_m=0.4}}]"
)
# What is no number of any kind.
_NO_NUMBER = ("nan", "inf", "-inf", "1e400", "'20 kN'", "[]", "true", "{}", "[1.0]", "2026-01-01")
_NO_COUNT = ("0", "-1", "1.5", "1e9", str(10**30))
# Keys of numbers and what is out of their bounds.
_INCIDENT_NUMBERS = {
    "incidents.0.at_s": ("-1", "-1e-9", "-5e-324", "1.1e5"),
    "incidents.0.span": _NO_COUNT,
    "incidents.0.dropper": _NO_COUNT,
    "incidents.1.at_s": ("-1e-6", "1e300"),
    "incidents.1.share": ("0", "1", "1.0000001", "-0.5", "-5e-324", "5e-324", "1e-200"),
    "incidents.2.at_s": ("-1e-12", "1e6"),
    "incidents.2.pantograph": _NO_COUNT,
    "incidents.2.force_N": ("0", "60", "5e-324", "-1001", "-1e308"),
    "incidents.2.within_s": ("0", "-1", "0.0099", "10.1", "5e-324"),
    "incidents.2.drop_m": ("0", "-0.1", "5.1", "-5e-324"),
}
# Key, what is out of its bounds, and what makes the key act.
_NUMERICS = (
    ("numerics.spectral_radius", ("-0.1", "1.1", "-5e-324"), ("numerics.integrator=hht",)),
    ("numerics.spectral_radius", ("-1", "2"), ("numerics.integrator=generalized_alpha",)),
    ("numerics.iterations", ("0", "-1", "2.5", "10001", "1e30"), ("numerics.scheme=fixed_point",)),
    ("numerics.max_iterations", ("0", "-3", "2.5", "10001"), ("numerics.scheme=fixed_point",)),
    ("numerics.eps_force_N", ("0", "-1e-9", "11"), ("numerics.coupling=iterated",)),
    ("train.start_below_m", ("-1e-9", "5.1", "-5e-324"), ()),
)
_KINEMATIC = (
    "contact={law='kinematic'}",
    "numerics.newmark_gamma=0.55",
    "numerics.newmark_beta=0.28",
)
_HHT = ("numerics.integrator=hht", "numerics.spectral_radius=0.8")


class Way(NamedTuple):
    """Assignments that break a scene, and the key that the sentence has to name."""

    assignments: tuple[str, ...]
    key: str


def a_way(rng: random.Random, n_steps: int, dt: float, train: str) -> Way:
    """A random way to break a scene of ``n_steps`` steps of ``dt`` [s] with pantographs ``train``.

    What holds for the scene besides: ``INCIDENTS`` at three different steps, law linear, contact
    that may be lost, average acceleration.
    """
    kinds = (_bad_number, _bad_number, _bad_word, _bad_time, _twice, _cannot_be, _bad_numerics)
    kind = rng.choice((*kinds, _contradiction, _contradiction))
    return kind(rng, n_steps, dt, train)


def _bad_number(rng: random.Random, n_steps: int, dt: float, train: str) -> Way:
    key = rng.choice(tuple(_INCIDENT_NUMBERS))
    # Those of a lowering have defaults, the others are missing if they are taken away.
    missing = () if key.startswith("incidents.2.") and not key.endswith("at_s") else ("",)
    value = rng.choice((*_NO_NUMBER, *_INCIDENT_NUMBERS[key], *missing))
    return Way((f"{key}={value}",), key)


def _bad_numerics(rng: random.Random, n_steps: int, dt: float, train: str) -> Way:
    key, out_of_bounds, acts = rng.choice(_NUMERICS)
    return Way((*acts, f"{key}={rng.choice((*_NO_NUMBER, *out_of_bounds))}"), key)


def _bad_word(rng: random.Random, n_steps: int, dt: float, train: str) -> Way:
    word = rng.choice(("'x'", "''", "3", "nan", "[]", "true", "'Contact_wire'", "'newmark '"))
    key = rng.choice(
        ("incidents.1.wire", "numerics.integrator", "numerics.scheme", "numerics.coupling")
    )
    if rng.random() < 0.3:
        i = rng.randrange(3)
        strange = rng.choice(("at", "sparn", "shares", "forceN", "drop", "x", "type_"))
        return Way((f"incidents.{i}.{strange}=1",), f"incidents.{i}.{strange}")
    if rng.random() < 0.3:
        i = rng.randrange(3)
        return Way((f"incidents.{i}.type={word}",), f"incidents.{i}")
    if rng.random() < 0.2:
        foreign = rng.choice(
            ("incidents.0.share=0.5", "incidents.1.span=1", "incidents.2.wire='contact_wire'")
        )
        return Way((foreign,), foreign.split("=")[0])
    if rng.random() < 0.2:
        return Way(
            (f"incidents={rng.choice(('3', 'nan', 'true', '{}', '[3]', '[[]]'))}",), "incidents"
        )
    return Way((f"{key}={word}",), key)


def _bad_time(rng: random.Random, n_steps: int, dt: float, train: str) -> Way:
    """In the last step, at its end, half a step before, just beyond, far beyond."""
    i = rng.randrange(3)
    step = rng.choice((n_steps, n_steps - 0.49, n_steps + 0.3, n_steps + 1, 7 * n_steps))
    return Way((f"incidents.{i}.at_s={step * dt!r}",), f"incidents.{i}.at_s")


def _twice(rng: random.Random, n_steps: int, dt: float, train: str) -> Way:
    """What can happen once only, at another time or in the same step; a tension that comes back."""
    early = 1.2 * dt
    late = rng.uniform(30.0, n_steps - 1.0) * dt
    entry, key = rng.choice(
        (
            (f"type='dropper_break',at_s={late!r},span=1,dropper=1", "dropper"),
            (f"type='dropper_break',at_s={early!r},span=1,dropper=1", "dropper"),
            (f"type='lowering',at_s={late!r}", "pantograph"),
            (f"type='tension_loss',at_s={20.3 * dt!r},wire='contact_wire',share=0.7", "at_s"),
            (f"type='tension_loss',at_s={late!r},wire='contact_wire',share=0.9", "share"),
            (f"type='tension_loss',at_s={late!r},wire='contact_wire',share=0.8", "share"),
            (f"type='tension_loss',at_s={early!r},wire='contact_wire',share=0.5", "share"),
        )
    )
    # Told of the one that stands later, or, of tensions, of the one that comes later.
    which = 1 if key == "share" and f"at_s={early!r}" in entry else 3
    return Way((f"incidents.3={{{entry}}}",), f"incidents.{which}.{key}")


def _cannot_be(rng: random.Random, n_steps: int, dt: float, train: str) -> Way:
    """What the line and the train of the scene do not have."""
    n = train.count("name=")
    return rng.choice(
        (
            Way((f"incidents.0.span={rng.randint(6, 20_000)}",), "incidents.0.span"),
            Way((f"incidents.0.dropper={rng.randint(10, 200)}",), "incidents.0.dropper"),
            Way((f"incidents.2.pantograph={rng.randint(n + 1, 16)}",), "incidents.2.pantograph"),
            Way(("incidents.1.share=1e-6", "effects.supercritical_speed=false"), ""),
            Way(("effects.contact_loss=false",), "incidents.2.type"),
            Way(_KINEMATIC, "incidents.2.type"),
            Way(
                (
                    "effects.gravity=false",
                    "effects.pre_sag=false",
                    "effects.dropper_slackening=false",
                ),
                "incidents.0.type",
            ),
        )
    )


def _contradiction(rng: random.Random, n_steps: int, dt: float, train: str) -> Way:
    """Keys of numerics that do not go together."""
    radius, number = rng.random(), rng.randint(1, 50)
    return rng.choice(
        (
            Way((f"numerics.spectral_radius={radius!r}",), "spectral_radius"),
            Way(("numerics.integrator=hht",), "spectral_radius"),
            Way(("numerics.integrator=generalized_alpha",), "spectral_radius"),
            Way((*_HHT, f"numerics.spectral_radius={0.49 * radius!r}"), "spectral_radius"),
            Way(
                (*_HHT, "numerics.newmark_gamma=0.6", "numerics.newmark_beta=0.31"), "newmark_gamma"
            ),
            Way((*_HHT, f"numerics.newmark_beta={0.26 + radius / 2!r}"), "newmark_beta"),
            Way(("incidents=", *_KINEMATIC[:1], *_HHT), "numerics.integrator"),
            Way(("incidents=", *_KINEMATIC[:1]), "numerics.newmark_gamma"),
            Way(
                ("incidents=", *_KINEMATIC, f"train.start_below_m={radius + 1e-9!r}"),
                "train.start_below_m",
            ),
            Way(("incidents=", *_KINEMATIC, "numerics.scheme=fixed_point"), "numerics.scheme"),
            Way((f"numerics.iterations={number}",), "iterations"),
            Way((f"numerics.iterations={number}", "numerics.coupling=iterated"), "iterations"),
            Way(
                (
                    "numerics.scheme=fixed_point",
                    f"numerics.iterations={number}",
                    f"numerics.max_iterations={number}",
                ),
                "iterations",
            ),
            Way(("numerics.scheme=fixed_point", "numerics.coupling=explicit"), "coupling"),
        )
    )
