"""The sampling file: its tables, read and checked."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from catenary.base.errors import InputError
from catenary.cases.scene.input.faults import shown
from catenary.cases.scene.input.plain_text import refuse_deep
from catenary.cases.scene.input.toml_input import read_toml
from catenary.cases.scene.keys.table import Table
from catenary.cases.studies.sampling.distributions import (
    ChanceTable,
    ChoicesTable,
    DistributionTable,
    LognormalTable,
    NormalTable,
    SeedTable,
    TruncatedNormalTable,
    UniformTable,
)
from catenary.cases.studies.sweep.variants import check_key
from catenary.cases.studies.task_files import checked_table

MOST_SAMPLES = 100_000
_Key = Annotated[str, Field(min_length=1, max_length=200)]
SALTELLI = "saltelli"


class _AlongLine(Table):
    """Correlation of values along the line."""

    correlation_length_m: float = Field(
        0.0,
        ge=0,
        le=1e6,
        description="distance over which the correlation falls to 1/e; independent values if 0",
    )
    correlation: Literal["exponential", "gaussian"] = Field(
        "exponential", description="exp(-d/l) or exp(-(d/l)^2) of the distance d"
    )
    at: Literal["supports", "droppers"] | None = Field(
        None, description="where a course along the line has its values"
    )


class NormalField(_AlongLine, NormalTable):
    """Normally distributed values along the line."""


class LognormalField(_AlongLine, LognormalTable):
    """Values along the line whose logarithms are normally distributed."""


class UniformField(_AlongLine, UniformTable):
    """Uniformly distributed values along the line."""


class TruncatedNormalField(_AlongLine, TruncatedNormalTable):
    """Values along the line of a normal distribution restricted to an interval."""


class ChanceField(_AlongLine, ChanceTable):
    """Defects of droppers by chance."""


FieldTable = ChanceField | NormalField | LognormalField | UniformField | TruncatedNormalField


class CorrelationTable(Table):
    """Rank correlation of two keys."""

    keys: Annotated[list[_Key], Field(min_length=2, max_length=2)] = Field(
        description="the two keys"
    )
    rank: float = Field(gt=-1, lt=1, description="Spearman's rank correlation")


class SamplingTable(Table):
    """A sampling file."""

    n: int = Field(
        ge=2,
        le=MOST_SAMPLES,
        description="number of samples; with saltelli, of base samples",
    )
    seed: int = Field(1, ge=0, le=2**31 - 1, description="another seed gives other samples")
    method: Literal["sobol", "latin_hypercube", "random", "saltelli"] = Field(
        "sobol", description="how samples are distributed over the unit cube"
    )
    second_order: bool = Field(
        False, description="whether saltelli's samples also give second-order indices"
    )
    keys: dict[_Key, Annotated[DistributionTable, Field(discriminator="type")]] = Field(
        default_factory=dict, max_length=1000, description="distributions by keys of the scene"
    )
    correlations: list[CorrelationTable] = Field(
        default_factory=list, max_length=100_000, description="rank correlations of keys"
    )
    fields: dict[_Key, Annotated[FieldTable, Field(discriminator="type")]] = Field(
        default_factory=dict,
        max_length=10,
        description="distributions along the line, by the key that takes the values",
    )

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the inputs: the keys, then the fields as ``field of KEY``."""
        return (*self.keys, *(field_column(key) for key in self.fields))

    @property
    def block(self) -> int:
        """Number of samples that make one base sample: 1 but for saltelli."""
        if self.method != SALTELLI:
            return 1
        d = len(self.columns)
        return 2 * d + 2 if self.second_order else d + 2

    @property
    def n_samples(self) -> int:
        """Number of all samples."""
        return self.n * self.block

    @model_validator(mode="after")
    def _consistent(self) -> SamplingTable:
        if not self.columns:
            raise ValueError("needs keys or fields, but none is given")
        if self.method == SALTELLI:
            if self.n & (self.n - 1):
                below = 1 << (self.n.bit_length() - 1)
                raise ValueError(
                    f'must have a power of 2 for n with method = "saltelli", such as {below} or '
                    f"{2 * below}, but n is {self.n}"
                )
            if self.correlations:
                raise ValueError(
                    'takes no correlations with method = "saltelli": Sobol indices are those of '
                    "independent keys"
                )
        elif self.second_order:
            raise ValueError('takes second_order with method = "saltelli" only')
        if self.n_samples > MOST_SAMPLES:
            raise ValueError(
                f"must have at most {MOST_SAMPLES} samples, but n and {len(self.columns)} inputs "
                f"make {self.n_samples}"
            )
        pairs: set[frozenset[str]] = set()
        for one in self.correlations:
            for key in one.keys:
                if key not in self.keys:
                    raise ValueError(f"must have keys of a correlation in keys, but has not {key}")
                if isinstance(self.keys[key], ChoicesTable | SeedTable):
                    raise ValueError(
                        f"takes no correlation of {key}: it is a {self.keys[key].type} key, which "
                        "has no ranks"
                    )
            pair = frozenset(one.keys)
            if len(pair) < 2 or pair in pairs:
                raise ValueError(
                    f"must have one correlation of two keys, but not so of {' and '.join(one.keys)}"
                )
            pairs.add(pair)
        return self


def field_column(key: str) -> str:
    """The input, and the column of a sweep's table, that numbers the realisations of a field."""
    return f"field of {key}"


def read_sampling(path: Path) -> SamplingTable:
    """The tables of a sampling file.

    Raises
    ------
    InputError
        If it cannot be read, or as ``sampling_of``.
    """
    return sampling_of(read_toml(path), str(path))


def sampling_of(raw: Mapping[str, Any], file: str) -> SamplingTable:
    """The checked tables of a sampling.

    Parameters
    ----------
    raw : nested tables as TOML gives them; ``keys`` and ``fields`` by dotted or nested keys
    file : where they were written, for sentences

    Raises
    ------
    InputError
        If a value or a key is wrong.
    """
    refuse_deep(dict(raw), file)
    tables = {
        name: _by_dotted_keys(value) if name in ("keys", "fields") else value
        for name, value in raw.items()
    }
    table = checked_table(tables, SamplingTable, file)
    for key in (*table.keys, *table.fields):
        if key.split(".")[0] == "petsc":
            raise InputError(
                f"{key} in {file} cannot vary: PETSc takes its options once, when the program "
                "starts"
            )
        check_key(key, f"in {file}")
        if key in table.keys and key in table.fields:
            raise InputError(f"{shown(key)[1:-1]} in {file} is in keys and in fields; keep one")
    return table


def _by_dotted_keys(value: Any) -> Any:
    """Tables of distributions by their dotted keys, however they are nested."""
    if not isinstance(value, Mapping):
        return value
    found: dict[str, Any] = {}
    for name, inner in value.items():
        nested = (
            isinstance(inner, Mapping)
            and inner
            and all(isinstance(below, Mapping) for below in inner.values())
        )
        if nested:
            found |= {f"{name}.{key}": own for key, own in _by_dotted_keys(inner).items()}
        else:
            found[name] = inner
    return found
