"""Scene tables of irregularities: heights of contact wires, running surface, dropper lengths."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from catenary.cases.scene.tables.courses import PAIR, within
from catenary.cases.scene.tables.table import TAKE_AWAY, Table

# Higher or lower than this no contact wire is hung by mistake [m].
MOST = 0.5


_Course = Annotated[
    list[PAIR], Field(min_length=2, max_length=100_000), AfterValidator(within(MOST))
]  # fmt: skip
Seed = Annotated[int, Field(ge=0, le=2**31 - 1)]


class HeightTable(Table):
    """Heights along the track, random, as given, or the sum of both."""

    standard_deviation_mm: float | None = Field(
        None, gt=0, le=100, description="of random heights, those of all wavelengths together"
    )
    exponent: float = Field(
        2.0, ge=0, le=6, description="their spectrum falls with this power of the wave number"
    )
    shortest_m: float = Field(ge=0.05, le=1000, description="shortest wavelength")
    longest_m: float = Field(ge=0.05, le=1000, description="longest wavelength")
    seed: Seed = Field(1, description="another seed gives other heights")
    from_m: float | None = Field(
        None, ge=0, le=1e7, description="where random heights begin; with the running range"
    )
    to_m: float | None = Field(
        None, ge=0, le=1e7, description="where random heights end; with the running range"
    )
    by_place: _Course | None = Field(
        None,
        description="pairs of place along the track [m] and height [m], joined by a cubic spline; "
        "beyond them the height stays",
    )

    @model_validator(mode="after")
    def _consistent(self) -> HeightTable:
        if self.standard_deviation_mm is None and self.by_place is None:
            raise ValueError("needs standard_deviation_mm or by_place, but none is given")
        if self.longest_m <= self.shortest_m:
            raise ValueError(
                f"must have waves, but longest_m is {self.longest_m:g} and shortest_m "
                f"{self.shortest_m:g}"
            )
        given = [name for name in ("from_m", "to_m") if getattr(self, name) is not None]
        if given and self.standard_deviation_mm is None:
            raise ValueError(f"must not have {given[0]} without standard_deviation_mm{TAKE_AWAY}")
        return self


class WireHeightTable(HeightTable):
    """Heights of the contact wires where they are held: droppers are cut for them."""

    shortest_m: float = Field(12.0, ge=1, le=1000, description="shortest wavelength")
    longest_m: float = Field(120.0, ge=1, le=1000, description="longest wavelength")


class SurfaceTable(HeightTable):
    """Heights of what the strips run on above the wires' axes, which no dropper sees."""

    shortest_m: float = Field(0.5, ge=0.05, le=1000, description="shortest wavelength")
    longest_m: float = Field(5.0, ge=0.05, le=1000, description="longest wavelength")


class LengthsTable(Table):
    """Errors of the droppers' lengths, positive for those that are cut too long."""

    standard_deviation_mm: float = Field(
        0.0, ge=0, le=200, description="of random errors, before they are cut off"
    )
    cut_off: float = Field(
        2.5, ge=0.1, le=6, description="at how many standard deviations errors are cut off"
    )
    seed: Seed = Field(1, description="another seed gives other errors")
    by_dropper: (
        Annotated[
            list[Annotated[list[float], Field(min_length=3, max_length=3)]],
            Field(min_length=1, max_length=100_000),
        ]
        | None
    ) = Field(
        None,
        description="entries [span, number of the dropper in it, error in mm], both counted from "
        "1; on top of random errors",
    )

    @model_validator(mode="after")
    def _consistent(self) -> LengthsTable:
        if not self.standard_deviation_mm and self.by_dropper is None:
            raise ValueError("needs standard_deviation_mm or by_dropper, but none is given")
        for span, dropper, error in self.by_dropper or []:
            if span != int(span) or dropper != int(dropper) or span < 1 or dropper < 1:
                raise ValueError(
                    "must have entries [span, dropper, error in mm] with whole numbers from 1 on, "
                    f"but has [{span:g}, {dropper:g}, {error:g}]"
                )
            if abs(error) > 1000.0 * MOST:
                raise ValueError(f"must have errors within {1000 * MOST:g} mm, but has {error:g}")
        return self


class IrregularitiesTable(Table):
    """What is irregular about the line from the start; each entry is an effect of its name."""

    contact_wire_height: WireHeightTable | None = Field(
        None, description="heights that droppers are cut for"
    )
    running_surface: SurfaceTable | None = Field(
        None, description="waviness and wear of what the strips run on"
    )
    dropper_lengths: LengthsTable | None = Field(
        None, description="errors of the droppers' lengths"
    )

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the entries that there are."""
        return tuple(name for name in type(self).model_fields if getattr(self, name) is not None)
