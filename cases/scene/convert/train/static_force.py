"""The static force that a scene wants of a pantograph, at its speed."""

from __future__ import annotations

import numpy as np

from catenary.cases.scene.tables.train.pantograph import MultibodyTable, PantographTable
from catenary.mbs.library import READY


def wanted_force(table: PantographTable, speed_km_h: float) -> float | None:
    """Static force [N] of a table at a speed, None if it has none for it."""
    if table.static_force_N is not None:
        return table.static_force_N
    if table.static_force_by_speed is None:
        ready = None if isinstance(table, MultibodyTable) else table.model
        return None if ready is None else READY[ready].force_at(speed_km_h)
    speeds, forces = np.array(table.static_force_by_speed).T
    if not speeds[0] <= speed_km_h <= speeds[-1]:
        return None
    return float(np.interp(speed_km_h, speeds, forces))
