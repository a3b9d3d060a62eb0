"""The line from anchor to anchor, its ends, and the track beneath: tables, and conversion to SI.

Ends are those of the line and of its tension sections; the track has curves and tunnels.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from catenary.cases.scene.keys.table import (
    OneOrMore,
    StretchTable,
    Table,
    ascending,
    take_away,
    together,
)
from catenary.cases.scene.line.hardware import (
    DropperTable,
    FittingTable,
    Span,
    SteadyArmTable,
    SupportTable,
)
from catenary.cases.scene.line.wires import (
    AuxiliaryWireTable,
    ClampedWireTable,
    DampingTable,
    FreeLinkTable,
    FreeWireTable,
    TwinTable,
    WireTable,
)
from catenary.mbs.air import Tunnel
from catenary.meshgen.line import Curve
from catenary.meshgen.topologies.all_topologies import registered
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


MidPoint = Annotated[float, Field(gt=0, le=2e6)]
Stagger = Annotated[float, Field(ge=-2, le=2)]


class CurveTable(Table):
    """A curve, over the whole line or a stretch of it."""

    radius_m: float = Field(ge=100, le=100_000, description="radius of the circle")
    side: Literal["left", "right"] = Field(
        "left", description="where its centre is, seen in running direction"
    )
    cant_mm: float = Field(
        0.0, ge=0, le=200, description="height of the outer rail above the inner one"
    )
    rail_distance_mm: float = Field(
        1500.0, ge=600, le=2000, description="distance of the rails' middles, over which cant is"
    )
    from_m: float | None = Field(
        None,
        ge=0,
        le=1e7,
        description="start of the curve, transition included; the whole line's if absent",
    )
    to_m: float | None = Field(None, gt=0, le=1e7, description="end of the curve, likewise")
    transition_m: float = Field(
        0.0,
        ge=0,
        le=2000,
        description="length at both ends over which curvature and cant grow evenly",
    )

    @model_validator(mode="after")
    def _consistent(self) -> CurveTable:
        together(self, "from_m", "to_m")
        if self.from_m is None or self.to_m is None:
            if self.transition_m:
                raise ValueError("takes transition_m with from_m and to_m, where the curve begins")
            return self
        if self.to_m <= self.from_m + 2.0 * self.transition_m:
            raise ValueError(
                f"must end behind both transitions: to_m ({self.to_m:g}) must be greater than "
                f"{self.from_m + 2.0 * self.transition_m:g} m"
            )
        # Four times what standards allow; over a shorter length a canted plane leaves its wires.
        if self.cant_mm > 10.0 * self.transition_m:
            raise ValueError(
                f"takes cant_mm ({self.cant_mm:g}) with a transition_m of "
                f"{self.cant_mm / 10.0:g} m or more: cant may grow by no more than 10 mm a metre"
            )
        return self


class TunnelTable(StretchTable):
    """A tunnel: aerodynamic forces on pantographs are larger in it, and there is no wind."""

    from_m: float = Field(ge=0, le=1e6, description="place of its first portal")
    to_m: float = Field(ge=0, le=1e6, description="place of its second portal")
    force_factor: float = Field(
        1.0, ge=0.1, le=10, description="aerodynamic forces in it over those on the open line"
    )
    portal_m: float = Field(
        20.0, ge=0, le=1000, description="length inside, from either portal, in which they change"
    )


class TransitionTable(Table):
    """Spans at the ends in which the contact wire rises to its tensioner."""

    n_spans_start: int = Field(0, ge=0, le=100, description="transition spans at the start")
    n_spans_end: int = Field(0, ge=0, le=100, description="transition spans at the end")
    rise_m: float = Field(0.0, ge=0, le=5, description="height gained over all of one end's spans")
    span_m: Span | None = Field(
        None, description="length of the transition spans; line.span_m counts for them if absent"
    )

    @model_validator(mode="after")
    def _of_some_spans(self) -> TransitionTable:
        given = [name for name, on in (("rise_m", self.rise_m), ("span_m", self.span_m)) if on]
        if given and not self.n_spans_start + self.n_spans_end:
            raise ValueError(
                f"must not have {' and '.join(given)} without transition spans, n_spans_start or "
                f"n_spans_end{take_away()}"
            )
        return self


class LineTable(Table):
    """The line from anchor to anchor."""

    topology: str = Field(
        "simple",
        min_length=1,
        max_length=100,
        description="which wires the line has: " + ", ".join(registered()),
    )
    n_spans: int = Field(ge=1, le=20_000, description="number of spans from anchor to anchor")
    span_m: Annotated[list[Span], OneOrMore, Field(min_length=1, max_length=20_000)] = Field(
        description="span length, or a list of span lengths that is repeated"
    )
    spans_file: str | None = Field(
        None,
        min_length=1,
        description="lengths of all spans as a CSV file, in place of span_m, taken in when it is "
        "read; n_spans may be left out then, and a smaller one takes the first spans of the file",
    )
    contact_height_m: float = Field(
        5.08, gt=0, le=20, description="height of the contact wire at the supports above the rail"
    )
    encumbrance_m: float | None = Field(
        None,
        gt=0,
        le=10,
        description="height of the messenger wire above the contact wire at supports",
    )
    stagger_m: Annotated[list[Stagger], OneOrMore, Field(min_length=1, max_length=2001)] = Field(
        [0.0], description="alternating sideways offset at the supports, or one value per support"
    )
    messenger_stagger_m: (
        Annotated[list[Stagger], OneOrMore, Field(min_length=1, max_length=2001)] | None
    ) = Field(
        None,
        description="the same of the messenger wire, which stays above the track if absent; acts "
        "with effects.lateral_motion",
    )
    curve: CurveTable | None = Field(
        None, description="curve of the track; acts with effects.lateral_motion"
    )
    contact_wire: WireTable | None = Field(None, description="contact wire")
    messenger_wire: WireTable | None = Field(None, description="messenger wire")
    auxiliary_wire: AuxiliaryWireTable | None = Field(
        None, description="wire between messenger and contact wire"
    )
    stitch_wire: ClampedWireTable | None = Field(None, description="stitch wires at the supports")
    twin: TwinTable | None = Field(None, description="two contact wires in place of one")
    bridle: ClampedWireTable | None = Field(None, description="bridles of a single contact wire")
    dropper: DropperTable | None = Field(None, description="droppers of the contact wire")
    wires: list[FreeWireTable] | None = Field(
        None, min_length=1, max_length=100, description="wires of a free line"
    )
    links: list[FreeLinkTable] | None = Field(
        None, min_length=1, max_length=1000, description="what joins and carries those wires"
    )
    support: SupportTable = Field(default_factory=SupportTable, description="supports")
    steady_arm: SteadyArmTable = Field(default_factory=SteadyArmTable, description="steady arms")
    fittings: list[FittingTable] = Field(
        default_factory=list, max_length=10_000, description="insulators and the like on wires"
    )
    damping: DampingTable = Field(description="proportional damping")
    overlap: OverlapTable | None = Field(
        None, description="spans in which the next tension section begins"
    )
    transition: TransitionTable = Field(
        default_factory=TransitionTable, description="transition spans"
    )
    ends: EndsTable = Field(default_factory=EndsTable, description="how the line ends")
    tunnels: list[TunnelTable] = Field(
        default_factory=list, max_length=1000, description="tunnels on the way, in ascending order"
    )
    tensioner: TensionerTable = Field(
        default_factory=TensionerTable, description="tensioners at the ends of wires"
    )
    temperature: TemperatureTable = Field(
        default_factory=TemperatureTable, description="how warm the line is"
    )
    mid_points_m: list[MidPoint] = Field(
        default_factory=list,
        max_length=1000,
        description="places of masts at which wires are held along the track",
    )

    @model_validator(mode="after")
    def _consistent(self) -> LineTable:
        n_transition = self.transition.n_spans_start + self.transition.n_spans_end
        if n_transition >= self.n_spans:
            raise ValueError(
                f"must have more spans (n_spans is {self.n_spans}) than transition spans "
                f"(n_spans_start + n_spans_end is {n_transition})"
            )
        covered = self.n_spans - (n_transition if self.transition.span_m is not None else 0)
        if len(self.span_m) > covered:
            raise ValueError(
                f"must not list more lengths in span_m ({len(self.span_m)}) than there are spans "
                f"for them ({covered})"
            )
        for key in ("stagger_m", "messenger_stagger_m"):
            given = getattr(self, key)
            if given is not None and len(given) not in (1, self.n_spans + 1):
                raise ValueError(
                    f"must give {key} as one number or one per support ({self.n_spans + 1}), "
                    f"but lists {len(given)}"
                )
        return self


def curve_of(table: CurveTable) -> Curve:
    """The curve of the track."""
    to_left = 1.0 if table.side == "left" else -1.0
    first = -np.inf if table.from_m is None else table.from_m
    last = np.inf if table.to_m is None else table.to_m
    tilt = math.asin(table.cant_mm / table.rail_distance_mm)
    return Curve(to_left / table.radius_m, tilt, (first, last), table.transition_m)


def tunnels_of(tables: Sequence[TunnelTable]) -> tuple[Tunnel, ...]:
    """Tunnels of a line."""
    return tuple(Tunnel(t.from_m, t.to_m, t.force_factor, t.portal_m) for t in tables)
