"""Ends of the line and of its tension sections: tables, and conversion to SI."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from catenary.cases.scene.keys.table import OneOrMore, Table, ascending
from catenary.solver.problem.ends import AbsorbingLayer, EndCondition, Fixed, Periodic

# Ends of wires along the track.
Along = Literal["fixed", "tensioner"]
Mass = Annotated[float, Field(gt=0, le=1e5)]


class TensionerTable(Table):
    """Weights on a wheel at the end of each wire, wherever wires have tensioners."""

    ratio: float = Field(
        3.0, ge=1, le=10, description="travel of the weights over that of the wire"
    )
    efficiency: float = Field(
        1.0,
        gt=0.5,
        le=1,
        description="share of the weights' pull that arrives; below 1 friction holds the wheel "
        "while the tension is between efficiency and 1/efficiency of that pull, and slips beyond",
    )
    travel_m: float | None = Field(
        None,
        gt=0,
        le=20,
        description="how far the end of a wire may move either way until a stop holds it",
    )
    stop_stiffness_N_per_m: float = Field(
        1e6,
        gt=0,
        le=1e9,
        description="stiffness of a stop that an end reaches in a run; one that holds it at rest "
        "does not give",
    )
    weights_kg: dict[str, Mass] = Field(
        default_factory=dict,
        description="mass of the weights by name of the wire; those of others fit their tensions",
    )


class TemperatureTable(Table):
    """Temperature of the line."""

    difference_K: float = Field(
        0.0,
        ge=-100,
        le=150,
        description="temperature less that of the installation; acts with effects.axial_motion",
    )


# Spans and largest damping of a layer: on the line of EN 50318 less damping lets waves through, and
# more sends back waves beside the gaps between bands.
USUAL_LAYER = {"spans": 20, "damping_per_s": 1.5}
# Kinds of ends that are asked for and are none here, and why.
_NO_KIND = {
    "dashpot": "must not be dashpot: matched dashpots sqrt(T m) send back 0.26 to 0.84 of a wave "
    "where droppers join two wires; periodic and absorbing_layer take waves up",
    "tensioner": "must not be tensioner: kind says what becomes of vertical waves; a wire that its "
    'tensioner lets move has along = "tensioner" beside it',
}


class EndTable(Table):
    """End of the line on one side."""

    kind: Literal["fixed", "absorbing_layer", "periodic"] = Field(
        "fixed",
        description="wires held in height; the same after spans whose damping grows towards the "
        "end and takes waves up; or a line that goes on for ever with spans like the last one",
    )
    along: Along = Field(
        "fixed",
        description="wires held along the track, or by a tensioner each; acts with "
        "effects.axial_motion",
    )
    spans: int | None = Field(
        None, ge=1, le=1000, description="spans of an absorbing layer, 20 if not given"
    )
    damping_per_s: float | None = Field(
        None,
        gt=0,
        le=100,
        description="damping on mass at the outer end of an absorbing layer, 1.5 if not given; it "
        "grows as the square of the way into it",
    )

    @field_validator("kind", mode="before")
    @classmethod
    def _is_a_kind(cls, kind: Any) -> Any:
        if isinstance(kind, str) and kind in _NO_KIND:
            raise ValueError(_NO_KIND[kind])
        return kind

    @model_validator(mode="before")
    @classmethod
    def _with_usual_layer(cls, given: Any) -> Any:
        if isinstance(given, dict) and given.get("kind") == "absorbing_layer":
            named = {key: value for key, value in given.items() if value is not None}
            return {**USUAL_LAYER, **named}
        return given

    @model_validator(mode="after")
    def _consistent(self) -> EndTable:
        if self.kind != "absorbing_layer":
            for key in USUAL_LAYER:
                if getattr(self, key) is not None:
                    raise ValueError(f"takes {key} with kind absorbing_layer, not with {self.kind}")
        return self


class EndsTable(Table):
    """Ends of the line on both sides."""

    start: EndTable = Field(default_factory=EndTable, description="where the line starts")
    end: EndTable = Field(default_factory=EndTable, description="where the line ends")


FirstSpan = Annotated[int, Field(ge=2, le=20_000)]


class OverlapTable(Table):
    """Spans in which one tension section ends and the next one begins: one overlap or several."""

    first_span: Annotated[list[FirstSpan], OneOrMore, Field(min_length=1, max_length=1000)] = Field(
        description="number of its first span, from 1, or a list of those of several overlaps"
    )
    repeat_every_spans: int | None = Field(
        None,
        ge=4,
        le=20_000,
        description="further overlaps so far apart, from the last one named to the line's end",
    )
    n_spans: int = Field(4, ge=3, le=5, description="number of its spans")
    rise_m: float = Field(
        gt=0,
        le=5,
        description="height that a contact wire gains from the middle to the end of its section",
    )
    distance_m: float = Field(
        0.4, gt=0, le=2, description="distance of the wires of both sections from each other"
    )
    along: Along = Field(
        "tensioner",
        description="what holds ends of wires inside the overlap; acts with effects.axial_motion",
    )

    @model_validator(mode="after")
    def _in_order(self) -> OverlapTable:
        ascending(self.first_span, "first_span")
        return self


def ends_of(table: EndsTable) -> tuple[EndCondition, EndCondition]:
    """Conditions at the line's start and at its end."""
    return _end_of(table.start), _end_of(table.end)


def _end_of(table: EndTable) -> EndCondition:
    if table.kind == "absorbing_layer":
        assert table.spans is not None and table.damping_per_s is not None
        return AbsorbingLayer(table.spans, table.damping_per_s)
    return Periodic() if table.kind == "periodic" else Fixed()
