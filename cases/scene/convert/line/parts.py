"""Parts that lines of every topology have, in SI units: conductors, droppers, staggers."""

from __future__ import annotations

from catenary.base.errors import InputError
from catenary.cases.scene.input.origin import Origin
from catenary.cases.scene.tables.line.droppers import DropperTable, HangingTable
from catenary.cases.scene.tables.line.free import FreeArmsTable, FreeDroppersTable
from catenary.cases.scene.tables.line.hardware import SteadyArmTable
from catenary.cases.scene.tables.line.line import LineTable
from catenary.cases.scene.tables.line.wires import WireTable
from catenary.cases.scene.tables.units import angle_from_deg, length_from_mm
from catenary.meshgen.hardware import DropperKind, SteadyArm
from catenary.meshgen.wires import Conductor

# Span lengths are written in decimal; two that differ by less are the same one.
_SAME_SPAN = 1e-6
# Droppers of a span of which some hang lower than the first and the last one.
FEWEST_SAGGING = 3


def hanging_table(table: LineTable) -> DropperTable | None:
    """The table that says what slack droppers do; of a free line that of its first droppers."""
    links = (link for link in table.links or [] if isinstance(link, FreeDroppersTable))
    return table.dropper or next(links, None)


def wire_tables(table: LineTable) -> dict[str, WireTable]:
    """Tables of all wires of a line by their keys."""
    own = {f"line.{name}": getattr(table, name) for name in LineTable.model_fields}
    own |= {f"line.wires.{i}": wire for i, wire in enumerate(table.wires or [])}
    return {key: wire for key, wire in own.items() if isinstance(wire, WireTable)}


def arm_tables(table: LineTable) -> dict[str, SteadyArmTable]:
    """Tables of all steady arms of a line by their keys."""
    if table.links is None:
        return {"line.steady_arm": table.steady_arm}
    links = enumerate(table.links)
    return {f"line.links.{i}": link for i, link in links if isinstance(link, FreeArmsTable)}


def dropper_tables(table: LineTable) -> dict[str, DropperTable]:
    """Tables of all droppers that give pre-sag by their keys."""
    if table.dropper is not None:
        return {"line.dropper": table.dropper}
    links = enumerate(table.links or [])
    return {f"line.links.{i}": link for i, link in links if isinstance(link, FreeDroppersTable)}


def dropper_kind(table: HangingTable, lower_clamp: float) -> DropperKind:
    """What all droppers of a table share; ``lower_clamp`` [kg]."""
    return DropperKind(
        stiffness=table.stiffness_N_per_m,
        axial_stiffness=table.axial_stiffness_N,
        mass_per_length=table.mass_kg_per_m,
        upper_clamp_mass=table.messenger_clamp_kg,
        lower_clamp_mass=lower_clamp,
        curve=None if table.curve is None else tuple((x, y) for x, y in table.curve),
    )


def positions_in(
    origin: Origin, key: str, kind: HangingTable | None, span: float
) -> tuple[float, ...]:
    """Distances of the droppers of a table from the left support of a span [m].

    Raises
    ------
    InputError
        If the table ``key`` has no pattern for spans of that length.
    """
    if kind is None:
        return ()
    if kind.positions_m is not None:
        return tuple(kind.positions_m)
    if kind.patterns is not None:
        for pattern in kind.patterns:
            if abs(pattern.span_m - span) < _SAME_SPAN:
                return tuple(pattern.positions_m)
        listed = ", ".join(f"{pattern.span_m:g}" for pattern in kind.patterns)
        key = f"{key}.patterns"
        raise InputError(
            f"{key} {origin.of(key)} has no entry for spans of {span:g} m; it has {listed} m"
        )
    assert kind.count is not None and kind.spacing_m is not None
    margin = 0.5 * (span - (kind.count - 1) * kind.spacing_m)
    return tuple(margin + i * kind.spacing_m for i in range(kind.count))


def pre_sag_of(kind: DropperTable, span: float, positions: tuple[float, ...]) -> tuple[float, ...]:
    """Pre-sag that each dropper of a span gives [m]."""
    if kind.pre_sag_mm is not None:
        return tuple(length_from_mm(value) for value in kind.pre_sag_mm)
    for pattern in kind.patterns or []:
        if pattern.pre_sag_mm is not None and abs(pattern.span_m - span) < _SAME_SPAN:
            return tuple(length_from_mm(value) for value in pattern.pre_sag_mm)
    if not kind.pre_sag_mid_mm or len(positions) < FEWEST_SAGGING:
        return (0.0,) * len(positions)
    # Plain numbers: a long line may have as many lengths as spans.
    first, last, sag = positions[0], positions[-1], length_from_mm(kind.pre_sag_mid_mm)
    across = [(2 * x - first - last) / (last - first) for x in positions]
    return tuple(sag * (1 - place * place) for place in across)


def staggered(given: list[float], n_spans: int) -> tuple[float, ...]:
    """Lateral places at all supports: one number alternates [m]."""
    if len(given) > 1:
        return tuple(given)
    side = given[0]
    return tuple(side if i % 2 == 0 else -side for i in range(n_spans + 1))


def conductor(table: WireTable) -> Conductor:
    """The conductor of a wire."""
    return Conductor(
        table.tension_N,
        table.mass_kg_per_m,
        table.bending_stiffness_N_m2,
        axial_stiffness=table.stiffness_along(),
        expansion=table.expansion_per_K,
        diameter=None if table.diameter_mm is None else length_from_mm(table.diameter_mm),
        drag_coefficient=table.drag_coefficient,
    )


# Of a stop above a steady arm whose stiffness no scene gives [N/m].
_STOP_STIFFNESS = 1e5


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
        stop_stiffness=table.uplift_stop_stiffness_N_per_m or _STOP_STIFFNESS,
        by_radial_force=table.stiffness_by_radial_force,
        registration_stiffness=table.registration_stiffness_N_per_m,
    )
