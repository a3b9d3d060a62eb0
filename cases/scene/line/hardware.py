"""Hardware of the wires: droppers, supports, steady arms, fittings; tables, and conversion to SI.

Of droppers the tables say what they are, where they hang, and which pre-sag they give.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Annotated, ClassVar, Literal, NamedTuple

from pydantic import AfterValidator, Field, model_validator

from catenary.base.errors import InputError
from catenary.cases.scene.input.faults import Origin
from catenary.cases.scene.keys.table import (
    PAIR,
    Table,
    WireName,
    ascending,
    either,
    exactly_one,
    together,
)
from catenary.cases.scene.keys.units import angle_from_deg, length_from_mm
from catenary.meshgen.line import DropperKind, Fittings, SteadyArm

Span = Annotated[float, Field(ge=5, le=500)]
PreSag = Annotated[float, Field(ge=-1000, le=1000)]
DropperPosition = Annotated[float, Field(gt=0, le=500)]
# Of droppers in tension: the least and the most of EA, or of the slope of a curve [N].
_LEAST, _MOST = 1.0, 1e9
# Span lengths are written in decimal; two that differ by less are the same one.
_SAME_SPAN = 1e-6
# Droppers of a span of which some hang lower than the first and the last one.
FEWEST_SAGGING = 3


def _is_curve(pairs: list[list[float]]) -> list[list[float]]:
    if any(pairs[0]):
        first = ", ".join(f"{number:g}" for number in pairs[0])
        raise ValueError(f"must begin with strain 0 and tension 0, but begins with {first}")
    ascending([strain for strain, _ in pairs], "its strains")
    ascending([tension for _, tension in pairs], "its tensions")
    for (low, below), (high, above) in zip(pairs, pairs[1:], strict=False):
        slope = (above - below) / (high - low)
        if not _LEAST <= slope <= _MOST:
            raise ValueError(
                f"must have slopes of {_LEAST:g} to {_MOST:g} N, but has {slope:.3g} N between "
                f"strains {low:g} and {high:g}"
            )
    return pairs


Curve = Annotated[list[PAIR], Field(min_length=2, max_length=20), AfterValidator(_is_curve)]


class DropperPattern(Table):
    """Places of the droppers in all spans of one length, or in spans by their numbers."""

    span_m: Span | None = Field(None, description="length of the spans that have this pattern")
    spans: list[Annotated[int, Field(ge=1, le=20_000)]] | None = Field(
        None,
        min_length=1,
        max_length=20_000,
        description="in place of their length, numbers of the spans that have this pattern, from "
        "1; they go before a pattern of their length",
    )
    positions_m: list[DropperPosition] = Field(
        min_length=1, max_length=200, description="distances from the span's left support"
    )
    pre_sag_mm: list[PreSag] | None = Field(
        None, description="how far the contact wire hangs lower, one value per dropper"
    )

    @model_validator(mode="after")
    def _consistent(self) -> DropperPattern:
        exactly_one(self, "span_m", "spans")
        ascending(self.spans or [], "spans")
        ascending(self.positions_m, "positions_m")
        one_pre_sag_each(self.pre_sag_mm, len(self.positions_m))
        return self


class HangingTable(Table):
    """Droppers: what they are, and where they hang."""

    # Keys that each say where they hang.
    PLACED_BY: ClassVar[tuple[str, ...]] = ("positions_m", "count", "patterns")

    stiffness_N_per_m: float | None = Field(
        None, ge=1, le=1e9, description="stiffness in tension, the same for every length"
    )
    axial_stiffness_N: float | None = Field(
        None, ge=_LEAST, le=_MOST, description="EA; the stiffness is EA over the dropper's length"
    )
    curve: Curve | None = Field(
        None,
        description="in place of these pairs of strain and tension [N] from 0, 0 on, joined by "
        "straight lines, the last of which goes on",
    )
    curve_file: str | None = Field(
        None, min_length=1, description="the same pairs as a CSV file, taken in when it is read"
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
        None,
        min_length=1,
        max_length=20_000,
        description="one entry per span length, or for spans by their numbers",
    )
    patterns_file: str | None = Field(
        None,
        min_length=1,
        description="places and pre-sag of the droppers of all spans as a CSV file, taken in when "
        "it is read",
    )

    @model_validator(mode="after")
    def _placed(self) -> HangingTable:
        exactly_one(self, "stiffness_N_per_m", "axial_stiffness_N", "curve")
        exactly_one(self, *self.PLACED_BY)
        together(self, "count", "spacing_m")
        if self.patterns is not None:
            lengths = [p.span_m for p in self.patterns if p.span_m is not None]
            ascending(lengths, "patterns by span_m")
            numbers = sorted(number for p in self.patterns for number in p.spans or ())
            twice = [one for one, other in pairwise(numbers) if one == other]
            if twice:
                raise ValueError(f"must have one pattern for span {twice[0]}, not several")
        ascending(self.positions_m or [], "positions_m")
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
        0.0,
        ge=0,
        lt=1,
        description="share of its stiffness, of a curve the first slope, that a compressed dropper "
        "keeps",
    )
    slack_damping: Literal["released", "kept"] = Field(
        "released",
        description="damper of a slack dropper: released with its spring, or kept in action as in "
        "equation (2.7) of Ambrosio et al. (2012)",
    )

    @model_validator(mode="after")
    def _pre_sag(self) -> DropperTable:
        either(self, "pre_sag_mm", "pre_sag_mid_mm")
        if self.patterns is not None:
            if self.pre_sag_mm is not None:
                raise ValueError("with patterns takes pre_sag_mm in each pattern, not here")
            mixed = any(p.pre_sag_mm is not None for p in self.patterns)
            if mixed and self.pre_sag_mid_mm is not None:
                raise ValueError("takes pre_sag_mm in the patterns or pre_sag_mid_mm, not both")
        if self.positions_m is not None:
            one_pre_sag_each(self.pre_sag_mm, len(self.positions_m))
        if self.count is not None:
            one_pre_sag_each(self.pre_sag_mm, self.count)
        return self


def one_pre_sag_each(pre_sag: list[float] | None, n_droppers: int) -> None:
    """Raise ValueError, with a predicate, unless a list of pre-sags has one per dropper."""
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


def dropper_kind(table: HangingTable, lower_clamp: float) -> DropperKind:
    """Stiffness and masses of the droppers of a table; ``lower_clamp`` [kg]."""
    return DropperKind(
        stiffness=table.stiffness_N_per_m,
        axial_stiffness=table.axial_stiffness_N,
        mass_per_length=table.mass_kg_per_m,
        upper_clamp_mass=table.messenger_clamp_kg,
        lower_clamp_mass=lower_clamp,
        curve=None if table.curve is None else tuple((x, y) for x, y in table.curve),
    )


class Hung(NamedTuple):
    """Droppers of a span: distances from its left support [m] and the pre-sag of each [m].

    ``of_span`` is whether the pre-sag is that of this very span, by its number.
    """

    positions: tuple[float, ...]
    pre_sag: tuple[float, ...]
    of_span: bool = False

    def sagging(self, running: bool) -> tuple[float, ...]:
        """The pre-sag of each dropper [m]: spans that are not ``running`` have only their own."""
        return self.pre_sag if running or self.of_span else (0.0,) * len(self.positions)


def hung_in(
    origin: Origin, key: str, kind: HangingTable, spans: Mapping[int, float]
) -> dict[int, Hung]:
    """The droppers of a table in spans, by the number of the span from 1.

    ``spans`` are lengths [m] by these numbers.

    Raises
    ------
    InputError
        If the table ``key`` has no pattern for one of the spans.
    """
    by_number = {n: pattern for pattern in kind.patterns or () for n in pattern.spans or ()}
    by_length: dict[float, Hung] = {}  # spans of one length are alike
    found: dict[int, Hung] = {}
    for number, span in spans.items():
        pattern = by_number.get(number)
        if pattern is not None:
            places = tuple(pattern.positions_m)
            own_sag = pattern.pre_sag_mm is not None
            found[number] = Hung(places, _pre_sag(kind, pattern, places), own_sag)
            continue
        if span not in by_length:
            of_length = {p.span_m: p for p in kind.patterns or () if p.span_m is not None}
            near = (p for length, p in of_length.items() if abs(length - span) < _SAME_SPAN)
            pattern = next(near, None)
            own = _positions(kind, pattern, span)
            if own is None:
                raise InputError(_no_entry(origin, f"{key}.patterns", kind, number, span))
            by_length[span] = Hung(own, _pre_sag(kind, pattern, own))
        found[number] = by_length[span]
    return found


def _no_entry(origin: Origin, key: str, kind: HangingTable, number: int, span: float) -> str:
    lengths = [f"{p.span_m:g}" for p in kind.patterns or () if p.span_m is not None]
    if lengths:
        what, has = f"spans of {span:g} m", f"{', '.join(lengths)} m"
    else:
        numbers = sorted(n for p in kind.patterns or () for n in p.spans or ())
        spans = f"{len(numbers)} span{'s' * (len(numbers) > 1)}"
        what, has = f"span {number}", f"{spans}, from {numbers[0]} to {numbers[-1]}"
    return f"{key} {origin.of(key)} has no entry for {what}; it has {has}"


def _positions(
    kind: HangingTable, pattern: DropperPattern | None, span: float
) -> tuple[float, ...] | None:
    """Distances from the left support [m], None where no pattern gives them."""
    if kind.positions_m is not None:
        return tuple(kind.positions_m)
    if kind.patterns is not None:
        return None if pattern is None else tuple(pattern.positions_m)
    assert kind.count is not None and kind.spacing_m is not None
    margin = 0.5 * (span - (kind.count - 1) * kind.spacing_m)
    return tuple(margin + i * kind.spacing_m for i in range(kind.count))


def _pre_sag(
    kind: HangingTable, pattern: DropperPattern | None, positions: tuple[float, ...]
) -> tuple[float, ...]:
    given = None if pattern is None else pattern.pre_sag_mm
    if not isinstance(kind, DropperTable):
        return (0.0,) * len(positions)
    given = kind.pre_sag_mm or given
    if given is not None:
        return tuple(length_from_mm(value) for value in given)
    if not kind.pre_sag_mid_mm or len(positions) < FEWEST_SAGGING:
        return (0.0,) * len(positions)
    # Plain numbers: a long line may have as many lengths as spans.
    first, last, sag = positions[0], positions[-1], length_from_mm(kind.pre_sag_mid_mm)
    across = [(2 * x - first - last) / (last - first) for x in positions]
    return tuple(sag * (1 - place * place) for place in across)


class SupportTable(Table):
    """Support of the topmost wire at a mast."""

    stiffness_N_per_m: float = Field(5e5, gt=0, le=1e10, description="vertical stiffness")


class SteadyArmTable(Table):
    """The arm that holds the contact wire sideways at a mast."""

    length_m: float = Field(0.0, ge=0, le=10, description="length from hinge to clamp")
    mass_kg_per_m: float = Field(0.0, ge=0, le=100, description="mass per length")
    clamp_kg: float = Field(0.0, ge=0, le=100, description="clamp on the contact wire")
    stiffness_N_per_m: float = Field(
        0.0, ge=0, le=1e8, description="vertical stiffness at the contact wire"
    )
    stiffness_by_radial_force: bool = Field(
        False,
        description="whether the vertical stiffness is the radial force of the stagger over "
        "length_m, as with lateral motion, in place of stiffness_N_per_m",
    )
    holds_height: bool = Field(
        False,
        description="whether the arm holds the contact wire at its height at rest; otherwise the "
        "wire hangs freely between the droppers next to it",
    )
    inclination_deg: float | None = Field(
        None,
        ge=0,
        le=30,
        description="inclination from the wire up to its hinge at rest, with lateral motion; if "
        "absent, it follows from the weight that the arm carries",
    )

    registration_stiffness_N_per_m: float | None = Field(
        None,
        ge=1e3,
        le=1e8,
        description="stiffness along the steady arm of the registration arm that holds its hinge, "
        "with lateral motion; rigid if absent",
    )

    uplift_stop_m: float | None = Field(
        None,
        gt=0,
        le=1,
        description="by how much the contact wire may be lifted at the arm before that meets a "
        "stop; if absent, there is none",
    )
    uplift_stop_stiffness_N_per_m: float | None = Field(
        None, ge=1e3, le=1e8, description="stiffness of the stop; if absent, 1e5 N/m"
    )

    @model_validator(mode="after")
    def _consistent(self) -> SteadyArmTable:
        if self.uplift_stop_stiffness_N_per_m is not None and self.uplift_stop_m is None:
            raise ValueError(
                "has an uplift_stop_stiffness_N_per_m, but no uplift_stop_m; give both, or neither"
            )
        either(self, "holds_height", "inclination_deg")
        either(self, "stiffness_N_per_m", "stiffness_by_radial_force")
        bar = {
            "inclination_deg": self.inclination_deg is not None,
            "registration_stiffness_N_per_m": self.registration_stiffness_N_per_m is not None,
            "stiffness_by_radial_force = true": self.stiffness_by_radial_force,
        }
        for key, given in bar.items():
            if given and not self.length_m:
                raise ValueError(f"needs length_m above 0 for {key}")
        return self


class FittingTable(Table):
    """A fitting as a lumped mass, which droppers are cut for."""

    kind: Literal["section_insulator", "neutral_section", "splice", "mid_point_anchor"] = Field(
        description="its kind, for reports"
    )
    wire: WireName = Field(
        "contact_wire",
        description="name of a wire of the line, such as contact_wire, messenger_wire",
    )
    at_m: float = Field(ge=0, le=1e7, description="its place, or its begin, along the line")
    length_m: float = Field(
        0.0, ge=0, le=200, description="its length; half of its mass is at either end"
    )
    mass_kg: float = Field(gt=0, le=200, description="its mass")


def steady_arm(table: SteadyArmTable) -> SteadyArm:
    """A steady arm."""
    tilt = table.inclination_deg
    return SteadyArm(
        length=table.length_m,
        mass_per_length=table.mass_kg_per_m,
        clamp_mass=table.clamp_kg,
        stiffness=table.stiffness_N_per_m,
        holds_height=table.holds_height,
        inclination=None if tilt is None else angle_from_deg(tilt),
        uplift_stop=table.uplift_stop_m,
        stop_stiffness=table.uplift_stop_stiffness_N_per_m or SteadyArm.stop_stiffness,
        by_radial_force=table.stiffness_by_radial_force,
        registration_stiffness=table.registration_stiffness_N_per_m,
    )


def fittings_of(tables: Sequence[FittingTable]) -> tuple[Fittings, ...]:
    """Fittings by kind and wire; what has a length is two masses."""
    found: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for one in tables:
        ends = (one.at_m, one.at_m + one.length_m) if one.length_m else (one.at_m,)
        group = found.setdefault((one.kind, one.wire), [])
        group += [(x, one.mass_kg / len(ends)) for x in ends]
    return tuple(
        Fittings(kind, wire, *zip(*sorted(group), strict=True))
        for (kind, wire), group in found.items()
    )
