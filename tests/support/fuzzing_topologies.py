"""Scenes of all topologies, with and without an overlap: what makes one of a simple line."""

from __future__ import annotations

import random
from collections.abc import Callable

Words = dict[str, object]
# Shares of the scenes.
_OVERLAPS, _BRIDLES = 0.4, 0.5
# What may move twin wires relative to each other: without that motion such scenes are refused.
_APART = (
    "effects.lateral_motion",
    "effects.axial_motion",
    "effects.head_roll",
    "incidents",
    "irregularities",
    "wind",
    "pantographs.reference.strips.flexure",
    "pantographs.reference.strips.rake_deg",
)
# Words of a simple line that no line of a single contact wire has.
_NOT_SINGLE = (
    "line.messenger_wire.",
    "line.dropper.",
    "line.encumbrance_m",
    "line.damping.per_component.messenger_wire",
    "line.damping.per_component.droppers",
    "effects.residual_dropper_stiffness",
    "incidents",
    "defects",
    "irregularities.dropper_lengths",
)
# What is on the contact wire by its place, of lines with several ones.
_ON_THE_WIRE = ("defects", "line.fittings")


def put_topology(rng: random.Random, words: Words, span: float) -> str:
    """Give a simple line of spans of at least ``span`` [m] any topology; returns its name, with
    ``+overlap`` where two sections overlap."""
    name = rng.choice(tuple(_TOPOLOGIES))
    words["line.topology"] = f"'{name}'"
    _TOPOLOGIES[name](rng, words, span)
    if name == "free" or rng.random() >= _OVERLAPS:
        return name
    _overlap(rng, words)
    return f"{name}+overlap"


def put_as_one(rng: random.Random, words: Words) -> None:
    """Let twin wires move as one, mostly where nothing in ``words`` tells them apart."""
    if "line.twin" not in words:
        return
    alike = "pairs" in str(words["line.twin"]) and not any(k.startswith(_APART) for k in words)
    if rng.random() < (0.7 if alike else 0.1):
        words["effects.relative_motion"] = "false"


def _simple(rng: random.Random, words: Words, span: float) -> None:
    """As it is."""


def _stitched(rng: random.Random, words: Words, span: float) -> None:
    words["line.n_spans"] = max(2, int(str(words["line.n_spans"])))
    messenger = float(str(words["line.messenger_wire.tension_N"]))
    wire = _wire(rng, rng.uniform(0.05, 0.4) * messenger, 0.31)
    length = rng.uniform(0.2, 0.6) * span
    words["line.stitch_wire"] = f"{{{wire},length_m={length!r},clamp_kg={rng.uniform(0.0, 0.5)!r}}}"


def _compound(rng: random.Random, words: Words, span: float) -> None:
    wire = _wire(rng, 10 ** rng.uniform(3.8, 4.4), rng.uniform(0.5, 1.5))
    count = rng.randint(1, 5)
    places = [round(span * (i + 0.5) / count, 3) for i in range(count)]
    hung = f"stiffness_N_per_m={10 ** rng.uniform(4.0, 6.0)!r}"
    if isinstance(words["line.span_m"], list):  # a pattern for each length
        spans = (
            f"{{span_m={one!r},positions_m={places!r}}}" for one in sorted(words["line.span_m"])
        )
        hung += f",patterns=[{','.join(spans)}]"
    else:
        hung += f",positions_m={places!r}"
    height = rng.uniform(0.3, 0.9)
    words["line.auxiliary_wire"] = f"{{{wire},height_m={height!r},dropper={{{hung}}}}}"


def _twin(rng: random.Random, words: Words, span: float) -> None:
    _leave_out(words, _ON_THE_WIRE)
    droppers = rng.choice(("pairs", "alternating"))
    words["line.twin"] = f"{{spacing_m={rng.uniform(0.02, 0.2)!r},droppers='{droppers}'}}"


def _single(rng: random.Random, words: Words, span: float) -> None:
    _leave_out(words, _NOT_SINGLE)
    words |= {f"line.{key}": "" for key in ("messenger_wire", "dropper", "encumbrance_m")}
    words["mesh.elements_per_gap"] = rng.randint(8, 64)
    if rng.random() < _BRIDLES:
        words["line.n_spans"] = max(2, int(str(words["line.n_spans"])))
        tension = float(str(words["line.contact_wire.tension_N"]))
        wire = _wire(rng, rng.uniform(0.05, 0.5) * tension, 0.31)
        words["line.bridle"] = f"{{{wire},length_m={rng.uniform(0.1, 0.4) * span!r}}}"


# What the base case says of each table of a simple line, beside the words.
_BASE: dict[str, Words] = {
    "contact_wire": {"name": "'contact_wire'", "role": "'contact'"},
    "messenger_wire": {
        "name": "'messenger_wire'",
        "role": "'messenger'",
        "mass_kg_per_m": 1.07,
        "bending_stiffness_N_m2": 131.7,
    },
    "dropper": {
        "type": "'droppers'",
        "name": "'droppers'",
        "upper": "'messenger_wire'",
        "lower": "'contact_wire'",
    },
    "support": {"type": "'supports'", "name": "'supports'", "wire": "'messenger_wire'"},
    "steady_arm": {
        "type": "'steady_arms'",
        "name": "'steady_arms'",
        "wire": "'contact_wire'",
        "holds_height": "true",
    },
}


def _free(rng: random.Random, words: Words, span: float) -> None:
    """The same wires and links as free tables, and now and then further ones."""
    tables: dict[str, Words] = {name: dict(base) for name, base in _BASE.items()}
    for key in [key for key in words if key.startswith("line.") and key.count(".") == 2]:
        name, last = key.split(".")[1:]
        if name in tables:
            value = words.pop(key)
            tables[name].pop(last, None)
            if value != "":
                tables[name][last] = value
    contact = float(str(words.get("line.contact_height_m", 5.08)))
    top = contact + float(str(words["line.encumbrance_m"]))
    tables["messenger_wire"]["height_m"] = top
    wires, links = list(tables.values())[:2], list(tables.values())[2:]
    if rng.random() < 0.5:
        wires.append(_further("feeder", "messenger", rng, height_m=top + rng.uniform(0.5, 2.0)))
        links.append({"type": "'supports'", "name": "'feeder_supports'", "wire": "'feeder'"})
    if int(str(words["line.n_spans"])) > 1 and rng.random() < 0.5:
        ends = [rng.uniform(-0.4, -0.1) * span, rng.uniform(0.1, 0.4) * span]
        clamps = {"start": "'messenger_wire'", "end": "'messenger_wire'", "clamp_kg": 0.3}
        wires.append(_further("stitch", "stitch", rng, from_supports_m=ends, **clamps))
    words |= {f"line.{key}": "" for key in (*tables, "encumbrance_m")}
    words["line.wires"] = f"[{','.join(map(_inline, wires))}]"
    words["line.links"] = f"[{','.join(map(_inline, links))}]"


def _further(name: str, role: str, rng: random.Random, **more: object) -> Words:
    """A further wire of a free line, thinner than those that carry."""
    return {
        "name": f"'{name}'",
        "role": f"'{role}'",
        "tension_N": rng.uniform(1e3, 8e3),
        "mass_kg_per_m": rng.uniform(0.2, 0.8),
        "bending_stiffness_N_m2": rng.choice([0.0, rng.uniform(1.0, 50.0)]),
        "diameter_mm": rng.uniform(5.0, 15.0),
        **more,
    }


def _inline(table: Words) -> str:
    """A table in one line of TOML."""
    pairs = (f"{key}={value if isinstance(value, str) else repr(value)}"
             for key, value in table.items())  # fmt: skip
    return f"{{{','.join(pairs)}}}"


def _overlap(rng: random.Random, words: Words) -> None:
    """In the spans that trains run on, as far as there can be one."""
    _leave_out(words, _ON_THE_WIRE)
    n_spans = rng.randint(3, 5)
    words["line.n_spans"] = n = max(n_spans + 2, int(str(words["line.n_spans"])))
    first = [rng.randint(2, n - n_spans)]
    while rng.random() < 0.5 and first[-1] + 2 * n_spans + 1 <= n:
        first.append(rng.randint(first[-1] + n_spans + 1, n - n_spans))
    again = f"repeat_every_spans={rng.randint(n_spans + 1, 9)}," if rng.random() < 0.3 else ""
    words["line.overlap"] = (
        f"{{first_span={first if len(first) > 1 else first[0]},n_spans={n_spans},{again}"
        f"rise_m={rng.uniform(0.05, 0.8)!r},distance_m={rng.uniform(0.1, 1.0)!r}}}"
    )


def _leave_out(words: Words, begins: tuple[str, ...]) -> None:
    """Words whose keys begin so are no part of such a line."""
    for key in [key for key in words if key.startswith(begins)]:
        del words[key]


def _wire(rng: random.Random, tension: float, mass: float) -> str:
    bending = rng.choice([0.0, rng.uniform(1.0, 50.0)])
    numbers = f"tension_N={tension!r},mass_kg_per_m={mass!r},bending_stiffness_N_m2={bending!r}"
    return f"{numbers},diameter_mm={rng.uniform(5.0, 15.0)!r}"


_TOPOLOGIES: dict[str, Callable[[random.Random, Words, float], None]] = {
    "simple": _simple,
    "stitched": _stitched,
    "compound": _compound,
    "twin": _twin,
    "twin_messenger": _twin,
    "single": _single,
    "free": _free,
}
