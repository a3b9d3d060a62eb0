"""Random ways through time: schemes, couplings, integrators, each with all that it can be with."""

from __future__ import annotations

import random

Words = dict[str, object]


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
