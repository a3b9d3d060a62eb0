"""Scene table of the mesh."""

from __future__ import annotations

from pydantic import Field, model_validator

from catenary.cases.scene.tables.table import TAKE_AWAY, Table


class MeshTable(Table):
    """The finite-element mesh: made from the line, or the user's own."""

    elements_per_gap: int = Field(
        5, ge=1, le=64, description="elements between neighbouring droppers; 4 to 6 are usual"
    )
    support_refinement: int = Field(
        1, ge=1, le=16, description="factor by which the gaps next to supports are meshed finer"
    )
    file: str | None = Field(
        None,
        min_length=1,
        description="own mesh (.msh) with the same groups, relative to the case file",
    )

    @model_validator(mode="after")
    def _consistent(self) -> MeshTable:
        ignored = self.model_fields_set & {"elements_per_gap", "support_refinement"}
        if self.file is not None and ignored:
            raise ValueError(f"takes file or {sorted(ignored)[0]}, but both are given{TAKE_AWAY}")
        return self
