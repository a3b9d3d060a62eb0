"""Scene table of what the case is."""

from __future__ import annotations

from pydantic import (
    Field,
)

from catenary.cases.scene.tables.table import Table


class CaseTable(Table):
    """What the case is."""

    name: str = Field("", max_length=200, description="name; the folder's if absent")
    title: str = Field("", max_length=500, description="one line for lists and reports")
    description: str = Field("", max_length=20000, description="problem and set-up")
    accept_unusual: bool | None = Field(
        None,
        description="whether numbers far outside of their usual range are meant; false if absent",
    )
    source: str = Field("", max_length=2000, description="where the data come from")
