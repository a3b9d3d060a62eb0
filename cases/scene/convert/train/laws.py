"""From a scene's tables of laws and of regulated lifts to their data, in SI units."""

from __future__ import annotations

from collections.abc import Sequence

from catenary.cases.scene.tables.train.laws import (
    FrictionTable,
    LawTable,
    LimiterTable,
    PneumaticDamperTable,
    RegulationTable,
)
from catenary.mbs.control import Regulation
from catenary.mbs.head.laws import Law

# Where the free side of a limiter begins [m]: its force is zero from there up to its rise.
_BELOW = -1.0


def laws_of(tables: Sequence[LawTable], n_masses: int) -> tuple[Law, ...]:
    """Laws of a pantograph of so many masses, the head first."""
    return tuple(_law(table, n_masses) for table in tables)


def _law(table: LawTable, n: int) -> Law:
    mass = (n if table.at_mass is None else table.at_mass) - 1
    if isinstance(table, LimiterTable):
        pairs = table.force_by_rise
        if pairs is None:
            assert table.rise_m is not None and table.stiffness_N_per_m is not None
            pairs = [[table.rise_m, 0.0], [table.rise_m + 1.0, table.stiffness_N_per_m]]
        return Law(mass, n, False, *_points([[_BELOW, 0.0], *pairs]), from_rest=True)
    below = mass + 1
    if isinstance(table, PneumaticDamperTable):
        pairs = table.force_by_velocity
        if pairs is None:
            assert table.up_N_s_per_m is not None and table.down_N_s_per_m is not None
            pairs = [[-1.0, -table.down_N_s_per_m], [0.0, 0.0], [1.0, table.up_N_s_per_m]]
        return Law(mass, below, True, *_points(pairs))
    if isinstance(table, FrictionTable):
        v, force = table.velocity_m_per_s, table.force_N
        pairs = [[-2.0 * v, -force], [-v, -force], [v, force], [2.0 * v, force]]
        return Law(mass, below, True, *_points(pairs))
    return Law(mass, below, False, *_points(table.force_by_extension))


def _points(pairs: Sequence[Sequence[float]]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    points, forces = zip(*pairs, strict=True)
    return tuple(points), tuple(forces)


def regulation_of(table: RegulationTable | None) -> Regulation | None:
    """What regulates a lift, None if nothing does."""
    if table is None:
        return None
    return Regulation(
        of_height=table.measures == "head_height",
        target=table.target,
        gains=tuple((row.at, row.error, row.integral_per_s, row.rate_s) for row in table.gains),
        least=table.least_N,
        most=table.most_N,
        sample_time=table.sample_s,
        filter_time=table.filter_s,
        delay=table.delay_s,
        from_time=table.from_s,
    )
