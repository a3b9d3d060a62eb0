"""The attributes and datasets of a result file, declared once: kind, range, what may be missing.

``sound_file`` reads a file against these tables.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.meshgen.wires import Role
from catenary.postproc.channels.line_record import LineRecord, from_table
from catenary.postproc.standards.en50367 import EDITIONS, SYSTEMS
from catenary.solver.time_loop.views import channels
from catenary.solver.waves.excitation import excitation_of_facts

# Beyond these sizes a recorded value is damage, by unit; the march itself ends a run whose contact
# force passes 1e9 N.
LARGEST = {"s": 1e9, "m": 1e9, "N": 1e12, "J": 1e21, "-": 1e12}
REQUIRED = object()
# Files whose line channels stand beside the others, at every step, without extremes.
_FIRST_FORMAT = "catenary-run-1"
_FIRST_LINE_CHANNELS = ("arm_uplift", "dropper_force")
# Files without facts, which are read, but not continued.
EARLIER_FORMATS = (_FIRST_FORMAT, "catenary-run-2")
# Roles of wires in files without: all such lines are simple catenaries.
SIMPLE_CATENARY = {CONTACT_WIRE: Role.CONTACT.value, MESSENGER_WIRE: Role.MESSENGER.value}


class Attribute(NamedTuple):
    """A root attribute.

    ``must_be`` says in words what ``sound`` tests, for a message; ``is_json`` whether it is stored
    as JSON; ``fallback`` is the value taken in place of a missing or damaged one, ``REQUIRED`` if
    there is none.
    """

    must_be: str
    sound: Callable[[Any], bool]
    is_json: bool = False
    fallback: Any = REQUIRED


class Constant(NamedTuple):
    """A dataset that is written once: letters for its dimensions, and bounds of its values.

    A letter stands for the same size in all datasets; a digit is that size itself. ``low`` and
    ``high`` are inclusive; ``ascending`` means strictly. ``whole`` numbers are stored as integers;
    NaN ``may_be`` a value; what is ``later`` is not in all files of the format.
    """

    shape: str
    low: float = -LARGEST["m"]
    high: float = LARGEST["m"]
    whole: bool = False
    ascending: bool = False
    may_be_nan: bool = False
    later: bool = False


class Growing(NamedTuple):
    """A dataset that grows by a row a step.

    ``columns`` is the letter of the columns' number, empty for one value a row; ``essential``
    whether the run ends, for a reader, where this one is damaged; ``may_be_nan`` whether NaN is a
    value.
    """

    unit: str
    columns: str
    essential: bool = False
    may_be_nan: bool = False


def is_number(value: Any, low: float = -math.inf, high: float = math.inf) -> bool:
    """Whether ``value`` is a finite number within bounds."""
    known = isinstance(value, (int, float)) and not isinstance(value, bool)
    return known and math.isfinite(value) and low <= value <= high


def is_whole(value: Any, low: int = 0, high: int = 10**12) -> bool:
    """Whether ``value`` is an integer within bounds."""
    return isinstance(value, int) and not isinstance(value, bool) and low <= value <= high


def is_text(value: Any) -> bool:
    """Whether ``value`` is text without control characters."""
    return isinstance(value, str) and not any(ord(letter) < 32 for letter in value)


def _not_negative(fallback: Any) -> Attribute:
    return Attribute(
        "a number of zero or more", lambda value: is_number(value, 0.0, 1e12), fallback=fallback
    )


def _whole(low: int, fallback: Any = REQUIRED) -> Attribute:
    return Attribute(
        f"a whole number from {low}", lambda value: is_whole(value, low), fallback=fallback
    )


def _text(fallback: Any = REQUIRED) -> Attribute:
    return Attribute("text", is_text, fallback=fallback)


def _one_of(known: Mapping[str, Any]) -> Attribute:
    return Attribute(
        "one of " + ", ".join(known), lambda value: isinstance(value, str) and value in known
    )


def _table_of_numbers(value: Any) -> bool:
    return isinstance(value, dict) and all(is_number(v) for v in value.values())


def _line_record(value: Any) -> bool:
    try:
        record = from_table(value)
    except (KeyError, TypeError, ValueError, IndexError):
        return False
    ends = [*(record.window or ()), *(record.stretch or ())]
    return (
        1 <= record.every <= 10**9
        and all(map(math.isfinite, ends))
        and set(record.names) <= set(channels.line_channels())
    )


def _effects(value: Any) -> bool:
    return isinstance(value, list) and all(
        isinstance(row, list) and len(row) == 3 and all(isinstance(word, str) for word in row)
        for row in value
    )


def _defects(value: Any) -> bool:
    return isinstance(value, list) and all(
        isinstance(fact, dict)
        and is_number(fact.get("at_m", 0.0))
        and isinstance(fact.get("says"), str)
        for fact in value
    )


def _incidents(value: Any) -> bool:
    return _defects(value) and all(is_number(fact.get("time_s")) for fact in value)


def _arrivals(value: Any) -> bool:
    if not isinstance(value, dict):
        return False
    rows, warnings = value.get("pantographs", []), value.get("warnings", [])
    ends = value.get("ends", [])
    return (
        isinstance(rows, list)
        and all(isinstance(row, dict) and isinstance(row.get("says"), str) for row in rows)
        and all(isinstance(texts, list) for texts in (warnings, ends))
        and all(isinstance(text, str) for text in [*warnings, *ends])
    )


def _excitation(value: Any) -> bool:
    try:
        return not value or bool(excitation_of_facts(value))
    except (KeyError, TypeError, ValueError):
        return False


def _wires(value: Any) -> bool:
    roles = {role.value for role in Role}
    return isinstance(value, dict) and bool(value) and set(map(str, value.values())) <= roles


def _pantographs(value: Any) -> bool:
    return isinstance(value, list) and all(
        isinstance(row, dict)
        and all(isinstance(row.get(name), str) for name in ("kind", "description") if row)
        for row in value
    )


def _watched(value: Any) -> bool:
    if not isinstance(value, dict):
        return False
    remarks = value.get("remarks", [])
    numbers = {name: number for name, number in value.items() if name != "remarks"}
    texts = isinstance(remarks, list) and all(isinstance(text, str) for text in remarks)
    return texts and _table_of_numbers(numbers)


ATTRIBUTES: dict[str, Attribute] = {
    "case": _text(),
    "title": _text(""),
    "n_dofs": _whole(1),
    "system": _one_of(SYSTEMS),
    "edition": _one_of(EDITIONS),
    "n_steps_planned": _whole(1),
    "n_steps_begun_for": _whole(1, None),
    "n_ranks": _whole(1, 1),
    "created": _text("unknown"),
    "outcome": Attribute("text", lambda v: isinstance(v, str) and bool(v), fallback="running"),
    "n_steps": _whole(0, None),
    "simulated_s": _not_negative(None),
    "marched_s": _not_negative(None),
    "march_wall_s": _not_negative(None),
    "march_cpu_s": _not_negative(None),
    "records_wall_s": _not_negative(None),
    "config": Attribute("a scene as JSON", lambda v: isinstance(v, dict), is_json=True),
    "versions": Attribute("a table", lambda v: isinstance(v, dict), True, {}),
    "effects_on": Attribute("a list of names with titles and reasons", _effects, True),
    "effects_off": Attribute("a list of names with titles and reasons", _effects, True),
    "pantographs": Attribute("a list of tables of facts", _pantographs, True, []),
    "defects": Attribute("a list of sentences", _defects, True, []),
    "incidents": Attribute("a list of times with sentences", _incidents, True, []),
    "arrivals": Attribute("facts of waves from the ends, with sentences", _arrivals, True, {}),
    "excitation": Attribute("what sets the line into motion", _excitation, True, {}),
    "wires": Attribute("a table of roles", _wires, True, SIMPLE_CATENARY),
    "petsc_options": Attribute("a list", lambda v: isinstance(v, list), True, []),
    "n_strips": Attribute(
        "a list of whole numbers",
        lambda v: isinstance(v, list) and all(is_whole(n, 1, 1000) for n in v),
        True,
        [],
    ),
    "line_record": Attribute("what is recorded of the line", _line_record, True, None),
    "detour": _text(""),
    "window": _text(""),
    "phase_wall_s": Attribute("a table of numbers", _table_of_numbers, True, {}),
    "inner_iterations": Attribute("a table of numbers", _table_of_numbers, True, {}),
    "watched": Attribute("numbers of the march's watch, with sentences", _watched, True, {}),
}

# Letters: A arms, D droppers, G wire ends, N nodes, M masts, W contact wires, C their nodes, E
# places of the elasticity.
_NUMBERS = Constant("D", 0, 1e12, whole=True)
# Nodes of a wire, and where in them its further pieces begin.
WIRE, BREAKS = _NUMBERS._replace(shape="*"), Constant("*", 1, 1e12, whole=True)
CONSTANTS: dict[str, Constant] = {
    "line/arm_x": Constant("A"),
    "line/arm_wire": Constant("A", 0, 1e6, whole=True, later=True),
    "line/dropper_x": Constant("D"),
    "line/end_x": Constant("G", later=True),
    "line/end_wire": Constant("G", 0, 1e6, whole=True, later=True),
    "line/end_outwards": Constant("G", -1, 1, whole=True, later=True),
    "line/node_points": Constant("N3"),
    "line/support_x": Constant("M", ascending=True),
    "line/dropper_span": _NUMBERS,
    "line/running_range": Constant("2"),
    "line/evaluation_range": Constant("2", ascending=True),
    "line/droppers": _NUMBERS._replace(shape="D2"),
    "static/dropper_length": Constant("D"),
    "static/dropper_force": Constant("D", -LARGEST["N"], LARGEST["N"]),
    "static/contact_x": Constant("C"),
    "static/contact_height": Constant("C"),
    "static/elasticity_x": Constant("E"),
    "static/elasticity": Constant("E"),
    "static/elasticity_of_wires": Constant("EW", may_be_nan=True, later=True),
    "static/arm_stagger": Constant("A", later=True),
    "static/arm_force": Constant("A3", -LARGEST["N"], LARGEST["N"], later=True),
    "static/arm_tension": Constant("A", -LARGEST["N"], LARGEST["N"], later=True),
    "static/contact_y": Constant("C", later=True),
}

# Letters of the columns of a channel: those that are recorded, and all that there are.
_LETTERS = {
    channels.PANTOGRAPH: "P",
    channels.STRIP: "S",
    channels.WIRE: "F",
    channels.CONTACT: "K",
    channels.ARM: "a",
    channels.DROPPER: "d",
    channels.WIRE_END: "g",
}
_ALL_OF = {channels.ARM: "A", channels.DROPPER: "D", channels.WIRE_END: "G"}
CLOCK = Growing("s", "", essential=True)
LINE_CLOCK = "line_channels/time"


def largest(unit: str) -> float:
    """The largest size of a recorded value that is no damage."""
    return LARGEST.get(unit, LARGEST["-"])


def line_columns() -> dict[str, tuple[str, str]]:
    """Where files that do not record all columns of a line's channel list them, and the letters of
    recorded and all columns."""
    own = (channels.CHANNELS[name] for name in channels.line_channels())
    return {f"line_columns/{c.name}": (_LETTERS[c.per], _ALL_OF[c.per]) for c in own}


def step_tables() -> tuple[dict[str, Growing], dict[str, Growing]]:
    """The tables of pantographs and strips by path: those of every run, and the others."""
    declared = {
        f"channels/{c.name}": Growing(c.unit, _LETTERS[c.per], c.essential, c.may_be_nan)
        for c in channels.train_channels()
    }
    always = {path: table for path, table in declared.items() if table.essential}
    return always, {path: table for path, table in declared.items() if not table.essential}


def energy_tables() -> dict[str, Growing]:
    """The tables of the energies by path, the clock first."""
    return {
        f"energy/{channel.name}": Growing(channel.unit, "", channel.essential)
        for channel in channels.ENERGIES.values()
    }


def line_tables(about: Mapping[str, Any]) -> tuple[dict[str, Growing], dict[str, Growing]]:
    """The line's channels of a file with these root attributes: with the steps, and apart.

    In files of the first format they stand with the steps. Small letters are recorded columns.
    """

    def declared(name: str) -> Growing:
        channel = channels.CHANNELS[name]
        return Growing(channel.unit, _LETTERS[channel.per], may_be_nan=channel.may_be_nan)

    if about.get("format") == _FIRST_FORMAT:
        return {f"channels/{name}": declared(name) for name in _FIRST_LINE_CHANNELS}, {}
    told = about.get("line_record")
    record = LineRecord() if told is None else from_table(told)
    apart = {f"line_channels/{name}": declared(name) for name in record.names}
    if record.window is not None:
        apart = {path: table._replace(may_be_nan=True) for path, table in apart.items()}
    return {}, {LINE_CLOCK: CLOCK, **apart}
