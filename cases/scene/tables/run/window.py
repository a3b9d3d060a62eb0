"""The table of a scene about the window of the line that moves with the train."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, model_validator

from catenary.cases.scene.tables.table import TAKE_AWAY, Table

_SPANS = ("spans_ahead", "spans_behind")


class WindowTable(Table):
    """Which part of the line moves."""

    mode: Literal["off", "exact", "bounded"] = Field(
        "off",
        description="off: all of the line moves; exact: whatever a wave has reached, to round-off; "
        "bounded: what is near the train, with an error that is told",
    )
    tolerance: float | None = Field(
        None,
        ge=1e-14,
        le=1e-2,
        description="mode bounded: stations rest whose motion is below this share of the largest",
    )
    spans_ahead: float | None = Field(
        None,
        ge=2,
        le=1e6,
        description="mode bounded: spans that move ahead of the first pantograph; chosen from "
        "damping and speed if this, spans_behind and tolerance are absent",
    )
    spans_behind: float | None = Field(
        None,
        ge=2,
        le=1e6,
        description="mode bounded: spans that move behind the last pantograph",
    )

    @model_validator(mode="after")
    def _fits_its_mode(self) -> WindowTable:
        given = [name for name in ("tolerance", *_SPANS) if getattr(self, name) is not None]
        if self.mode != "bounded" and given:
            raise ValueError(
                f"must not give {given[0]}, which belongs to mode bounded, with {self.mode}"
                + TAKE_AWAY
            )
        if "tolerance" in given and len(given) > 1:
            raise ValueError(f"takes tolerance or {given[1]}, but both are given{TAKE_AWAY}")
        if len(given) == 1 and given[0] in _SPANS:
            other = _SPANS[1 - _SPANS.index(given[0])]
            raise ValueError(f"must give {other} with {given[0]}, or neither")
        return self
