"""Contact laws of random scenes, and each of them in turn for a scene."""

from __future__ import annotations

import random

from fuzzing_words import Words, as_assignments

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
