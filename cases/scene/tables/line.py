"""Scene tables of the line and its mesh. Keys carry their unit where it is not obvious."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from catenary.cases.scene.tables.ends import EndsTable
from catenary.cases.scene.tables.table import TAKE_AWAY, OneOrMore, Table, ascending, exactly_one
from catenary.meshgen.topologies.all_topologies import registered

Span = Annotated[float, Field(ge=5, le=500)]
Stagger = Annotated[float, Field(ge=-2, le=2)]
PreSag = Annotated[float, Field(ge=-1000, le=1000)]
DropperPosition = Annotated[float, Field(gt=0, le=500)]


class WireTable(Table):
    """A tensioned wire."""

    tension_N: float = Field(gt=0, le=1e6, description="tension")
    mass_kg_per_m: float = Field(gt=0, le=100, description="mass per length")
    bending_stiffness_N_m2: float = Field(ge=0, le=1e6, description="bending stiffness EI")


class DropperPattern(Table):
    """Where the droppers of all spans of one length hang."""

    span_m: Span = Field(description="length of the spans that have this pattern")
    positions_m: list[DropperPosition] = Field(
        min_length=1, max_length=200, description="distances from the span's left support"
    )
    pre_sag_mm: list[PreSag] | None = Field(
        None, description="how far the contact wire hangs lower, one value per dropper"
    )

    @model_validator(mode="after")
    def _consistent(self) -> DropperPattern:
        ascending(self.positions_m, "positions_m")
        _one_pre_sag_each(self.pre_sag_mm, len(self.positions_m))
        return self


class HangingTable(Table):
    """Droppers: what they are, and where they hang."""

    stiffness_N_per_m: float | None = Field(
        None, gt=0, le=1e9, description="stiffness in tension, the same for every length"
    )
    axial_stiffness_N: float | None = Field(
        None, gt=0, le=1e9, description="EA; the stiffness is EA over the dropper's length"
    )
    mass_kg_per_m: float = Field(0.0, ge=0, le=100, description="mass per length")
    messenger_clamp_kg: float = Field(
        0.0, ge=0, le=100, description="clamp at the upper end, on the messenger wire or another"
    )
    positions_m: list[DropperPosition] | None = Field(
        None,
        min_length=1,
        max_length=200,
        description="distances from the left support, for lines whose spans all have one length",
    )
    count: int | None = Field(
        None, ge=1, le=200, description="droppers per span, centred in it at spacing_m"
    )
    spacing_m: float | None = Field(None, gt=0, le=500, description="distance between droppers")
    patterns: list[DropperPattern] | None = Field(
        None, min_length=1, max_length=200, description="one entry per span length"
    )

    @model_validator(mode="after")
    def _placed(self) -> HangingTable:
        exactly_one(self, "stiffness_N_per_m", "axial_stiffness_N")
        exactly_one(self, "positions_m", "count", "patterns")
        if (self.count is None) != (self.spacing_m is None):
            raise ValueError("needs count and spacing_m together, but only one is given")
        if self.patterns is not None:
            ascending([p.span_m for p in self.patterns], "patterns by span_m")
        if self.positions_m is not None:
            ascending(self.positions_m, "positions_m")
        return self


class DropperTable(HangingTable):
    """Droppers of the contact wire, and the pre-sag that they give it."""

    contact_clamp_kg: float = Field(0.0, ge=0, le=100, description="clamp on the contact wire")
    pre_sag_mm: list[PreSag] | None = Field(
        None, description="how far the contact wire hangs lower, one value per dropper"
    )
    pre_sag_mid_mm: PreSag | None = Field(
        None, description="pre-sag at mid-span of a parabola from the first to the last dropper"
    )
    residual_stiffness_ratio: float = Field(
        0.0, ge=0, lt=1, description="share of its stiffness that a compressed dropper keeps"
    )
    slack_damping: Literal["released", "kept"] = Field(
        "released",
        description="damper of a slack dropper: released with its spring, or kept in action as in "
        "equation (2.7) of Ambrosio et al. (2012)",
    )

    @model_validator(mode="after")
    def _pre_sag(self) -> DropperTable:
        if self.pre_sag_mm is not None and self.pre_sag_mid_mm is not None:
            raise ValueError(f"takes pre_sag_mm or pre_sag_mid_mm, but both are given{TAKE_AWAY}")
        if self.patterns is not None:
            if self.pre_sag_mm is not None:
                raise ValueError("with patterns takes pre_sag_mm in each pattern, not here")
            mixed = any(p.pre_sag_mm is not None for p in self.patterns)
            if mixed and self.pre_sag_mid_mm is not None:
                raise ValueError("takes pre_sag_mm in the patterns or pre_sag_mid_mm, not both")
        if self.positions_m is not None:
            _one_pre_sag_each(self.pre_sag_mm, len(self.positions_m))
        if self.count is not None:
            _one_pre_sag_each(self.pre_sag_mm, self.count)
        return self


def _one_pre_sag_each(pre_sag: list[float] | None, n_droppers: int) -> None:
    if pre_sag is not None and len(pre_sag) != n_droppers:
        raise ValueError(
            f"must give one pre_sag_mm per dropper, but there are {len(pre_sag)} values "
            f"for {n_droppers} droppers"
        )


class AuxiliaryDropperTable(HangingTable):
    """Droppers from the messenger wire down to the auxiliary wire, which hangs level by them."""

    auxiliary_clamp_kg: float = Field(0.0, ge=0, le=100, description="clamp on the auxiliary wire")

    @model_validator(mode="after")
    def _level(self) -> AuxiliaryDropperTable:
        if any(pattern.pre_sag_mm is not None for pattern in self.patterns or []):
            raise ValueError("takes no pre_sag_mm in patterns: the auxiliary wire hangs level")
        return self


class AuxiliaryWireTable(WireTable):
    """A wire between messenger and contact wire."""

    height_m: float = Field(
        gt=0, le=10, description="height above the contact wire at the supports"
    )
    dropper: AuxiliaryDropperTable = Field(
        description="droppers from the messenger wire to the auxiliary wire"
    )


class StitchWireTable(WireTable):
    """A wire clamped to the messenger wire on both sides of each inner support."""

    length_m: float = Field(gt=0, le=100, description="length from clamp to clamp")
    clamp_kg: float = Field(0.0, ge=0, le=100, description="mass of each of its two clamps")
    clamp_stiffness_N_per_m: float = Field(
        1e7, gt=0, le=1e10, description="stiffness of each clamp, in tension and compression"
    )


class TwinTable(Table):
    """Two contact wires in place of one."""

    spacing_m: float = Field(gt=0, le=1, description="distance between the two wires")
    droppers: Literal["pairs", "alternating"] = Field(
        "pairs", description="droppers hang both wires at each place, or the two by turns"
    )


class BridleTable(WireTable):
    """A wire over each inner support, whose ends are clamped to a single contact wire."""

    length_m: float = Field(gt=0, le=100, description="length from clamp to clamp")
    clamp_kg: float = Field(0.0, ge=0, le=100, description="mass of each of its two clamps")
    clamp_stiffness_N_per_m: float = Field(
        1e7, gt=0, le=1e10, description="stiffness of each clamp, in tension and compression"
    )


class SupportTable(Table):
    """What carries the topmost wire at a mast."""

    stiffness_N_per_m: float = Field(5e5, gt=0, le=1e10, description="vertical stiffness")


class SteadyArmTable(Table):
    """The arm that holds the contact wire sideways at a mast."""

    length_m: float = Field(0.0, ge=0, le=10, description="length from hinge to clamp")
    mass_kg_per_m: float = Field(0.0, ge=0, le=100, description="mass per length")
    clamp_kg: float = Field(0.0, ge=0, le=100, description="clamp on the contact wire")
    stiffness_N_per_m: float = Field(
        0.0, ge=0, le=1e8, description="vertical stiffness at the contact wire"
    )
    holds_height: bool = Field(
        False,
        description="whether the arm holds the contact wire at its height at rest; otherwise the "
        "wire hangs freely between the droppers next to it",
    )


class ProportionalDamping(Table):
    """C = alpha K + beta M of one component."""

    alpha_s: float = Field(ge=0, le=10, description="factor on stiffness")
    beta_per_s: float = Field(ge=0, le=100, description="factor on mass")


def _given(value: Any) -> Any:
    """Without components of no damping of their own, which earlier result files name."""
    if not isinstance(value, dict):
        return value
    return {name: own for name, own in value.items() if own is not None}


class DampingTable(ProportionalDamping):
    """C = alpha K + beta M of the whole line."""

    per_component: Annotated[dict[str, ProportionalDamping], BeforeValidator(_given)] = Field(
        default_factory=dict,
        description="damping of single components by name, in place of the line's: a wire or a "
        "group, such as contact_wire, messenger_wire, droppers, steady_arms, supports",
    )


class TransitionTable(Table):
    """Spans at the ends in which the contact wire rises to its tensioner."""

    n_spans_start: int = Field(0, ge=0, le=100, description="transition spans at the start")
    n_spans_end: int = Field(0, ge=0, le=100, description="transition spans at the end")
    rise_m: float = Field(0.0, ge=0, le=5, description="height gained over all of one end's spans")
    span_m: Span | None = Field(
        None, description="length of the transition spans; line.span_m counts for them if absent"
    )


class OverlapTable(Table):
    """Spans in which one tension section ends and the next one begins."""

    first_span: int = Field(ge=2, le=20_000, description="number of its first span, from 1")
    n_spans: int = Field(4, ge=3, le=5, description="number of its spans")
    rise_m: float = Field(
        gt=0,
        le=5,
        description="height that a contact wire gains from the middle to the end of its section",
    )
    distance_m: float = Field(
        0.4, gt=0, le=2, description="distance of the wires of both sections from each other"
    )


class LineTable(Table):
    """The line from anchor to anchor."""

    topology: str = Field(
        "simple",
        min_length=1,
        max_length=100,
        description="which wires the line has: " + ", ".join(registered()),
    )
    n_spans: int = Field(ge=1, le=20_000, description="number of spans from anchor to anchor")
    span_m: Annotated[list[Span], OneOrMore, Field(min_length=1, max_length=2000)] = Field(
        description="span length, or a list of span lengths that is repeated"
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
    contact_wire: WireTable = Field(description="contact wire")
    messenger_wire: WireTable | None = Field(None, description="messenger wire")
    auxiliary_wire: AuxiliaryWireTable | None = Field(
        None, description="wire between messenger and contact wire"
    )
    stitch_wire: StitchWireTable | None = Field(None, description="stitch wires at the supports")
    twin: TwinTable | None = Field(None, description="two contact wires in place of one")
    bridle: BridleTable | None = Field(None, description="bridles of a single contact wire")
    dropper: DropperTable | None = Field(None, description="droppers of the contact wire")
    support: SupportTable = Field(default_factory=SupportTable, description="supports")
    steady_arm: SteadyArmTable = Field(default_factory=SteadyArmTable, description="steady arms")
    damping: DampingTable = Field(description="proportional damping")
    overlap: OverlapTable | None = Field(
        None, description="spans in which the next tension section begins"
    )
    transition: TransitionTable = Field(
        default_factory=TransitionTable, description="transition spans"
    )
    ends: EndsTable = Field(default_factory=EndsTable, description="how the line ends")

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
        if len(self.stagger_m) not in (1, self.n_spans + 1):
            raise ValueError(
                f"must give stagger_m as one number or one per support ({self.n_spans + 1}), "
                f"but lists {len(self.stagger_m)}"
            )
        return self


class MeshTable(Table):
    """The finite-element mesh: made from the line, or the user's own."""

    elements_per_gap: int = Field(
        5, ge=1, le=64, description="elements between neighbouring droppers; 4 to 6 are usual"
    )
    support_refinement: int = Field(
        1, ge=1, le=16, description="factor by which the gaps next to supports are meshed finer"
    )
    file: str | None = Field(
        None,
        min_length=1,
        description="own mesh (.msh) with the same groups, relative to the case file",
    )

    @model_validator(mode="after")
    def _consistent(self) -> MeshTable:
        ignored = self.model_fields_set & {"elements_per_gap", "support_refinement"}
        if self.file is not None and ignored:
            raise ValueError(f"takes file or {sorted(ignored)[0]}, but both are given{TAKE_AWAY}")
        return self
