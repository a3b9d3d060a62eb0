"""Rule books: the criteria of standards as data, and the quantities that they limit.

``QUANTITIES`` and ``LIMIT_KEYS`` are what a book may judge and which keys of a scene may limit it;
``evaluate.observations`` takes the quantities from a run. A limit is arithmetic of four forms, no
more: a number, a polynomial of the speed, or a share of another quantity, of another criterion's
limit, or of a key of the scene. Nothing is evaluated as code. The shipped books are the TOML files
in ``books``, found from the folder.
"""

from __future__ import annotations

import difflib
import functools
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from numpy.polynomial.polynomial import polyval
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    field_validator,
    model_validator,
)

from catenary.base.errors import InputError

SYSTEMS = {"ac": "AC", "dc_3kv": "DC 3 kV", "dc_1500v": "DC 1.5 kV"}
KMH = 3.6  # km/h in 1 m/s; books state limits over the speed in km/h

# Parts of a run that a quantity has a value for.
RUN, PANTOGRAPH = "run", "pantograph"
# Speeds in km/h come from m/s with a rounding error: 200 km/h is 55.555... m/s.
_ROUNDING = 1e-9
_NAME = r"^[a-z][a-z0-9_]*$"
_LONGEST = 500
_FORMS = ("value", "polynomial", "of_quantity", "of_limit", "of_key")
Text = Annotated[str, Field(max_length=_LONGEST, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$")]
Number = Annotated[float, Field(ge=-1e9, le=1e9)]
_FOLDER = Path(__file__).with_name("books")
# By which a run is judged whose scene names no book: the newest edition of it.
DEFAULT = "en50367"


class Quantity(NamedTuple):
    """A quantity: unit in which books state its limits, meaning, what has a value of it, and
    whether it is a number of the scene, which stands at a limit on purpose."""

    unit: str
    meaning: str
    per: str = RUN
    given: bool = False


class LimitKey(NamedTuple):
    """A key of ``evaluation.limits``: unit, meaning."""

    unit: str
    meaning: str


QUANTITIES: dict[str, Quantity] = {
    "mean_force": Quantity("N", "mean contact force below 20 Hz", PANTOGRAPH),
    "force_std": Quantity("N", "standard deviation of the contact force below 20 Hz", PANTOGRAPH),
    "force_max": Quantity("N", "largest contact force below 20 Hz", PANTOGRAPH),
    "force_min": Quantity("N", "smallest contact force below 20 Hz", PANTOGRAPH),
    "force_stat_max": Quantity(
        "N", "mean contact force plus three standard deviations", PANTOGRAPH
    ),
    "force_stat_min": Quantity(
        "N", "mean contact force minus three standard deviations", PANTOGRAPH
    ),
    "contact_height_range": Quantity(
        "mm", "highest minus lowest contact point, below 20 Hz", PANTOGRAPH
    ),
    "arcing": Quantity("%", "share of time in losses of contact of 5 ms and longer", PANTOGRAPH),
    "strip_place": Quantity(
        "mm", "farthest place of a contact wire from the middle of the strips", PANTOGRAPH
    ),
    "strip_half_length": Quantity("mm", "half length of the strips", PANTOGRAPH, given=True),
    "distance_ahead": Quantity("m", "distance to the pantograph ahead", PANTOGRAPH, given=True),
    "arm_uplift": Quantity("mm", "largest uplift of the contact wire at a steady arm"),
    "train_speed": Quantity("km/h", "speed of the train", given=True),
    "wave_speed": Quantity("km/h", "speed of the slowest wave of the contact wire", given=True),
    "wire_height_max": Quantity("mm", "largest height of the contact wire at rest"),
    "wire_height_min": Quantity("mm", "smallest height of the contact wire at rest"),
    "wire_gradient": Quantity(
        "per mille", "largest gradient of the contact wire at rest from steady arm to steady arm"
    ),
    "wire_gradient_change": Quantity(
        "per mille", "largest change of that gradient at a steady arm"
    ),
    "wire_lateral_place": Quantity(
        "mm", "farthest place of the contact wire at rest from the axis of the track"
    ),
    "lateral_sweep": Quantity(
        "mm/s", "mean speed of the contact point across the strips, by the wire at rest"
    ),
    "elasticity_variation": Quantity(
        "%", "largest minus smallest elasticity over their sum, in the reference span"
    ),
    "dropper_force_max": Quantity("N", "largest force of a dropper"),
    "dropper_compression": Quantity("N", "largest compression of a dropper"),
    "dropper_slackenings": Quantity("times", "how often the same dropper slackens, at most"),
    "contact_wire_tension": Quantity("N", "largest tension of a contact wire"),
    "contact_wire_strain": Quantity(
        "um/m", "largest bending strain of a contact wire under the contact force (estimate)"
    ),
}

LIMIT_KEYS: dict[str, LimitKey] = {
    "uplift_space_mm": LimitKey("mm", "space that a steady arm leaves to the wire's uplift"),
    "working_width_mm": LimitKey("mm", "width of the head on which the contact wire may run"),
    "wire_lateral_place_mm": LimitKey("mm", "allowed distance of the wire at rest from the axis"),
    "wire_height_min_mm": LimitKey("mm", "lowest allowed contact wire at rest"),
    "wire_height_max_mm": LimitKey("mm", "highest allowed contact wire at rest"),
    "lateral_sweep_mm_per_s": LimitKey("mm/s", "least speed of the contact point across strips"),
    "elasticity_variation_percent": LimitKey("%", "allowed variation of the elasticity in a span"),
    "arcing_percent": LimitKey("%", "allowed share of time in losses of contact"),
    "dropper_force_N": LimitKey("N", "allowed force of a dropper"),
    "dropper_compression_N": LimitKey("N", "compression at which a dropper buckles"),
    "dropper_slackenings": LimitKey("times", "how often a dropper may slacken"),
    "contact_wire_tension_N": LimitKey("N", "allowed tension of a contact wire, worn as it is"),
    "contact_wire_strain_um_per_m": LimitKey("um/m", "allowed bending strain of a contact wire"),
}


class _Part(BaseModel):
    # The validator of a book, which includes those of its parts, is built at its first use.
    model_config = ConfigDict(
        strict=True, extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True
    )


class Conditions(NamedTuple):
    """Conditions that choose the row of a limit: speed [km/h], supply, stops above steady arms."""

    speed: float
    supply: str
    stops: bool = False


class LimitRow(_Part):
    """A limit under conditions: one of ``value``, ``polynomial``, ``of_...``; the last three times
    ``times`` over ``over``.

    Attributes
    ----------
    supply : for which supplies it holds, all if empty
    up_to_km_h, below_km_h : up to which speed [km/h], including it or not
    stops : whether it holds with or without stops above the steady arms, None for both
    value : in the unit of the quantity
    polynomial : coefficients of v^0, v^1, ..., v in km/h
    of_quantity, of_limit, of_key : a quantity, id of a criterion of the book, key of the scene
    """

    supply: Annotated[list[str], Field(max_length=10)] = []
    up_to_km_h: Annotated[float, Field(gt=0)] | None = None
    below_km_h: Annotated[float, Field(gt=0)] | None = None
    stops: bool | None = None
    value: Number | None = None
    polynomial: Annotated[list[Number], Field(min_length=1, max_length=5)] | None = None
    of_quantity: Text | None = None
    of_limit: Text | None = None
    of_key: Text | None = None
    times: Annotated[float, Field(gt=0, le=1e6)] = 1.0
    over: Annotated[float, Field(gt=0, le=1e6)] = 1.0

    @model_validator(mode="after")
    def _one_form(self) -> LimitRow:
        given = [name for name in _FORMS if getattr(self, name) is not None]
        if len(given) != 1:
            but = "none is given" if not given else f"{' and '.join(given)} are given"
            raise ValueError(f"needs exactly one of {', '.join(_FORMS)}, but {but}")
        if given[0] in _FORMS[:2] and (self.times, self.over) != (1.0, 1.0):
            raise ValueError(f"has times or over, which {given[0]} does not take")
        if self.up_to_km_h is not None and self.below_km_h is not None:
            raise ValueError("needs one of up_to_km_h and below_km_h, but both are given")
        _known("supply", self.supply, SYSTEMS)
        _known("of_quantity", [self.of_quantity] if self.of_quantity else [], QUANTITIES)
        _known("of_key", [self.of_key] if self.of_key else [], LIMIT_KEYS)
        return self

    def holds(self, conditions: Conditions) -> bool:
        """Whether it is the limit under conditions that no earlier row covers."""
        v = conditions.speed
        return (
            (not self.supply or conditions.supply in self.supply)
            and (self.up_to_km_h is None or v <= self.up_to_km_h * (1.0 + _ROUNDING))
            and (self.below_km_h is None or v < self.below_km_h * (1.0 - _ROUNDING))
            and (self.stops is None or self.stops == conditions.stops)
        )

    def number(self, speed: float) -> float | None:
        """The limit at a speed [km/h], None if it depends on something else."""
        if self.polynomial is not None:
            return float(polyval(speed, self.polynomial))
        return self.value

    def share(self, of: float) -> float:
        """The limit, from what it is a share of."""
        return self.times * of / self.over

    def words(self, unit: str) -> str:
        """The limit as a formula, without its conditions."""
        if self.value is not None:
            return f"{self.value:g} {unit}".rstrip()
        if self.polynomial is not None:
            return f"{_polynomial(self.polynomial)} {unit}".rstrip()
        over = f" / {self.over:g}" if self.over != 1.0 else ""
        times = f"{self.times:g} x " if self.times != 1.0 else ""
        if self.of_limit:
            return f"{times}the limit of {self.of_limit}{over}"
        what = self.of_quantity or f"evaluation.limits.{self.of_key}"
        return f"{times}{what}{over}"

    def when(self) -> str:
        """Its conditions in words, empty if it holds always."""
        parts = [", ".join(SYSTEMS[name] for name in self.supply)] if self.supply else []
        parts += [] if self.up_to_km_h is None else [f"up to {self.up_to_km_h:g} km/h"]
        parts += [] if self.below_km_h is None else [f"below {self.below_km_h:g} km/h"]
        parts += [] if self.stops is None else ["with stops" if self.stops else "without stops"]
        return ", ".join(parts)


def _polynomial(coefficients: list[float]) -> str:
    powers = ("", " v", *(f" v^{n}" for n in range(2, len(coefficients))))
    terms = [f"{c:.12g}{p}" for c, p in zip(coefficients, powers, strict=False) if c]
    return " + ".join(reversed(terms)).replace("+ -", "- ") or "0"


def _as_list(value: Any) -> Any:
    return [value] if isinstance(value, dict | LimitRow) else value


class Rule(_Part):
    """A criterion of a book.

    Attributes
    ----------
    id : name within the book
    title : in words, as tables name it
    quantity : key of ``QUANTITIES``; the id where it is not given
    relation : how the value must stand to the limit
    limit : rows, of which the first that holds is the limit
    clause : where the limit stands
    compared : whether the limit was compared with the text of the standard; None as the book says
    note : remark on the criterion
    """

    id: Annotated[str, Field(max_length=60, pattern=_NAME)]
    title: Annotated[Text, Field(min_length=1)]
    quantity: Text
    relation: Literal["<=", "<", ">=", ">"]
    limit: Annotated[list[LimitRow], BeforeValidator(_as_list), Field(min_length=1, max_length=100)]
    clause: Text = ""
    compared: bool | None = None
    note: Text = ""

    @model_validator(mode="before")
    @classmethod
    def _with_quantity(cls, table: Any) -> Any:
        known = isinstance(table, dict) and "id" in table
        return {"quantity": table["id"], **table} if known else table

    @field_validator("quantity")
    @classmethod
    def _is_known(cls, name: str) -> str:
        _known("quantity", [name], QUANTITIES)
        return name

    @property
    def unit(self) -> str:
        """Unit of value and limit."""
        return QUANTITIES[self.quantity].unit

    @property
    def per_pantograph(self) -> bool:
        """Whether each pantograph is judged."""
        return QUANTITIES[self.quantity].per == PANTOGRAPH

    def row(self, conditions: Conditions) -> LimitRow | None:
        """The row that holds under conditions, None if the book has no limit for them."""
        return next((row for row in self.limit if row.holds(conditions)), None)

    def words(self) -> str:
        """The limit in words, with the conditions of its rows."""
        limits = []
        for row in self.limit:
            when = row.when()
            limits.append(f"{row.words(self.unit)} ({when})" if when else row.words(self.unit))
        return f"{self.relation} {'; '.join(limits)}"


class RuleBook(_Part):
    """A rule book.

    Attributes
    ----------
    name, edition : ``name:edition`` chooses it in a scene
    title : as cited
    source : where its limits come from
    compared : whether they were compared with the text of the standard
    criteria : in the order of tables
    """

    name: Annotated[str, Field(max_length=40, pattern=_NAME)]
    edition: Annotated[str, Field(max_length=20, pattern=r"^[A-Za-z0-9.+-]*$")] = ""
    title: Annotated[Text, Field(min_length=1)]
    source: Annotated[str, Field(max_length=2000, pattern=r"^[^\x00-\x09\x0b-\x1f\x7f-\x9f]*$")] = (
        ""
    )
    compared: bool = False
    criteria: Annotated[list[Rule], Field(min_length=1, max_length=200)]

    @model_validator(mode="after")
    def _consistent(self) -> RuleBook:
        rules = {rule.id: rule for rule in self.criteria}
        if len(rules) < len(self.criteria):
            ids = [rule.id for rule in self.criteria]
            twice = next(name for name in ids if ids.count(name) > 1)
            raise ValueError(f"has several criteria with the id {twice}")
        for rule in self.criteria:
            for fault in _faults_of_limit(rule, rules):
                raise ValueError(f"has a criterion {rule.id} whose limit {fault}")
        return self

    @property
    def key(self) -> str:
        """Name that chooses the book in a scene."""
        return f"{self.name}:{self.edition}" if self.edition else self.name

    def is_compared(self, rule: Rule) -> bool:
        """Whether the limit of a criterion was compared with the text of the standard."""
        return self.compared if rule.compared is None else rule.compared

    def rule(self, name: str) -> Rule:
        """The criterion with an id, which there is."""
        return next(rule for rule in self.criteria if rule.id == name)


def _faults_of_limit(rule: Rule, rules: Mapping[str, Rule]) -> Iterator[str]:
    for row in rule.limit:
        if row.of_limit is not None:
            other = rules.get(row.of_limit)
            if other is None:
                yield f"is a share of that of {row.of_limit}, which the book does not have"
            elif any(one.of_limit for one in other.limit):
                yield f"is a share of that of {row.of_limit}, which is itself a share of a limit"
            elif other.per_pantograph and not rule.per_pantograph:
                yield f"is a share of that of {row.of_limit}, which each pantograph has"
            elif other.unit != rule.unit:
                yield f"is a share of that of {row.of_limit}, which is in {other.unit}"
        if row.of_quantity is not None:
            quantity = QUANTITIES[row.of_quantity]
            if quantity.unit != rule.unit:
                yield f"in {rule.unit} is a share of {row.of_quantity}, which is in {quantity.unit}"
            elif quantity.per == PANTOGRAPH and not rule.per_pantograph:
                yield f"is a share of {row.of_quantity}, which each pantograph has"
        if row.of_key is not None and LIMIT_KEYS[row.of_key].unit != rule.unit:
            unit = LIMIT_KEYS[row.of_key].unit
            yield f"in {rule.unit} is a share of {row.of_key}, which is in {unit}"


def _known(key: str, names: list[str], known: Mapping[str, object]) -> None:
    for name in names:
        if name not in known:
            raise ValueError(f"has {key} {name!r}, but it must be one of {', '.join(known)}")


def book_of(table: Any, where: str) -> RuleBook:
    """The rule book of a table, such as a TOML file holds.

    Parameters
    ----------
    table : object
        Contents of the TOML file.
    where : str
        Name of the source, with which sentences about it begin.

    Raises
    ------
    InputError
        If it is none: one sentence on the first fault.
    """
    try:
        return RuleBook.model_validate(table)
    except ValidationError as failed:
        raise InputError(f"{where} {_sentence(failed)}") from None


def _sentence(failed: ValidationError) -> str:
    """The first fault, completed after the name of the file."""
    faults = failed.errors(include_url=False)
    # A misspelt key often shows up as a missing one too: the misspelling is the cause.
    fault = min(faults, key=lambda one: one["type"] != "extra_forbidden")
    key = _plain(".".join(str(part) for part in fault["loc"]))
    if fault["type"] == "extra_forbidden":
        return f"has an unknown key {key}"
    if fault["type"] == "missing":
        return f"has no {key}"
    if fault["type"] == "value_error":
        sentence = _plain(str(fault["ctx"]["error"]), 400)
        return sentence if not key else f"has {key}, which {sentence}"
    wanted = _plain(fault["msg"].removeprefix("Input "), 200)
    if not key:
        return "is no table"
    return f"has {key} = {_plain(repr(fault['input']), 60)}; it {wanted}"


def _plain(text: str, most: int = 200) -> str:
    """``text`` on one line, without what cannot be seen, cut to ``most`` characters."""
    text = re.sub(r"\s+", " ", text)
    text = "".join(letter if letter.isprintable() else "?" for letter in text)
    return text if len(text) <= most else f"{text[: most - 3]}..."


@functools.cache
def shipped() -> dict[str, RuleBook]:
    """All shipped books by ``name:edition``, editions in their order.

    A file with ``editions`` is several books, with each of these in the place of ``{edition}``.
    """
    books = {}
    for path in sorted(_FOLDER.glob("*.toml")):
        text = path.read_text(encoding="utf-8")
        for edition in tomllib.loads(text).get("editions", [""]):
            table = tomllib.loads(text.replace("{edition}", edition))
            if table.pop("editions", None):
                table["edition"] = edition
            book = book_of(table, str(path))
            books[book.key] = book
    return books


def book_named(name: str) -> RuleBook:
    """The shipped book that ``name:edition`` names; the newest edition of ``name`` alone.

    Raises
    ------
    InputError
        If there is none.
    """
    known = shipped()
    if name in known:
        return known[name]
    editions = [book for book in known.values() if book.name == name]
    if editions:
        return max(editions, key=lambda book: book.edition)
    near = difflib.get_close_matches(name[:100].lower(), known, n=1)
    meant = f"did you mean {near[0]}? It" if near else "it"
    raise InputError(
        f"there is no rule book of that name; {meant} must be one of {', '.join(known)}"
    )


def editions_of(name: str) -> Sequence[str]:
    """Editions of a book, the newest last."""
    return sorted(book.edition for book in shipped().values() if book.name == name)


def books_of_entries(entries: Sequence[str | dict[str, Any]]) -> list[RuleBook]:
    """Books of names, and of whole tables.

    Raises
    ------
    InputError
        If a name is unknown, a table no book, or two books have the same name and edition.
    """
    books = [
        book_named(entry) if isinstance(entry, str) else book_of(entry, "the book of the scene")
        for entry in entries
    ]
    keys = [book.key for book in books]
    twice = next((key for key in keys if keys.count(key) > 1), None)
    if twice is not None:
        raise InputError(f"the rule book {twice} is named twice")
    return books
