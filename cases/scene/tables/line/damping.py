"""Scene tables of proportional damping."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from catenary.cases.scene.tables.table import Table


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
    lateral: ProportionalDamping | None = Field(
        None,
        description="damping of the wires' motion across the track, in place of that of the line "
        "and of components; acts with effects.lateral_motion",
    )
