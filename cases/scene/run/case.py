"""What the case is, and the stretch whose statistics are judged: tables."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, model_validator

from catenary.cases.scene.keys.table import Table
from catenary.postproc.standards.book import RuleBook
from catenary.postproc.standards.library import DEFAULT, book_named, books_of_entries
from catenary.postproc.standards.quantities import LIMIT_KEYS


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


_WIDE = 1e4  # lengths beyond are no part of a contact line [mm]
_FORCE = 1e6


class LimitsTable(Table):
    """The line's own limits, which rule books refer to."""

    uplift_space_mm: float | None = Field(
        None, gt=0, le=_WIDE, description=LIMIT_KEYS["uplift_space_mm"].meaning
    )
    working_width_mm: float | None = Field(
        None, gt=0, le=_WIDE, description=LIMIT_KEYS["working_width_mm"].meaning
    )
    wire_lateral_place_mm: float | None = Field(
        None, gt=0, le=_WIDE, description=LIMIT_KEYS["wire_lateral_place_mm"].meaning
    )
    wire_height_min_mm: float | None = Field(
        None, gt=0, le=_WIDE, description=LIMIT_KEYS["wire_height_min_mm"].meaning
    )
    wire_height_max_mm: float | None = Field(
        None, gt=0, le=_WIDE, description=LIMIT_KEYS["wire_height_max_mm"].meaning
    )
    lateral_sweep_mm_per_s: float | None = Field(
        None, gt=0, le=1e5, description=LIMIT_KEYS["lateral_sweep_mm_per_s"].meaning
    )
    elasticity_variation_percent: float | None = Field(
        None, gt=0, le=100, description=LIMIT_KEYS["elasticity_variation_percent"].meaning
    )
    arcing_percent: float | None = Field(
        None, ge=0, le=100, description=LIMIT_KEYS["arcing_percent"].meaning
    )
    dropper_force_N: float | None = Field(
        None, gt=0, le=_FORCE, description=LIMIT_KEYS["dropper_force_N"].meaning
    )
    dropper_compression_N: float | None = Field(
        None, ge=0, le=_FORCE, description=LIMIT_KEYS["dropper_compression_N"].meaning
    )
    dropper_slackenings: int | None = Field(
        None, ge=0, le=10**6, description=LIMIT_KEYS["dropper_slackenings"].meaning
    )
    contact_wire_tension_N: float | None = Field(
        None, gt=0, le=_FORCE, description=LIMIT_KEYS["contact_wire_tension_N"].meaning
    )
    contact_wire_strain_um_per_m: float | None = Field(
        None, gt=0, le=1e6, description=LIMIT_KEYS["contact_wire_strain_um_per_m"].meaning
    )


class EvaluationTable(Table):
    """The stretch whose statistics are judged, and by what."""

    from_m: float = Field(ge=0, le=1e6, description="start of the evaluated stretch")
    to_m: float = Field(gt=0, le=1e6, description="end of the evaluated stretch")
    rules: list[Annotated[str, Field(max_length=60)]] | None = Field(
        None,
        max_length=20,
        description="rule books that judge the run, as `name` or `name:edition`; "
        "the newest EN 50367 if absent",
    )
    rules_file: str | None = Field(
        None,
        max_length=1000,
        description="a rule book of one's own, a TOML file in the folder of the scene",
    )
    own_rules: dict[str, Any] | None = Field(None, description="such a book, in place of its file")
    limits: LimitsTable | None = Field(None, description="the line's own limits")
    edition: Annotated[str | None, BeforeValidator(_year)] = Field(
        None, description="edition of EN 50367, in place of rules"
    )
    system: str = Field("ac", description="power supply, which decides the mean force allowed")

    @model_validator(mode="after")
    def _consistent(self) -> EvaluationTable:
        if self.to_m <= self.from_m:
            raise ValueError(
                f"must end after it starts, but from_m is {self.from_m:g} and to_m {self.to_m:g}"
            )
        return self

    @property
    def chosen(self) -> list[str]:
        """Names of the shipped rule books that judge the run."""
        if self.edition is not None:
            return [f"{DEFAULT}:{self.edition}"]
        return [DEFAULT] if self.rules is None else self.rules

    @property
    def own_limits(self) -> dict[str, float]:
        """The limits that are given, by their keys."""
        given = self.limits
        return {} if given is None else given.model_dump(exclude_none=True)


def rule_entries(table: EvaluationTable) -> list[str | dict[str, Any]]:
    """Rule books as a result file has them: shipped ones by name and edition, one's own whole."""
    entries: list[str | dict[str, Any]] = [book_named(name).key for name in table.chosen]
    return entries + ([] if table.own_rules is None else [table.own_rules])


def chosen_books(table: EvaluationTable) -> list[RuleBook]:
    """The rule books that judge the run.

    Raises
    ------
    InputError
        If one is named twice.
    """
    return books_of_entries(rule_entries(table))
