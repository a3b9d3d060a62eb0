"""What is wrong with the lines of random scenes: irregularities, defects and fittings."""

from __future__ import annotations

import random
import re

Words = dict[str, object]


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
