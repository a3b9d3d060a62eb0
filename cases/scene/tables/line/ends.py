"""Scene table of how the line ends."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, field_validator, model_validator

from catenary.cases.scene.tables.line.along import Along
from catenary.cases.scene.tables.table import Table

# Spans and largest damping of a layer: on the line of EN 50318 less damping lets waves through, and
# more sends back waves beside the gaps between bands.
USUAL_LAYER = {"spans": 20, "damping_per_s": 1.5}
# Kinds of ends that are asked for and are none here, and why.
_NO_KIND = {
    "dashpot": "must not be dashpot: matched dashpots sqrt(T m) send back 0.26 to 0.84 of a wave "
    "where droppers join two wires; periodic and absorbing_layer take waves up",
    "tensioner": "must not be tensioner: kind says what becomes of vertical waves; a wire that its "
    'tensioner lets move has along = "tensioner" beside it',
}


class EndTable(Table):
    """How the line ends on one side."""

    kind: Literal["fixed", "absorbing_layer", "periodic"] = Field(
        "fixed",
        description="wires held in height; the same after spans whose damping grows towards the "
        "end and takes waves up; or a line that goes on for ever with spans like the last one",
    )
    along: Along = Field(
        "fixed",
        description="wires held along the track, or by a tensioner each; acts with "
        "effects.axial_motion",
    )
    spans: int | None = Field(
        None, ge=1, le=1000, description="spans of an absorbing layer, 20 if not given"
    )
    damping_per_s: float | None = Field(
        None,
        gt=0,
        le=100,
        description="damping on mass at the outer end of an absorbing layer, 1.5 if not given; it "
        "grows as the square of the way into it",
    )

    @field_validator("kind", mode="before")
    @classmethod
    def _is_a_kind(cls, kind: Any) -> Any:
        if isinstance(kind, str) and kind in _NO_KIND:
            raise ValueError(_NO_KIND[kind])
        return kind

    @model_validator(mode="before")
    @classmethod
    def _with_usual_layer(cls, given: Any) -> Any:
        if isinstance(given, dict) and given.get("kind") == "absorbing_layer":
            named = {key: value for key, value in given.items() if value is not None}
            return {**USUAL_LAYER, **named}
        return given

    @model_validator(mode="after")
    def _consistent(self) -> EndTable:
        if self.kind != "absorbing_layer":
            for key in USUAL_LAYER:
                if getattr(self, key) is not None:
                    raise ValueError(f"takes {key} with kind absorbing_layer, not with {self.kind}")
        return self


class EndsTable(Table):
    """How the line ends on both sides."""

    start: EndTable = Field(default_factory=EndTable, description="where the line starts")
    end: EndTable = Field(default_factory=EndTable, description="where the line ends")
