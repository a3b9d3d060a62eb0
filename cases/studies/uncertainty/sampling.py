"""The sampling file: its tables, read and checked, and the distributions of uncertain keys.

SciPy has the inverse functions of the distributions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from catenary.base.errors import InputError
from catenary.cases.scene.input.case_files import read_toml
from catenary.cases.scene.input.faults import shown
from catenary.cases.scene.input.plain_text import refuse_deep
from catenary.cases.scene.keys.table import Table
from catenary.cases.studies.sweep.variants import check_key
from catenary.cases.studies.task_files import checked_table

_Number = Annotated[float, Field(ge=-1e15, le=1e15)]
_Positive = Annotated[float, Field(gt=0, le=1e15)]
# Seeds of a scene are smaller; so are the numbers of realisations.
N_SEEDS = 2**31 - 1
_FARTHEST = 8.0  # standard deviations, beyond which is less than 1e-15 of a normal quantity
_WIDEST = 100.0  # standard deviations of lognormal quantities over their means
MOST_SAMPLES = 100_000
_Key = Annotated[str, Field(min_length=1, max_length=200)]
SALTELLI = "saltelli"


class NormalTable(Table):
    """A normal distribution."""

    type: Literal["normal"] = Field(description="kind of distribution")
    mean: _Number | None = Field(None, description="the scene's own value if absent")
    standard_deviation: _Positive = Field(description="in the unit of the key")


class LognormalTable(Table):
    """A quantity whose logarithm is normally distributed."""

    type: Literal["lognormal"] = Field(description="kind of distribution")
    mean: _Positive | None = Field(
        None, description="of the quantity itself; the scene's own value if absent"
    )
    standard_deviation: _Positive = Field(description="of the quantity itself")


class UniformTable(Table):
    """A uniform distribution."""

    type: Literal["uniform"] = Field(description="kind of distribution")
    least: _Number = Field(description="lower bound")
    most: _Number = Field(description="upper bound")

    @model_validator(mode="after")
    def _ordered(self) -> UniformTable:
        _check_bounds(self.least, self.most)
        return self


class TruncatedNormalTable(Table):
    """A normal distribution restricted to an interval."""

    type: Literal["truncated_normal"] = Field(description="kind of distribution")
    mean: _Number | None = Field(
        None, description="of the normal distribution; the scene's own value if absent"
    )
    standard_deviation: _Positive = Field(description="of the normal distribution")
    least: _Number | None = Field(None, description="lower bound")
    most: _Number | None = Field(None, description="upper bound")

    @model_validator(mode="after")
    def _bounded(self) -> TruncatedNormalTable:
        if self.least is None and self.most is None:
            raise ValueError("needs least or most, but none is given")
        if self.least is not None and self.most is not None:
            _check_bounds(self.least, self.most)
        return self


class ChoicesTable(Table):
    """One of some values."""

    type: Literal["choices"] = Field(description="kind of distribution")
    values: Annotated[list[Any], Field(min_length=1, max_length=10_000)] = Field(
        description="values of the key"
    )
    weights: list[Annotated[float, Field(ge=0, le=1e9)]] | None = Field(
        None, description="how often each is taken, relative to the others; equally if absent"
    )

    @model_validator(mode="after")
    def _weighted(self) -> ChoicesTable:
        if self.weights is not None:
            if len(self.weights) != len(self.values):
                raise ValueError(
                    f"must give one of weights per value, but there are {len(self.weights)} for "
                    f"{len(self.values)} values"
                )
            if not sum(self.weights) > 0:
                raise ValueError("must have weights whose sum is above 0")
        return self


class SeedTable(Table):
    """A whole number that differs from sample to sample, for a seed of the scene."""

    type: Literal["seed"] = Field(description="kind of distribution")


class ChanceTable(Table):
    """A defect that each dropper has by chance."""

    type: Literal["chance"] = Field(description="kind of distribution")
    probability: float = Field(gt=0, lt=1, description="of the defect, at each dropper")
    defect: Literal["missing_dropper", "loose_clamp"] = Field(
        "missing_dropper", description="type of the defect"
    )


ContinuousTable = NormalTable | LognormalTable | UniformTable | TruncatedNormalTable
DistributionTable = ContinuousTable | ChoicesTable | SeedTable


def _check_bounds(least: float, most: float) -> None:
    if most <= least:
        raise ValueError(f"must have most greater than least, but they are {most:g} and {least:g}")


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


def takes_mean(table: DistributionTable) -> bool:
    """Whether the mean of a distribution is left to the scene."""
    known = NormalTable | LognormalTable | TruncatedNormalTable
    return isinstance(table, known) and table.mean is None


def inverse(
    table: ContinuousTable, mean: float | None = None
) -> Callable[[np.ndarray], np.ndarray]:
    """The inverse distribution function: from probabilities in (0, 1) to values of the key.

    Parameters
    ----------
    table : the distribution
    mean : stands for a mean that the table leaves out

    Raises
    ------
    ValueError
        With a predicate, if a lognormal quantity has no positive mean or is too wide, or if bounds
        are too far from the mean; of the function, if its values are not finite.
    """
    from scipy import stats

    if isinstance(table, UniformTable):
        frozen = stats.uniform(table.least, table.most - table.least)
        return _function(frozen)
    centre = mean if table.mean is None else table.mean
    assert centre is not None
    deviation = table.standard_deviation
    if isinstance(table, NormalTable):
        return _function(stats.norm(centre, deviation))
    if isinstance(table, LognormalTable):
        if centre <= 0:
            raise ValueError(f"must have a mean above 0, but it is {centre:g}")
        if deviation > _WIDEST * centre:
            raise ValueError(
                f"must have a standard_deviation of at most {_WIDEST:g} times the mean, but they "
                f"are {deviation:g} and {centre:g}"
            )
        # Mean m and standard deviation s of the quantity: sigma^2 = ln(1 + s^2/m^2) and
        # mu = ln m - sigma^2/2 of its logarithm (Johnson, Kotz, Balakrishnan, vol. 1, ch. 14).
        variance = math.log1p((deviation / centre) ** 2)
        median = math.exp(math.log(centre) - variance / 2)
        return _function(stats.lognorm(math.sqrt(variance), scale=median))
    low = -math.inf if table.least is None else (table.least - centre) / deviation
    high = math.inf if table.most is None else (table.most - centre) / deviation
    if low > _FARTHEST or high < -_FARTHEST:
        raise ValueError(
            f"must have bounds within {_FARTHEST:g} standard deviations of the mean {centre:g}"
        )
    return _function(stats.truncnorm(low, high, centre, deviation))


def _function(frozen: Any) -> Callable[[np.ndarray], np.ndarray]:
    """The inverse function of SciPy's distribution; ValueError where its numbers are not finite."""

    def values(probabilities: np.ndarray) -> np.ndarray:
        with np.errstate(all="ignore"):
            found = np.asarray(frozen.ppf(probabilities))
        if not np.isfinite(found).all():
            raise ValueError("gives numbers that are not finite")
        return found

    return values


def chosen(table: ChoicesTable, probabilities: np.ndarray) -> list[int]:
    """Number of the value, from 0, for each of ``probabilities`` in (0, 1), by the weights of the
    values of a ``table``."""

    weights = np.ones(len(table.values)) if table.weights is None else np.array(table.weights)
    ends = np.cumsum(weights) / weights.sum()
    last = int(np.flatnonzero(weights)[-1])  # where rounding leaves the sum below 1
    numbers = np.searchsorted(ends, probabilities, side="right")
    return [int(number) for number in np.minimum(numbers, last)]


def seeds(probabilities: np.ndarray) -> list[int]:
    """A whole number below ``N_SEEDS`` for each probability in (0, 1)."""
    return [int(number) for number in probabilities * N_SEEDS]
