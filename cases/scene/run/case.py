"""What the case is, and the stretch whose statistics are judged: tables."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, model_validator

from catenary.cases.scene.keys.table import Table


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


def _year(value: Any) -> Any:
    """An edition is named by a year, which one writes as a number too."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


class EvaluationTable(Table):
    """The stretch whose statistics are judged, and by what."""

    from_m: float = Field(ge=0, le=1e6, description="start of the evaluated stretch")
    to_m: float = Field(gt=0, le=1e6, description="end of the evaluated stretch")
    edition: Annotated[str, BeforeValidator(_year)] = Field(
        "2006", description="edition of EN 50367 whose limits are applied"
    )
    system: str = Field("ac", description="power supply, which decides the mean force allowed")

    @model_validator(mode="after")
    def _consistent(self) -> EvaluationTable:
        if self.to_m <= self.from_m:
            raise ValueError(
                f"must end after it starts, but from_m is {self.from_m:g} and to_m {self.to_m:g}"
            )
        return self
