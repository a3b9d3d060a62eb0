"""From a scene's tables of uplift and tunnels to their data, in SI units."""

from __future__ import annotations

from collections.abc import Sequence

from catenary.cases.scene.tables.line.track.tunnels import TunnelTable
from catenary.cases.scene.tables.train.aerodynamics import AerodynamicsTable, UpliftTable
from catenary.cases.scene.tables.units import speed_from_km_h
from catenary.mbs.air import Polynomial, Table, Tunnel, Uplift


def uplift_of(table: AerodynamicsTable | None, reversed: bool) -> Uplift | None:
    """Uplift of a pantograph that runs as it is described, or the other way round."""
    if table is None:
        return None
    own: UpliftTable = table
    if reversed and table.reversed is not None:
        own = table.reversed
    return Uplift(_force(own), own.head_share)


def tunnels_of(tables: Sequence[TunnelTable]) -> tuple[Tunnel, ...]:
    """Tunnels of a line."""
    return tuple(Tunnel(t.from_m, t.to_m, t.force_factor, t.portal_m) for t in tables)


def _force(table: UpliftTable) -> Polynomial | Table:
    if table.uplift_polynomial is not None:
        unit = speed_from_km_h(1.0)
        return Polynomial(tuple(c / unit**k for k, c in enumerate(table.uplift_polynomial)))
    assert table.uplift_by_speed is not None
    speeds, forces = zip(*table.uplift_by_speed, strict=True)
    return Table(tuple(speed_from_km_h(speed) for speed in speeds), forces)
