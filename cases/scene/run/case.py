"""Tables of the case itself, of the stretch whose statistics are judged, and of the output."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from catenary.cases.scene.keys.table import StretchTable, Table, either
from catenary.postproc.record.snapshots.contents import FIELDS, OTHER_PARTS, USUAL_FIELDS
from catenary.postproc.standards.rule_books import (
    DEFAULT,
    LIMIT_KEYS,
    RuleBook,
    book_named,
    books_of_entries,
)
from catenary.solver.time_loop.views.channels import line_channels


class CaseTable(Table):
    """Name, description and source of the case."""

    name: str = Field("", max_length=200, description="name; the folder's if absent")
    title: str = Field("", max_length=500, description="one line for lists and reports")
    description: str = Field("", max_length=20000, description="problem and set-up")
    accept_unusual: bool | None = Field(
        None,
        description="whether numbers far outside of their usual range are meant; false if absent",
    )
    source: str = Field("", max_length=2000, description="where the data come from")


def _year(value: Any) -> Any:
    """An edition is named by a year, which one writes as a number too."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


def _limit(key: str, most: float, *, zero: bool = False) -> Any:
    """A limit up to ``most``, which may be zero or not."""
    least: Any = {"ge" if zero else "gt": 0}
    return Field(None, le=most, description=LIMIT_KEYS[key].meaning, **least)


class LimitsTable(Table):
    """The line's own limits, which rule books refer to."""

    uplift_space_mm: float | None = _limit("uplift_space_mm", 1e4)
    working_width_mm: float | None = _limit("working_width_mm", 1e4)
    wire_lateral_place_mm: float | None = _limit("wire_lateral_place_mm", 1e4)
    wire_height_min_mm: float | None = _limit("wire_height_min_mm", 1e4)
    wire_height_max_mm: float | None = _limit("wire_height_max_mm", 1e4)
    lateral_sweep_mm_per_s: float | None = _limit("lateral_sweep_mm_per_s", 1e5)
    elasticity_variation_percent: float | None = _limit("elasticity_variation_percent", 100)
    arcing_percent: float | None = _limit("arcing_percent", 100, zero=True)
    dropper_force_N: float | None = _limit("dropper_force_N", 1e6)
    dropper_compression_N: float | None = _limit("dropper_compression_N", 1e6, zero=True)
    dropper_slackenings: int | None = _limit("dropper_slackenings", 10**6, zero=True)
    contact_wire_tension_N: float | None = _limit("contact_wire_tension_N", 1e6)
    contact_wire_strain_um_per_m: float | None = _limit("contact_wire_strain_um_per_m", 1e6)


class EvaluationTable(StretchTable):
    """The stretch whose statistics are judged, and by what."""

    from_m: float = Field(ge=0, le=1e6, description="start of the evaluated stretch")
    to_m: float = Field(gt=0, le=1e6, description="end of the evaluated stretch")
    rules: list[Annotated[str, Field(max_length=60)]] | None = Field(
        None,
        max_length=20,
        description="rule books that judge the run, as `name` or `name:edition`; "
        "the newest EN 50367 if absent",
    )
    rules_file: str | None = Field(
        None,
        max_length=1000,
        description="a rule book of one's own, a TOML file in the folder of the scene",
    )
    own_rules: dict[str, Any] | None = Field(None, description="such a book, in place of its file")
    limits: LimitsTable | None = Field(None, description="the line's own limits")
    edition: Annotated[str | None, BeforeValidator(_year)] = Field(
        None, description="edition of EN 50367, in place of rules"
    )
    system: str = Field("ac", description="power supply, which decides the mean force allowed")

    @property
    def chosen(self) -> list[str]:
        """Names of the shipped rule books that judge the run."""
        if self.edition is not None:
            return [f"{DEFAULT}:{self.edition}"]
        return [DEFAULT] if self.rules is None else self.rules

    @property
    def own_limits(self) -> dict[str, float]:
        """The limits that are given, by their keys."""
        given = self.limits
        return {} if given is None else given.model_dump(exclude_none=True)


def rule_entries(table: EvaluationTable) -> list[str | dict[str, Any]]:
    """Rule books as a result file has them: shipped ones by name and edition, one's own whole."""
    entries: list[str | dict[str, Any]] = [book_named(name).key for name in table.chosen]
    return entries + ([] if table.own_rules is None else [table.own_rules])


def chosen_books(table: EvaluationTable) -> list[RuleBook]:
    """The rule books that judge the run.

    Raises
    ------
    InputError
        If one is named twice.
    """
    return books_of_entries(rule_entries(table))


# Channels of the line, which may be recorded in part.
_RECORDED = line_channels()


_Spans = Annotated[list[Annotated[int, Field(ge=1, le=10**6)]], Field(min_length=2, max_length=2)]
_AroundTrain = Annotated[
    list[Annotated[float, Field(ge=0, le=1e6)]], Field(min_length=2, max_length=2)
]


class OutputTable(Table):
    """Files that are written, and how much into them."""

    field_every_s: float | None = Field(
        None,
        ge=0,
        le=1e4,
        description="cadence of field snapshots; 0 writes none; 0.05 s if absent, or as much "
        "longer as keeps them within 500 MB",
    )
    field_every_m: float | None = Field(
        None, gt=0, le=1e4, description="the same as a distance that the train travels"
    )
    fields: list[Literal[FIELDS]] | None = Field(  # type: ignore[valid-type]
        None,
        min_length=1,
        max_length=len(FIELDS),
        description=f"fields of the snapshots, of {' and '.join(FIELDS)}; "
        f"{' and '.join(USUAL_FIELDS)} if absent",
    )
    field_parts: list[Annotated[str, Field(min_length=1, max_length=100)]] | None = Field(
        None,
        min_length=1,
        max_length=100,
        description="parts of the line that snapshots show: names of wires, and "
        f"{', '.join(OTHER_PARTS)}; all if absent",
    )
    field_spans: _Spans | None = Field(
        None,
        description="first and last span that snapshots show, counted from 1; if absent all, or "
        "with a window.mode other than off what moves",
    )
    field_window_m: _AroundTrain | None = Field(
        None,
        description="how far behind the last and ahead of the first pantograph snapshots show the "
        "line; if absent the whole line, or with a window.mode other than off what moves",
    )
    energy_every_s: float = Field(
        0.05, ge=0, le=1e4, description="cadence of the line's energy; 0 writes none"
    )
    flush_every_steps: int | None = Field(
        None,
        ge=1,
        le=10**7,
        description="steps after which the result file is brought up to date; about half a "
        "second's worth if absent",
    )
    line_channels: list[Literal[_RECORDED]] | None = Field(  # type: ignore[valid-type]
        None,
        max_length=len(_RECORDED),
        description=f"channels of the line that are recorded, of {' and '.join(_RECORDED)}; "
        "all if absent. Their extremes are kept of every step, whatever is recorded",
    )
    line_channels_every_s: float | None = Field(
        None,
        ge=0,
        le=1e4,
        description="cadence of the line's channels; 0 records every step. If this key and the "
        "next four are absent: every step up to 500 MB, with window.mode = bounded of the spans "
        "that move; beyond 500 MB every 5 ms from 300 m behind to 200 m ahead of the train",
    )
    line_channels_every_m: float | None = Field(
        None, ge=0, le=1e4, description="the same as a distance that the train travels"
    )
    line_channels_window_m: _AroundTrain | None = Field(
        None,
        description="how far behind the last and ahead of the first pantograph the line's channels "
        "are recorded; the whole line if absent",
    )
    line_channels_spans: _Spans | None = Field(
        None,
        description="first and last span whose channels are recorded, counted from 1; all if "
        "absent",
    )
    line_channels_compression: Literal["none", "gzip"] | None = Field(
        None,
        description="compression of the line's channels; gzip where their size has thinned them, "
        "none otherwise, if absent",
    )

    @property
    def chooses_line_channels(self) -> bool:
        """Whether the scene says what is recorded of the line's channels."""
        own = (
            self.line_channels,
            self.line_channels_every_s,
            self.line_channels_every_m,
            self.line_channels_window_m,
            self.line_channels_spans,
        )
        return any(value is not None for value in own)

    @model_validator(mode="after")
    def _can_be_recorded(self) -> OutputTable:
        either(self, "line_channels_every_s", "line_channels_every_m")
        either(self, "field_every_s", "field_every_m")
        for key in ("line_channels_spans", "field_spans"):
            spans = getattr(self, key)
            if spans is not None and spans[0] > spans[1]:
                raise ValueError(
                    f"must have {key} from a span to a later one, not {spans[0]} to {spans[1]}"
                )
        return self
