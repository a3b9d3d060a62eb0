"""What a run records and writes: table."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from catenary.cases.scene.keys.table import TAKE_AWAY, Table
from catenary.postproc.record.snapshots.blocks import OTHER_PARTS
from catenary.postproc.record.snapshots.field_kinds import FIELDS, USUAL_FIELDS
from catenary.solver.time_loop.views.channels import line_channels

# Channels of the line, which may be recorded in part.
_RECORDED = line_channels()
_FIELDS = FIELDS


class OutputTable(Table):
    """What is written, and how much of it."""

    field_every_s: float | None = Field(
        None,
        ge=0,
        le=1e4,
        description="cadence of field snapshots; 0 writes none; 0.05 s if absent, or as much "
        "longer as keeps them within 500 MB",
    )
    field_every_m: float | None = Field(
        None, gt=0, le=1e4, description="the same as a distance that the train travels"
    )
    fields: list[Literal[_FIELDS]] | None = Field(  # type: ignore[valid-type]
        None,
        min_length=1,
        max_length=len(_FIELDS),
        description=f"fields of the snapshots, of {' and '.join(_FIELDS)}; "
        f"{' and '.join(USUAL_FIELDS)} if absent",
    )
    field_parts: list[Annotated[str, Field(min_length=1, max_length=100)]] | None = Field(
        None,
        min_length=1,
        max_length=100,
        description="parts of the line that snapshots show: names of wires, and "
        f"{', '.join(OTHER_PARTS)}; all if absent",
    )
    field_spans: list[Annotated[int, Field(ge=1, le=10**6)]] | None = Field(
        None,
        min_length=2,
        max_length=2,
        description="first and last span that snapshots show, counted from 1; if absent all, or "
        "with a window.mode other than off what moves",
    )
    field_window_m: list[Annotated[float, Field(ge=0, le=1e6)]] | None = Field(
        None,
        min_length=2,
        max_length=2,
        description="how far behind the last and ahead of the first pantograph snapshots show the "
        "line; if absent the whole line, or with a window.mode other than off what moves",
    )
    energy_every_s: float = Field(
        0.05, ge=0, le=1e4, description="cadence of the line's energy; 0 writes none"
    )
    flush_every_steps: int | None = Field(
        None,
        ge=1,
        le=10**7,
        description="steps after which the result file is brought up to date; about half a "
        "second's worth if absent",
    )
    line_channels: list[Literal[_RECORDED]] | None = Field(  # type: ignore[valid-type]
        None,
        max_length=len(_RECORDED),
        description=f"channels of the line that are recorded, of {' and '.join(_RECORDED)}; "
        "all if absent. Their extremes are kept of every step, whatever is recorded",
    )
    line_channels_every_s: float | None = Field(
        None,
        ge=0,
        le=1e4,
        description="cadence of the line's channels; 0 records every step. Of this key and the "
        "next four none: every step up to 500 MB, with window.mode = bounded of the spans that "
        "move; beyond it every 5 ms from 300 m behind to 200 m ahead of the train",
    )
    line_channels_every_m: float | None = Field(
        None, ge=0, le=1e4, description="the same as a distance that the train travels"
    )
    line_channels_window_m: list[Annotated[float, Field(ge=0, le=1e6)]] | None = Field(
        None,
        min_length=2,
        max_length=2,
        description="how far behind the last and ahead of the first pantograph the line's channels "
        "are recorded; the whole line if absent",
    )
    line_channels_spans: list[Annotated[int, Field(ge=1, le=10**6)]] | None = Field(
        None,
        min_length=2,
        max_length=2,
        description="first and last span whose channels are recorded, counted from 1; all if "
        "absent",
    )
    line_channels_compression: Literal["none", "gzip"] | None = Field(
        None,
        description="compression of the line's channels; gzip where their size has thinned them, "
        "none otherwise, if absent",
    )

    @property
    def chooses_line_channels(self) -> bool:
        """Whether the scene says what is recorded of the line's channels."""
        own = (
            self.line_channels,
            self.line_channels_every_s,
            self.line_channels_every_m,
            self.line_channels_window_m,
            self.line_channels_spans,
        )
        return any(value is not None for value in own)

    @model_validator(mode="after")
    def _can_be_recorded(self) -> OutputTable:
        if self.line_channels_every_s is not None and self.line_channels_every_m is not None:
            raise ValueError(
                "takes line_channels_every_s or line_channels_every_m, but both are given"
                + TAKE_AWAY
            )
        if self.field_every_s is not None and self.field_every_m is not None:
            raise ValueError("takes field_every_s or field_every_m, but both are given" + TAKE_AWAY)
        for key in ("line_channels_spans", "field_spans"):
            spans = getattr(self, key)
            if spans is not None and spans[0] > spans[1]:
                raise ValueError(
                    f"must have {key} from a span to a later one, not {spans[0]} to {spans[1]}"
                )
        return self
