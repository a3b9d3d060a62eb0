"""Random scenes whose wires move along the track: what makes one of a scene without."""

from __future__ import annotations

import random

Words = dict[str, object]
# Share of the scenes: each layout of a station has loops of its own, which take long to compile.
_NOW_AND_THEN = 0.05
# Tables of wires that every line of a topology has; others are whole tables in one word.
_TABLES = ("contact_wire", "messenger_wire")


def put_along(rng: random.Random, words: Words, topology: str) -> bool:
    """Now and then let the wires of a simple line move along the track; returns whether it does."""
    if topology != "simple" or rng.random() >= _NOW_AND_THEN:
        return False
    let_move(rng, words)
    return True


def let_move(rng: random.Random, words: Words) -> None:
    """Axial stiffness, ends, tensioners and a temperature, which leave a sound scene sound.

    A line between fixed ends may be slack when it is warm, and is refused then.
    """
    words["effects.axial_motion"] = "true"
    for table in _TABLES:
        if rng.random() < 0.5:
            words[f"line.{table}.axial_stiffness_N"] = 10 ** rng.uniform(6.5, 7.5)
        else:
            words[f"line.{table}.section_mm2"] = rng.uniform(50.0, 170.0)
            words[f"line.{table}.youngs_modulus_GPa"] = rng.uniform(80.0, 125.0)
    words["line.steady_arm.length_m"] = rng.uniform(0.8, 1.5)
    side = rng.choice(["start", "end", ""])
    if side:
        words[f"line.ends.{side}.along"] = "'tensioner'"
        words["line.tensioner.ratio"] = rng.uniform(1.0, 5.0)
        words["line.tensioner.efficiency"] = rng.choice([1.0, rng.uniform(0.9, 1.0)])
        if rng.random() < 0.5:
            words["line.tensioner.travel_m"] = 10 ** rng.uniform(-3.0, 0.5)
            words["line.tensioner.stop_stiffness_N_per_m"] = 10 ** rng.uniform(4.0, 8.0)
    if rng.random() < 0.5:
        words["line.temperature.difference_K"] = rng.uniform(-40.0, 60.0)
