"""Scene tables of what holds wires along the track."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from catenary.cases.scene.tables.table import Table

# How wires end along the track.
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
    stop_stiffness_N_per_m: float = Field(1e6, gt=0, le=1e9, description="stiffness of that stop")
    weights_kg: dict[str, Mass] = Field(
        default_factory=dict,
        description="mass of the weights by name of the wire; those of others fit their tensions",
    )


class TemperatureTable(Table):
    """How warm the line is."""

    difference_K: float = Field(
        0.0,
        ge=-100,
        le=150,
        description="temperature less that of the installation; acts with effects.axial_motion",
    )
