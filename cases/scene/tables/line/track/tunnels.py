"""Scene table of tunnels along a line."""

from __future__ import annotations

from pydantic import Field, model_validator

from catenary.cases.scene.tables.table import Table


class TunnelTable(Table):
    """A tunnel: aerodynamic forces on pantographs are larger in it, and there is no wind."""

    from_m: float = Field(ge=0, le=1e6, description="place of its first portal")
    to_m: float = Field(ge=0, le=1e6, description="place of its second portal")
    force_factor: float = Field(
        1.0, ge=0.1, le=10, description="aerodynamic forces in it over those on the open line"
    )
    portal_m: float = Field(
        20.0, ge=0, le=1000, description="length behind each portal in which they change"
    )

    @model_validator(mode="after")
    def _has_length(self) -> TunnelTable:
        if self.to_m <= self.from_m:
            raise ValueError(
                f"must end behind its start, but to_m is {self.to_m:g} and from_m {self.from_m:g}"
            )
        return self
