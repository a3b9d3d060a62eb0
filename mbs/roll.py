"""How the head of a pantograph rolls, whatever its model."""

from __future__ import annotations

from typing import TYPE_CHECKING

from catenary.mbs.head.strips import Turning
from catenary.mbs.lumped_data import LumpedData

if TYPE_CHECKING:
    from catenary.mbs.mechanism.pantograph_data import MultibodyData


def roll_of(data: LumpedData | MultibodyData) -> Turning | None:
    """How the head of a pantograph rolls, None if it cannot. Not collective.

    Only a mechanism needs the machinery of multibody systems, which is imported for it alone.
    """
    if isinstance(data, LumpedData):
        return data.roll
    from catenary.mbs.mechanism.head_rotation import ROLL, head_turning

    return head_turning(data, ROLL)
