"""What happens during random runs: incidents that can be, from a seed, at all kinds of times."""

from __future__ import annotations

import random

Words = dict[str, object]
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


def _table(entry: dict[str, object]) -> str:
    """A table of TOML on one line."""
    return "{" + ",".join(f"{key}={value!r}" for key, value in entry.items()) + "}"
