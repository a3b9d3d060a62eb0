"""What wires and links of a free line may have besides the usual."""

from __future__ import annotations

import random
import re
from itertools import accumulate, pairwise

from fuzzing_line import strands

Words = dict[str, object]
_NOW_AND_THEN = 0.3


def put_free(rng: random.Random, words: Words) -> None:
    """Now and then each of the parts below, where a free line has the wire or links for it."""
    wires = _numbers(words, "line.wires")
    links = _numbers(words, "line.links")
    for part in (_feeder, _stitch, _droppers, _hardware):
        if rng.random() < _NOW_AND_THEN:
            part(rng, words, wires, links)


def masts(words: Words) -> list[float]:
    """Places of all masts [m] of a line without transition spans."""
    span, n = words["line.span_m"], int(str(words["line.n_spans"]))
    lengths = span if isinstance(span, list) else [float(str(span))]
    return [0.0, *accumulate(lengths[i % len(lengths)] for i in range(n))]


def _numbers(words: Words, key: str) -> dict[str, str]:
    """Keys of the tables in a list by their names."""
    names = re.findall(r"(?<![a-z_])name='(\w+)'", str(words[key]))
    return {name: f"{key}.{i}" for i, name in enumerate(names)}


def _feeder(rng: random.Random, words: Words, wires: dict[str, str], links: dict[str, str]) -> None:
    """A feeder beside the line, on a course of its own, or over some spans only."""
    if "feeder" not in wires:
        return
    key, places = wires["feeder"], masts(words)
    height = float(re.findall(r"height_m=([\d.]+)", str(words["line.wires"]))[-1])
    kind = rng.choice(("beside", "course", "stretch"))
    if kind == "beside":
        words[f"{key}.stagger_m"] = rng.uniform(-0.3, 0.3)
        words[f"{key}.sideways_m"] = rng.uniform(-3.0, 3.0)
    elif kind == "course":
        words[f"{key}.height_m"] = ""
        words[f"{key}.course_m"] = [[x, rng.uniform(-1.0, 1.0), height] for x in places]
    else:
        words[f"{key}.stretches_m"] = [[places[0], places[-2] if len(places) > 2 else places[-1]]]
    if rng.random() < 0.5:
        words[f"{links['feeder_supports']}.supports"] = list(range(1, len(places) - 1))


def _stitch(rng: random.Random, words: Words, wires: dict[str, str], links: dict[str, str]) -> None:
    if "stitch" in wires:
        words[f"{wires['stitch']}.clamp_stiffness_N_per_m"] = 10 ** rng.uniform(4.0, 8.0)
        words[f"{wires['stitch']}.supports"] = [1]


def _droppers(
    rng: random.Random, words: Words, wires: dict[str, str], links: dict[str, str]
) -> None:
    """Droppers in some of the spans, or by their places along the line."""
    key, places = links["droppers"], masts(words)
    strands(random.Random(str(words["line.links"])), words, key)
    _, patterns, listed = str(words["line.links"]).partition("patterns=[")
    if patterns:
        count = listed.partition("positions_m=[")[2].partition("]")[0].count(",") + 1
        sags = [rng.uniform(0.0, 5.0) for _ in range(count)]
        words[f"{key}.patterns.0.pre_sag_mm"] = words[f"{key}.patterns.1.pre_sag_mm"] = sags
        return
    if rng.random() < 0.5:
        words[f"{key}.spans"] = list(range(1, len(places)))
        return
    words[f"{key}.positions_m"], words[f"{key}.count"], words[f"{key}.spacing_m"] = "", "", ""
    words[f"{key}.pre_sag_mid_mm"] = ""
    at = [a + share * (b - a) for a, b in pairwise(places) for share in (0.2, 0.5, 0.8)]
    words[f"{key}.at_m"] = at
    if rng.random() < 0.5:
        words[f"{key}.pre_sag_mm"] = [rng.uniform(0.0, 5.0) for _ in at]


def _hardware(
    rng: random.Random, words: Words, wires: dict[str, str], links: dict[str, str]
) -> None:
    """Supports as high as a wire needs them; arms at some of the supports."""
    inner = list(range(1, int(str(words["line.n_spans"]))))
    if rng.random() < 0.5:
        words[f"{links['supports']}.holds"] = "'messenger_wire'"
    if inner:
        words[f"{links['steady_arms']}.supports"] = inner
