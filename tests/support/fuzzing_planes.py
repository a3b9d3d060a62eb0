"""Random lines of all topologies in three dimensions, free ones, and their details."""

from __future__ import annotations

import random
import re
from itertools import accumulate, pairwise

from fuzzing_line import strands

# --- what wires and links of a free line may have besides the usual -------------------------------


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


# --- what random scenes of any topology have now and then besides their planes --------------------


_RARELY = 0.2
_SPECTRA_OF_TRACKS = ("'fra_4'", "'fra_5'", "'fra_6'", "'german_low'", "'german_high'")
# Irregular heights by place: distance of the places and the most of a height [m].
_COURSES = (("contact_wire_height", 10.0, 0.01), ("running_surface", 0.5, 2e-4))
# Effects that a scene may leave out whatever it has.
_LEFT_OUT = (
    "arm_inertia", "arm_stiffness", "clamp_mass", "dropper_mass", "structural_damping", "gusts",
    "wind", "uplift_stops", "fittings", "contact_wire_height", "dropper_lengths", "missing_dropper",
    "running_surface", "loose_clamp", "worn_wire", "wrong_tension", "hard_spot", "kink", "pre_sag",
    "tensioners", "temperature", "transition_spans", "absorbing_layers", "periodic_ends",
    "pantograph_laws", "flexible_strips", "raked_strips", "regulated_lift", "vehicle_suspension",
    "pantograph_aerodynamics",
)  # fmt: skip


def put_details(rng: random.Random, words: Words) -> None:
    """Now and then each of the parts below."""
    for part in (_profiles, _cuts, _carriage, _clamps, _air_behind, _bogies, _sags):
        if rng.random() < _RARELY:
            part(rng, words)
    if rng.random() < _RARELY:
        words[f"effects.{rng.choice(_LEFT_OUT)}"] = "false"


def _profiles(rng: random.Random, words: Words) -> None:
    """Irregular heights by place, in place of random ones."""
    length = masts(words)[-1]
    name, step, most = rng.choice(
        (("contact_wire_height", 10.0, 0.01), ("running_surface", 0.5, 2e-4))
    )
    if any(key.startswith(f"irregularities.{name}") for key in words):
        return
    begin = rng.uniform(0.0, 0.5) * length
    places = [begin + i * step for i in range(8) if begin + i * step < length]
    pairs = [[x, rng.uniform(-most, most)] for x in places]
    if len(pairs) >= 4:
        pairs[0][1] = pairs[-1][1] = 0.0
        words[f"irregularities.{name}.by_place"] = pairs


def _cuts(rng: random.Random, words: Words) -> None:
    """Single errors of droppers' lengths, and where random ones are cut off."""
    key = "irregularities.dropper_lengths"
    if f"{key}.seed" in words:
        words[f"{key}.cut_off"] = rng.uniform(0.5, 4.0)
    elif words.get("line.dropper") != "":
        words[f"{key}.by_dropper"] = [[1, 1, rng.uniform(-20.0, 20.0)]]


def _carriage(rng: random.Random, words: Words) -> None:
    """What else a pantograph may have."""
    table = "pantographs.reference"
    words[f"{table}.nominal_height_m"] = rng.uniform(4.8, 5.4)
    if rng.random() < 0.5:
        words[f"{table}.static_force_N"] = ""
        words[f"{table}.static_force_by_speed"] = [[5.0, 60.0], [400.0, rng.uniform(60.0, 250.0)]]
    if f"{table}.strips.flexure.modes" in words:
        words[f"{table}.strips.flexure.damping_ratio"] = rng.uniform(0.0, 0.1)
    strips = f"{table}.strips"
    if f"{strips}.length_m" in words and f"{strips}.pitch_inertia_kg_m2" not in words:
        words[f"{strips}.rake_deg"] = rng.uniform(-20.0, 20.0)
        words["effects.raked_strips"] = rng.choice(["true", "false"])
    if f"{table}.regulation.measures" in words:
        words[f"{table}.regulation.from_s"] = rng.uniform(0.0, 0.5)
    if rng.random() < 0.5:
        at, most = rng.uniform(0.0, 0.05), rng.uniform(10.0, 1e4)
        words[f"{table}.laws"] = (
            f"[{{type='limiter',force_by_rise=[[{at!r},0.0],[{at + 0.1!r},{most!r}]]}},"
            f"{{type='damper',force_by_velocity=[[-1.0,{-rng.uniform(0, 300)!r}],[0.0,0.0],"
            f"[1.0,{rng.uniform(0, 300)!r}]]}},"
            f"{{type='friction',force_N=5.0,velocity_m_per_s={10 ** rng.uniform(-4, -1)!r}}}]"
        )


def _clamps(rng: random.Random, words: Words) -> None:
    """Stiffness and mass of clamps of further wires, fittings of a length."""
    for name in ("stitch_wire", "bridle"):
        if words.get(f"line.{name}"):
            words[f"line.{name}.clamp_stiffness_N_per_m"] = 10 ** rng.uniform(4.0, 8.0)
            words[f"line.{name}.clamp_kg"] = rng.uniform(0.0, 0.5)
    if words.get("line.auxiliary_wire"):
        for key, most in (("auxiliary_clamp_kg", 0.3), ("messenger_clamp_kg", 0.3),
                          ("mass_kg_per_m", 0.2)):  # fmt: skip
            words[f"line.auxiliary_wire.dropper.{key}"] = rng.uniform(0.0, most)
    if "line.fittings" in words:
        words["line.fittings.0.length_m"] = rng.uniform(0.0, 3.0)
        if rng.random() < 0.3 and words.get("line.messenger_wire") != "":
            words["line.fittings.0.wire"] = "'messenger_wire'"


def _sags(rng: random.Random, words: Words) -> None:
    """Pre-sags by dropper, and what else hangs an auxiliary wire."""
    places = words.get("line.dropper.positions_m")
    patterns = str(words.get("line.dropper.patterns", ""))
    if isinstance(places, list):
        words["line.dropper.pre_sag_mm"] = [rng.uniform(0.0, 8.0) for _ in places]
    elif patterns:
        count = patterns.partition("positions_m=[")[2].partition("]")[0].count(",") + 1
        sags = [rng.uniform(0.0, 8.0) for _ in range(count)]
        words["line.dropper.patterns"] = patterns.replace("}", f",pre_sag_mm={sags!r}}}")
    hung = "line.auxiliary_wire.dropper"
    if not words.get("line.auxiliary_wire"):
        return
    if rng.random() < 0.5:
        strands(rng, words, hung)
    if "patterns" in str(words["line.auxiliary_wire"]):
        words[f"{hung}.patterns.0.pre_sag_mm"] = [0.0] * (
            str(words["line.auxiliary_wire"])
            .partition("positions_m=[")[2]
            .partition("]")[0]
            .count(",")
            + 1
        )
    elif not isinstance(words["line.span_m"], list) and rng.random() < 0.5:
        count = rng.randint(1, 5)
        words[f"{hung}.positions_m"] = ""
        words[f"{hung}.count"] = count
        words[f"{hung}.spacing_m"] = float(str(words["line.span_m"])) / (count + 1.0)


def _air_behind(rng: random.Random, words: Words) -> None:
    """A pantograph that runs the other way round has an uplift of its own."""
    table = "pantographs.reference.aerodynamics"
    if f"{table}.head_share" not in words:
        return
    words[f"{table}.reversed.head_share"] = rng.uniform(0.0, 1.0)
    if rng.random() < 0.5:
        words[f"{table}.reversed.uplift_polynomial"] = [0.0, 0.0, rng.uniform(0.0, 2e-3)]
    else:
        words[f"{table}.reversed.uplift_by_speed"] = [[50.0, 2.0], [300.0, rng.uniform(9, 90)]]
    words["train.pantographs.0.reversed"] = "true"


def _bogies(rng: random.Random, words: Words) -> None:
    """A track of any spectrum; a car body that also sways, if there is one."""
    if "vehicle.irregularity.spectrum" in words:
        words["vehicle.irregularity.spectrum"] = rng.choice(_SPECTRA_OF_TRACKS)
        shortest = float(str(words["vehicle.irregularity.shortest_m"]))
        words["vehicle.irregularity.longest_m"] = shortest * rng.uniform(1.5, 20.0)
    table = "vehicle.suspension"
    if f"{table}.body_mass_kg" not in words:
        return
    mass = float(str(words[f"{table}.body_mass_kg"]))
    words[f"{table}.lateral.roll_inertia_kg_m2"] = mass * rng.uniform(0.5, 2.0)
    words[f"{table}.lateral.stiffness_N_per_m"] = 10 ** rng.uniform(4.5, 6.0)
    words[f"{table}.lateral.damping_N_s_per_m"] = 10 ** rng.uniform(3.0, 5.0)
    words[f"{table}.lateral.spring_distance_m"] = rng.uniform(1.5, 2.5)
    words[f"{table}.lateral.centre_above_m"] = rng.uniform(0.0, 1.0)
    words[f"{table}.lateral.roof_above_m"] = rng.uniform(0.5, 3.0)


# --- random lines of all topologies in three dimensions -------------------------------------------


# Shares of the scenes.
_LATERAL, _ALONG = 0.35, 0.15
# Tables of wires that are whole tables in one word, which takes further keys after it.
_WHOLE_TABLES = ("stitch_wire", "auxiliary_wire", "bridle")


def put_planes(rng: random.Random, words: Words, topology: str) -> None:
    """Now and then each of the parts below."""
    if topology == "free":
        put_free(rng, words)
    if rng.random() < _LATERAL:
        _lateral(rng, words, topology)
    if rng.random() < _RARELY:
        _sway(rng, words)
    if rng.random() < _RARELY:
        _ends(rng, words)
    if "overlap" not in topology and rng.random() < 0.5 * _RARELY:
        _transition(rng, words)
    if rng.random() < _ALONG:
        _along(rng, words, topology)
    if "wind.speed_m_per_s" in words:
        _more_wind(rng, words)
    if rng.random() < _RARELY:
        _window(rng, words)
    if rng.random() < 0.5 * _RARELY:
        _adaptive(rng, words)
    put_details(rng, words)


# ---- wires in the horizontal plane --------------------------------------------------------------


def _lateral(rng: random.Random, words: Words, topology: str) -> None:
    """Stagger, steady arms as bars, now and then a curve."""
    words["effects.lateral_motion"] = "true"
    n = int(str(words["line.n_spans"]))
    words["line.stagger_m"] = rng.choice(
        (rng.uniform(-0.3, 0.3), [rng.uniform(-0.3, 0.3) for _ in range(n + 1)])
    )
    arm = _arm(words)
    if rng.random() < 0.8:
        words[f"{arm}.length_m"] = rng.uniform(0.5, 1.5)
        words[f"{arm}.inclination_deg"] = rng.uniform(0.0, 25.0)
        # Drawn apart, so that seeds that tests name go on to make the scenes that they name.
        apart = random.Random(words[f"{arm}.length_m"])
        if apart.random() < 0.3:
            words[f"{arm}.registration_stiffness_N_per_m"] = 10.0 ** apart.uniform(4.0, 7.0)
        # An inclined arm carries what follows from its slope.
        words[f"{arm}.holds_height"] = ""
    # A bar has no stiffness but what its radial force gives it.
    words[f"{arm}.stiffness_N_per_m"] = ""
    if topology.split("+")[0] not in ("free", "single") and rng.random() < 0.5:
        words["line.messenger_stagger_m"] = rng.uniform(-0.2, 0.2)
    if rng.random() < 0.4:
        _curve(rng, words)
    apart = random.Random(str(words["line.stagger_m"]))
    if apart.random() < 0.3:
        words["line.damping.lateral"] = (
            f"{{alpha_s={10 ** apart.uniform(-5, -2)!r},beta_per_s={apart.uniform(0.0, 5.0)!r}}}"
        )


def _arm(words: Words) -> str:
    """Where a scene has its steady arms."""
    free = str(words.get("line.links", ""))
    return f"line.links.{free.count('type=') - 1 - _links_behind(free)}" if free else _SIMPLE_ARM


_SIMPLE_ARM = "line.steady_arm"


def _links_behind(links: str) -> int:
    """How many links stand behind the steady arms in the list of a free line."""
    return links.rpartition("'steady_arms'")[2].count("type=")


def _curve(rng: random.Random, words: Words) -> None:
    places = masts(words)
    words["line.curve.radius_m"] = 10 ** rng.uniform(2.9, 4.5)
    words["line.curve.side"] = rng.choice(["'left'", "'right'"])
    words["line.curve.cant_mm"] = rng.uniform(0.0, 180.0)
    words["line.curve.rail_distance_mm"] = rng.uniform(1000.0, 1700.0)
    if rng.random() < 0.5:
        begin, end = sorted(rng.uniform(0.0, places[-1]) for _ in range(2))
        words["line.curve.from_m"], words["line.curve.to_m"] = begin, end + 1.0
        transition = rng.uniform(0.0, 0.49) * (end - begin)
        words["line.curve.transition_m"] = transition
        words["line.curve.cant_mm"] = min(float(str(words["line.curve.cant_mm"])), 10 * transition)


def _sway(rng: random.Random, words: Words) -> None:
    """Bases that move sideways under heads that roll, or follow a course over time or place."""
    end = float(str(words["train.end_m"])) + 100.0
    words["effects.vehicle_motion"] = "true"
    if "effects.head_roll" in words:
        words["vehicle.lateral.amplitude_m"] = rng.uniform(1e-3, 0.05)
        words["vehicle.lateral.frequency_hz"] = rng.uniform(0.3, 3.0)
        words["vehicle.lateral.phase_deg"] = rng.uniform(-180.0, 180.0)
    course = [[i * end / 5, rng.uniform(-0.02, 0.02)] for i in range(6)]
    direction = rng.choice(
        ("vertical", "lateral") if "effects.head_roll" in words else ("vertical",)
    )
    if rng.random() < 0.5:
        words[f"vehicle.{direction}.by_place"] = [[x - 100.0, y] for x, y in course]
    else:
        words[f"vehicle.{direction}.by_time"] = [[20.0 * i, y] for i, (_, y) in enumerate(course)]


# ---- along the track ----------------------------------------------------------------------------


_ENDS = ("ends.start", "ends.end", "overlap")


def _along(rng: random.Random, words: Words, topology: str) -> None:
    """Axial stiffness of all wires, ends, tensioners, mid-points and a temperature."""
    words["effects.axial_motion"] = "true"
    for table in wire_tables(words):
        if rng.random() < 0.5:
            words[f"{table}.axial_stiffness_N"] = 10 ** rng.uniform(6.3, 7.5)
        else:
            words[f"{table}.section_mm2"] = rng.uniform(30.0, 170.0)
            words[f"{table}.youngs_modulus_GPa"] = rng.uniform(80.0, 125.0)
        words[f"{table}.expansion_per_K"] = rng.uniform(1e-5, 2.5e-5)
    words[f"{_arm(words)}.length_m"] = rng.uniform(0.8, 1.5)
    places = masts(words)
    sides = [side for side in ("start", "end") if rng.random() < 0.5]
    for side in sides:
        words[f"line.ends.{side}.along"] = "'tensioner'"
    if "overlap" in topology:
        words["line.overlap.along"] = rng.choice(["'tensioner'", "'fixed'"])
    if len(places) > 2 and (len(sides) > 1 or "overlap" in topology or rng.random() < 0.3):
        words["line.mid_points_m"] = sorted(
            rng.sample(places[1:-1], rng.randint(1, len(places) - 2))
        )
    words["line.tensioner.ratio"] = rng.uniform(1.0, 5.0)
    words["line.tensioner.efficiency"] = rng.choice([1.0, rng.uniform(0.9, 1.0)])
    if rng.random() < 0.5:
        words["line.tensioner.travel_m"] = 10 ** rng.uniform(-3.0, 0.5)
        words["line.tensioner.stop_stiffness_N_per_m"] = 10 ** rng.uniform(4.0, 8.0)
    if topology.split("+")[0] != "free" and rng.random() < 0.3:
        tension = float(str(words["line.contact_wire.tension_N"]))
        mass = tension / (9.81 * float(str(words["line.tensioner.ratio"])))
        words["line.tensioner.weights_kg.contact_wire"] = mass
    if not any(words.get(f"line.{end}.along") == "'tensioner'" for end in _ENDS):
        for key in [key for key in words if key.startswith("line.tensioner.")]:
            del words[key]
    if rng.random() < 0.5:
        words["line.temperature.difference_K"] = rng.uniform(-40.0, 60.0)


def wire_tables(words: Words) -> list[str]:
    """Keys of all tables of wires of a scene."""
    if "line.wires" in words:
        return [f"line.wires.{i}" for i in range(str(words["line.wires"]).count("name="))]
    found = ["line.contact_wire"]
    found += [] if words.get("line.messenger_wire") == "" else ["line.messenger_wire"]
    return found + [f"line.{name}" for name in _WHOLE_TABLES if words.get(f"line.{name}")]


# ---- ends, transition spans, window, steps ------------------------------------------------------


def _ends(rng: random.Random, words: Words) -> None:
    """Layers outside of what is judged, or ends beyond which the line goes on."""
    places = masts(words)
    n = len(places) - 1
    first, last = (float(str(words[f"evaluation.{key}_m"])) for key in ("from", "to"))
    free = {
        "start": sum(mast <= first for mast in places[1:]),
        "end": sum(mast >= last for mast in places[:-1]),
    }
    for side in ("start", "end"):
        kind = rng.choice(("fixed", "absorbing_layer", "periodic"))
        spans = min(free[side], n - 1)
        if kind == "absorbing_layer" and spans:
            words[f"line.ends.{side}.spans"] = rng.randint(1, spans)
            words[f"line.ends.{side}.damping_per_s"] = 10 ** rng.uniform(-1.0, 1.0)
        elif kind == "absorbing_layer":
            continue
        words[f"line.ends.{side}.kind"] = f"'{kind}'"


def _transition(rng: random.Random, words: Words) -> None:
    """Rising end spans as far as the train does not run on them; the line gets longer by these."""
    n = int(str(words["line.n_spans"]))
    span = words["line.span_m"]
    if isinstance(span, list):
        return
    if len(words["line.stagger_m"]) if isinstance(words.get("line.stagger_m"), list) else 0:
        return
    words["line.n_spans"] = n + 1
    words["line.transition.n_spans_end"] = 1
    if float(str(words["train.start_m"])) - _rear(words) > float(str(span)) + 2.0:
        words["line.transition.n_spans_start"] = 1
    words["line.transition.rise_m"] = rng.uniform(0.0, 0.5)
    if rng.random() < 0.3 and "line.dropper.count" in words:
        words["line.transition.span_m"] = float(str(span)) * rng.uniform(0.95, 1.05)


def _rear(words: Words) -> float:
    """How far behind the first pantograph the last one is [m]."""
    _, behind, last = str(words["train.pantographs"]).rpartition("behind_m=")
    return float(last.partition("}")[0]) if behind else 0.0


def _window(rng: random.Random, words: Words) -> None:
    words["window.mode"] = rng.choice(("'exact'", "'bounded'"))
    if words["window.mode"] == "'bounded'" and rng.random() < 0.3:
        words["window.tolerance"] = 10 ** rng.uniform(-12.0, -3.0)
    elif words["window.mode"] == "'bounded'" and rng.random() < 0.5:
        words["window.spans_ahead"] = rng.randint(2, 5)
        words["window.spans_behind"] = rng.randint(2, 5)


def _adaptive(rng: random.Random, words: Words) -> None:
    if words.get("contact.law") == "'kinematic'" or "numerics.integrator" in words:
        return
    words["numerics.adaptive_tolerance_N"] = 10 ** rng.uniform(-1.0, 6.0)
    words["numerics.smallest_dt_s"] = float(str(words["numerics.dt_s"])) / rng.choice([2, 8, 32])


# ---- wind -------------------------------------------------------------


def _more_wind(rng: random.Random, words: Words) -> None:
    """Profiles, stretches and spectra of a wind that blows already."""
    words["wind.height_m"] = rng.uniform(2.0, 60.0)
    words["wind.reference_height_m"] = rng.uniform(5.0, 20.0)
    words["wind.roughness_length_m"] = 10 ** rng.uniform(-4.0, -0.1)
    words["wind.air_density_kg_per_m3"] = rng.uniform(1.0, 1.4)
    for table in wire_tables(words):
        words[f"{table}.drag_coefficient"] = rng.uniform(0.5, 1.6)
    if rng.random() < 0.5:
        words["wind.profile"], words["wind.exponent"] = "'power'", rng.uniform(0.0, 0.4)
    if rng.random() < 0.5:
        places = masts(words)
        begin, end = sorted(rng.uniform(0.0, 0.99 * places[-1]) for _ in range(2))
        words["wind.stretches"] = (
            f"[{{from_m={begin!r},to_m={end + 1e-3!r},speed_factor={rng.uniform(0.0, 2.0)!r},"
            f"height_m={rng.uniform(2.0, 100.0)!r}}}]"
        )
    if "wind.gusts.seed" not in words:
        return
    words["wind.gusts.decay"] = rng.uniform(2.0, 20.0)
    words["wind.gusts.decay_upward"] = rng.uniform(2.0, 20.0)
    words["wind.gusts.lowest_hz"] = 10 ** rng.uniform(-3.0, -1.5)
    words["wind.gusts.spacing_m"] = rng.uniform(2.0, 30.0)
    words["wind.gusts.growth_s"] = rng.choice([0.0, rng.uniform(0.0, 5.0)])
    intensity = rng.choice(("turbulence_intensity", "friction_velocity_m_per_s", ""))
    if intensity:
        words[f"wind.gusts.{intensity}"] = rng.uniform(0.05, 0.4)
    if rng.random() < 0.5:
        words["wind.gusts.spectrum"] = "'von_karman'"
        words["wind.gusts.length_scale_m"] = rng.uniform(30.0, 200.0)
