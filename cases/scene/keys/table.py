"""Base of all tables of a scene: strict types, no unknown keys, bounds, courses of pairs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated, Any, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from catenary.base.options import option


class Table(BaseModel):
    """A table of ``case.toml``.

    Strict: "20 kN" is not a number and 1 is not true. Validators raise ``ValueError`` with a
    predicate ("must be ...") that ``keys.schema_faults`` completes with key, value and place.
    """

    # Validators are built at their first use: the one of a scene includes those of all its tables.
    model_config = ConfigDict(
        strict=True, extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True
    )


def take_away() -> str:
    """Advice on removing a key of a case file, for sentences about keys that exclude others."""
    return f" ({option('--set KEY=', 'None in replace()')} takes one away)"


def _as_list(value: Any) -> Any:
    return [value] if isinstance(value, int | float) and not isinstance(value, bool) else value


def not_with(key: str, why: str) -> ValueError:
    """The error of a key that is given although another one excludes it, for a reason ``why``."""
    return ValueError(f"must not have {key} {why}{take_away()}")


def given(table: Table, *names: str) -> list[str]:
    """The keys among ``names`` that have a value."""
    return [name for name in names if getattr(table, name) is not None]


def exactly_one(table: Table, *names: str) -> None:
    """Raise ``ValueError`` unless exactly one of the keys ``names`` is given."""
    there = given(table, *names)
    if len(there) != 1:
        but = "none is given" if not there else f"{' and '.join(there)} are given{take_away()}"
        raise ValueError(f"needs exactly one of {', '.join(names)}, but {but}")


def either(table: Table, one: str, other: str) -> None:
    """Raise ``ValueError`` if two keys both differ from their defaults."""
    fields = type(table).model_fields
    if all(getattr(table, name) != fields[name].default for name in (one, other)):
        raise ValueError(f"takes {one} or {other}, but both are given{take_away()}")


def together(table: Table, *names: str) -> None:
    """Raise ``ValueError`` if some of the keys ``names`` are given without the others."""
    there = given(table, *names)
    if 0 < len(there) < len(names):
        raise ValueError(
            f"needs {' and '.join(names)} together, but only has {' and '.join(there)}"
        )


class StretchTable(Table):
    """A stretch of the line, whose end lies behind its start."""

    from_m: float
    to_m: float

    @model_validator(mode="after")
    def _has_length(self) -> Self:
        if self.to_m <= self.from_m:
            raise ValueError(
                f"must end behind its start, but to_m is {self.to_m:g} and from_m {self.from_m:g}"
            )
        return self


def band(shortest: float, longest: float) -> None:
    """Raise ``ValueError`` unless there are wavelengths from ``shortest_m`` to ``longest_m``."""
    if longest <= shortest:
        raise ValueError(
            f"must have waves, but longest_m is {longest:g} and shortest_m {shortest:g}"
        )


def ascending(values: Sequence[float], what: str) -> None:
    """Raise ``ValueError`` unless each value is greater than the one before."""
    for before, after in zip(values, values[1:], strict=False):
        if after <= before:
            raise ValueError(
                f"must list {what} in ascending order, but {after:g} follows {before:g}"
            )


# A list for which a person may write one number.
OneOrMore = BeforeValidator(_as_list)
# Name of any wire of a line.
WireName = Annotated[str, Field(min_length=1, max_length=100)]
PAIR = Annotated[list[Annotated[float, Field(ge=-1e6, le=1e6)]], Field(min_length=2, max_length=2)]


def ascending_pairs(pairs: list[list[float]]) -> list[list[float]]:
    """The pairs, whose first numbers must ascend."""
    ascending([pair[0] for pair in pairs], "its first numbers")
    return pairs


def within(most: float) -> Callable[[list[list[float]]], list[list[float]]]:
    """The check that pairs have ascending first numbers and deviations up to ``most`` [m]."""

    def check(pairs: list[list[float]]) -> list[list[float]]:
        for at, value in ascending_pairs(pairs):
            if abs(value) > most:
                raise ValueError(f"must stay within {most:g} m, but is {value:g} m at {at:g}")
        return pairs

    return check
