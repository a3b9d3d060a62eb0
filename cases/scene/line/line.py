"""The line from anchor to anchor: its table. Keys carry their unit where it is not obvious."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from catenary.cases.scene.keys.table import TAKE_AWAY, OneOrMore, Table
from catenary.cases.scene.line.droppers import DropperTable, Span
from catenary.cases.scene.line.ends import EndsTable, OverlapTable, TemperatureTable, TensionerTable
from catenary.cases.scene.line.free import FreeLinkTable, FreeWireTable
from catenary.cases.scene.line.hardware import FittingTable, SteadyArmTable, SupportTable
from catenary.cases.scene.line.track import CurveTable, TunnelTable
from catenary.cases.scene.line.wires import (
    AuxiliaryWireTable,
    BridleTable,
    DampingTable,
    StitchWireTable,
    TwinTable,
    WireTable,
)
from catenary.meshgen.topologies.all_topologies import registered

MidPoint = Annotated[float, Field(gt=0, le=2e6)]
Stagger = Annotated[float, Field(ge=-2, le=2)]


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
                f"n_spans_end{TAKE_AWAY}"
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
    stitch_wire: StitchWireTable | None = Field(None, description="stitch wires at the supports")
    twin: TwinTable | None = Field(None, description="two contact wires in place of one")
    bridle: BridleTable | None = Field(None, description="bridles of a single contact wire")
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
