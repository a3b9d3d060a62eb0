"""What random lines have besides the usual: wires, spans, droppers, arms, damping, wind.

Each function puts its keys into the words of a scene that is valid and leaves it valid.
"""

from __future__ import annotations

import random

from fuzzing_words import Words


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
