"""Schema of ``run.h5``, declared once: attributes, tables, their dimensions, units and bounds.

``result_file`` and ``dimensions`` write by these declarations, ``read.result_tables`` reads
against them.

Tables that grow do so by chunks, and a flush fills whole ones. A chunk is written once: a kill in
the midst of writing one spoils no checksum of earlier rows. Of long chunks a column of a pantograph
has its own, because it is read alone. Of the line's channels a chunk holds neighbouring columns:
those that are far from the train take no room if a window is recorded.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Any, NamedTuple, NotRequired

from pydantic import AfterValidator, BaseModel, ConfigDict, Field
from typing_extensions import TypedDict

from catenary.base.errors import InputError
from catenary.meshgen.wires import Role
from catenary.postproc.files.facts import FACTS
from catenary.postproc.files.facts import WIRE as CONTACT_WIRE
from catenary.postproc.files.header import GZIP, LineRecord
from catenary.postproc.standards.rule_books import (
    DEFAULT,
    LIMIT_KEYS,
    SYSTEMS,
    books_of_entries,
    editions_of,
)
from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.channels import Channel
from catenary.solver.waves.excitation import excitation_of_facts

FORMAT = "catenary-run-3"
RUNNING, DONE, INTERRUPTED = "running", "done", "interrupted"
# Committed row counts of the steps, the energies and the line's channels. They are written after
# the rows: a table may be longer after a kill.
COMPLETE = "complete_rows"
LINE_TIME = "line_channels/time"
# The times of the three kinds of rows.
CLOCKS = ("time", "energy/time", LINE_TIME)
# Beyond these sizes a recorded value is damage, by unit; the march itself ends a run whose contact
# force passes 1e9 N.
_LARGEST = {"s": 1e9, "m": 1e9, "N": 1e12, "J": 1e21, "-": 1e12}


def largest(unit: str) -> float:
    """Largest size of a valid value in a unit."""
    return _LARGEST.get(unit, _LARGEST["-"])


# ---- root attributes ---------------------------------------------------------------------------

# Marks an attribute that is stored as JSON text.
JSON = object()
# Marks an attribute on which no figure of a report depends: a damaged one takes its default.
DISPENSABLE = object()
# The default of one that is not there where it does not apply.
MISSING: Any = None


def read_by(read: Callable[[Any], object]) -> AfterValidator:
    """Validates a value by a function that fails at an invalid one."""

    def check(value: Any) -> Any:
        try:
            read(value)
        except (KeyError, TypeError, IndexError) as error:
            raise ValueError(str(error)) from error
        return value

    return AfterValidator(check)


def _read_watched(table: dict[str, Any]) -> None:
    if any((name == "remarks") != isinstance(value, list) for name, value in table.items()):
        raise ValueError("only remarks are a list")


def _read_rules(entries: Any) -> None:
    try:
        books_of_entries(entries)
    except InputError as error:
        raise ValueError(str(error)) from error


def _read_limits(table: dict[str, Any]) -> None:
    if not set(table) <= set(LIMIT_KEYS):
        raise ValueError("keys of limits")


_EDITIONS = list(editions_of(DEFAULT))
Number = Annotated[float, Field(allow_inf_nan=False)]


class _Sentence(TypedDict):
    says: str
    at_m: NotRequired[Number]
    nth: NotRequired[Annotated[int, Field(ge=0)]]


class _Incident(_Sentence):
    time_s: Number


class _Pantograph(TypedDict):
    kind: str
    description: str


class _Arrivals(TypedDict, total=False):
    pantographs: list[_Sentence]
    warnings: list[str]
    ends: list[str]


Text = Annotated[str, Field(pattern=r"^[^\x00-\x1f]*$", description="text")]
Count = Annotated[int, Field(ge=0, le=10**12, description="a whole number from 0")]
Positive = Annotated[int, Field(ge=1, le=10**12, description="a whole number from 1")]
_NotNegative = Annotated[float, Field(ge=0, le=1e12, description="a number of zero or more")]
_Numbers = Annotated[dict[str, Number], JSON, Field(description="a table of numbers")]
_Effects = Annotated[
    list[Annotated[list[str], Field(min_length=3, max_length=3)]],
    JSON,
    Field(description="a list of names with titles and reasons"),
]


class RunAttributes(BaseModel):
    """The root attributes; ``description`` is how an error names a valid value.

    Those without a default are needed for a report; others take it where they are missing.
    """

    model_config = ConfigDict(strict=True, defer_build=True)

    case: Text
    title: Annotated[Text, DISPENSABLE] = ""
    n_dofs: Positive
    system: Annotated[
        str, read_by(SYSTEMS.__getitem__), Field(description=f"one of {', '.join(SYSTEMS)}")
    ]
    rules: Annotated[
        list[Any],
        JSON,
        read_by(_read_rules),
        Field(min_length=1, description="a list of rule books"),
    ] = MISSING
    limits: Annotated[dict[str, Number], JSON, read_by(_read_limits)] = Field(
        default={}, description="a table of limits"
    )
    # Of files before there were rule books.
    edition: Annotated[
        str,
        read_by(_EDITIONS.index),
        Field(description=f"one of {', '.join(_EDITIONS)}"),
    ] = MISSING
    n_steps_planned: Positive
    n_steps_begun_for: Positive = MISSING
    n_ranks: Positive = 1
    created: Annotated[Text, DISPENSABLE] = "unknown"
    outcome: Annotated[str, DISPENSABLE] = Field(default=RUNNING, min_length=1, description="text")
    n_steps: Count = MISSING
    simulated_s: _NotNegative = MISSING
    marched_s: _NotNegative = MISSING
    march_wall_s: Annotated[_NotNegative, DISPENSABLE] = MISSING
    march_cpu_s: Annotated[_NotNegative, DISPENSABLE] = MISSING
    records_wall_s: Annotated[_NotNegative, DISPENSABLE] = MISSING
    config: Annotated[dict[str, Any], JSON, Field(description="a scene as JSON")]
    versions: Annotated[dict[str, Any], JSON] = Field(default={}, description="a table")
    effects_on: _Effects
    effects_off: _Effects
    pantographs: Annotated[list[_Pantograph], JSON] = Field(
        default=[], description="a list of tables of facts"
    )
    defects: Annotated[list[_Sentence], JSON] = Field(default=[], description="a list of sentences")
    incidents: Annotated[list[_Incident], JSON] = Field(
        default=[], description="a list of times with sentences"
    )
    arrivals: Annotated[_Arrivals, JSON] = Field(
        default=_Arrivals(), description="facts of waves from the ends, with sentences"
    )
    excitation: Annotated[
        dict[str, Any], JSON, read_by(lambda facts: facts and excitation_of_facts(facts))
    ] = Field(default={}, description="what sets the line into motion")
    wires: Annotated[
        dict[str, str],
        JSON,
        read_by(lambda roles: [Role(role) for role in roles.values()]),
        Field(min_length=1, description="a table of roles"),
    ]
    petsc_options: Annotated[list[Any], JSON] = Field(default=[], description="a list")
    n_strips: Annotated[list[Annotated[int, Field(ge=1, le=1000)]], JSON] = Field(
        default=[], description="a list of whole numbers"
    )
    line_record: Annotated[LineRecord, JSON] = Field(
        default=MISSING, description="what is recorded of the line"
    )
    detour: Text = ""
    window: Text = ""
    phase_wall_s: Annotated[_Numbers, DISPENSABLE] = {}
    inner_iterations: _Numbers = {}
    watched: Annotated[dict[str, Number | list[str]], JSON, read_by(_read_watched)] = Field(
        default={}, description="numbers of the march's watch, with sentences"
    )


# ---- tables ------------------------------------------------------------------------------------

ARM, DROPPER, WIRE_END = "steady_arm", "dropper", "wire_end"
# Sizes of dimensions that are the same in all files.
SIZES = {"upper_lower": 2, "xyz": 3, "from_to": 2, "radial_lift_along": 3, "smallest_largest": 2}
# The dimension of a channel's columns, by what a column stands for. Channels of the line have all
# of their columns in the extremes, and the recorded ones in ``line_channels``.
COLUMNS = {
    channels.PANTOGRAPH: "pantograph",
    channels.STRIP: "strip",
    channels.WIRE: "contact_wire_of_pantograph",
    channels.CONTACT: "contact",
    channels.ARM: f"recorded_{ARM}",
    channels.DROPPER: f"recorded_{DROPPER}",
    channels.WIRE_END: f"recorded_{WIRE_END}",
}
ALL_COLUMNS = {channels.ARM: ARM, channels.DROPPER: DROPPER, channels.WIRE_END: WIRE_END}
# Tables of the places along the track, by dimension.
PLACES = {ARM: "line/arm_x", DROPPER: "line/dropper_x", WIRE_END: "line/end_x"}


class Table(NamedTuple):
    """A table that is written once.

    Attributes
    ----------
    dimensions : names; one has the same size in all tables of a file
    unit, meaning : SI unit, "-" if none, and words
    coordinates : name of the table beside it that says where its rows are
    low, high : bounds of the values, inclusive
    whole : whether the numbers are stored as integers
    ascending : whether they ascend strictly
    may_be_nan : whether NaN is a value
    optional : whether a file may be without it
    """

    dimensions: tuple[str, ...]
    unit: str = "-"
    meaning: str = ""
    coordinates: str = ""
    low: float = -1e9
    high: float = 1e9
    whole: bool = False
    ascending: bool = False
    may_be_nan: bool = False
    optional: bool = False


def count_table(
    dimensions: tuple[str, ...], meaning: str = "", most: float = 1e12, optional: bool = False
) -> Table:
    """A table of numbers that count something from 0, up to ``most``."""
    return Table(dimensions, "-", meaning, low=0, high=most, whole=True, optional=optional)


def _force(dimensions: tuple[str, ...], meaning: str, optional: bool = False) -> Table:
    return Table(dimensions, "N", meaning, low=-1e12, high=1e12, optional=optional)


_PLACE = "position along the track"
CONSTANTS: dict[str, Table] = {
    "line/arm_x": Table((ARM,), "m", f"{_PLACE} of steady arms"),
    "line/arm_wire": count_table((ARM,), "number of the wire that each steady arm holds"),
    "line/dropper_x": Table((DROPPER,), "m", f"{_PLACE} of droppers"),
    "line/dropper_span": count_table((DROPPER,), "span of each dropper, from 0"),
    "line/droppers": count_table((DROPPER, "upper_lower"), "nodes of each dropper"),
    "line/end_x": Table((WIRE_END,), "m", f"{_PLACE} of ends of wires", optional=True),
    "line/end_wire": count_table((WIRE_END,), "number of the wire", optional=True),
    "line/end_outwards": Table(
        (WIRE_END,), "-", "1 where the wire ends, -1 where it begins",
        low=-1, high=1, whole=True, optional=True,
    ),
    "line/node_points": Table(("node", "xyz"), "m", "places of the nodes at rest"),
    "line/support_x": Table(("support",), "m", f"{_PLACE} of supports", ascending=True),
    "line/running_range": Table(("from_to",), "m", "where trains run"),
    "line/evaluation_range": Table(("from_to",), "m", "stretch of the statistics", ascending=True),
    "static/dropper_length": Table((DROPPER,), "m", "length of droppers as cut"),
    "static/dropper_force": _force((DROPPER,), "tension of droppers at rest"),
    "static/contact_x": Table(("contact_node",), "m", f"{_PLACE} of the contact wires' nodes"),
    "static/contact_height": Table(
        ("contact_node",), "m", "height of the contact wires at rest", "contact_x"
    ),
    "static/contact_y": Table(
        ("contact_node",), "m", "lateral position of the contact wires at rest", "contact_x",
        optional=True,
    ),
    "static/elasticity_x": Table(("elasticity_place",), "m", f"{_PLACE} of the unit force"),
    "static/elasticity": Table(
        ("elasticity_place",), "m/N", "lift of a head under a unit force", "elasticity_x"
    ),
    "static/elasticity_of_wires": Table(
        ("elasticity_place", "contact_wire"), "m/N",
        "lift of each contact wire under a unit force on it alone", "elasticity_x", may_be_nan=True,
    ),
    "static/arm_stagger": Table(
        (ARM,), "m", "lateral position of the wire at steady arms", optional=True
    ),
    "static/arm_force": _force(
        (ARM, "radial_lift_along"), "force of steady arms at rest", optional=True
    ),
    "static/arm_tension": _force((ARM,), "tension of steady arms at rest", optional=True),
}  # fmt: skip
COUNTS = Table(
    ("clock",), "-", "rows that are whole: of channels, energies, and channels of the line"
)


def constant_tables(wires: Iterable[str], breaks: Iterable[str]) -> dict[str, Table]:
    """All tables of a file that are written once, but the facts.

    Parameters
    ----------
    wires : iterable of str
        Names of the wires.
    breaks : iterable of str
        Names of the wires of several pieces.
    """
    tables = dict(CONSTANTS)
    for name in wires:
        meaning = f"wires of {name}: numbers of nodes"
        tables[f"line/wires/{name}"] = count_table((f"wires_{name}",), meaning)
    for name in breaks:
        meaning = f"breaks of {name}: numbers of nodes"
        tables[f"line/breaks/{name}"] = count_table((f"breaks_{name}",), meaning)
    for name in channels.line_channels():
        columns, meaning = (
            COLUMNS[channels.CHANNELS[name].per],
            f"which columns of {name} are recorded, from 0",
        )
        tables[f"line_columns/{name}"] = count_table((columns,), meaning, optional=True)
    return tables


def fact_tables() -> dict[str, Table]:
    """Tables of the facts, from ``FACTS``."""
    per = {channels.PANTOGRAPH: ("pantograph",), CONTACT_WIRE: ("contact_wire",)}
    return {
        f"facts/{name}": Table(
            per.get(fact.per, ()), fact.unit, fact.meaning,
            low=fact.low, high=fact.high, may_be_nan=fact.may_be_nan,
        )
        for name, fact in FACTS.items()
    }  # fmt: skip


def growing_tables(
    record: LineRecord, train: channels.TrainLayout | None = None
) -> tuple[dict[str, Channel], dict[str, Channel], dict[str, Channel]]:
    """Tables that grow by rows: of the steps, the energies and the line's channels, clocks first.

    Parameters
    ----------
    record : LineRecord
        Which of the line's channels are recorded.
    train : channels.TrainLayout, optional
        Train whose channels are recorded, None for all channels.
    """
    of_train = {f"channels/{c.name}": c for c in channels.train_channels(train)}
    of_line = {f"line_channels/{name}": channels.CHANNELS[name] for name in record.names}
    energies = {f"energy/{c.name}": c for c in channels.ENERGIES.values()}
    return {"time": channels.TIME, **of_train}, energies, {LINE_TIME: channels.TIME, **of_line}


# ---- chunks ------------------------------------------------------------------------------------

# Largest numbers of rows of a chunk: of one column, and of a block of columns.
_ROWS_OF_ONE, _ROWS_OF_MANY = 4096, 512
# Shorter chunks hold all columns of a table: there would be too many of them.
_LEAST_OF_ONE = 512
BLOCK = 64


class Chunk(NamedTuple):
    """Rows and columns of a chunk."""

    rows: int
    columns: int


def chunks_of(
    table: Mapping[str, tuple[Channel, int]], n_steps: int, rows_per_flush: int, every: int
) -> dict[str, Chunk]:
    """Shapes of the chunks by path.

    Parameters
    ----------
    table : mapping
        Path -> channel and columns.
    n_steps : int
        Steps that are planned after step 0.
    rows_per_flush : int
        Steps of a flush.
    every : int
        Steps between two rows of the line's channels.
    """
    # Rows that are appended at once, and that are planned.
    line = max(1, rows_per_flush // every), n_steps // every + 1
    step = rows_per_flush, n_steps + 1
    shapes = {}
    for path, (channel, columns) in table.items():
        if path.startswith("energy/"):
            # Its rows are few, and not so many a flush.
            shapes[path] = Chunk(min(_ROWS_OF_MANY, n_steps + 1), 1)
        elif channel.of_line:
            n_blocks = max(1, math.ceil(columns / BLOCK))
            rows = _rows(*line, _ROWS_OF_MANY)
            shapes[path] = Chunk(rows, max(1, math.ceil(columns / n_blocks)))
        else:
            rows = _rows(*(line if path.startswith("line_channels/") else step), _ROWS_OF_ONE)
            shapes[path] = Chunk(rows, 1 if rows >= _LEAST_OF_ONE else max(1, columns))
    return shapes


def room_of(
    table: Mapping[str, tuple[Channel, int]],
    chunks: Mapping[str, Chunk],
    rows: int,
    record: LineRecord,
) -> int:
    """Most bytes that an append adds to a file, in whole chunks [B].

    Parameters
    ----------
    table : mapping of str to tuple
        Channel and number of columns by path in the file.
    chunks : mapping of str to Chunk
        Shapes of chunks by path.
    rows : int
        Number of steps that are appended.
    record : LineRecord
        Recorded part of the line.
    """
    total = 0
    for path, (channel, columns) in table.items():
        shape = chunks[path]
        across = math.ceil(max(columns, 1) / shape.columns) * shape.columns
        added = math.ceil(rows / shape.rows)
        # The chunks that were begun move if they are compressed, or get neighbours in a window.
        moves = record.window is not None or record.compression == GZIP
        added += channel.of_line and moves
        total += 8 * across * shape.rows * added
    return total


def _rows(per_flush: int, planned: int, most: int) -> int:
    """The largest part of a flush with at most ``most`` rows, and not more than are planned."""
    parts = math.ceil(per_flush / most)
    even = next((n for n in range(parts, 4 * parts) if per_flush % n == 0), parts)
    return max(1, min(math.ceil(per_flush / even), planned))
