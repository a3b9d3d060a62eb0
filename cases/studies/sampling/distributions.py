"""Distributions of uncertain keys: their tables, and their inverse functions by SciPy."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, model_validator

from catenary.cases.scene.keys.table import Table

if TYPE_CHECKING:
    import numpy as np

_Number = Annotated[float, Field(ge=-1e15, le=1e15)]
_Positive = Annotated[float, Field(gt=0, le=1e15)]
# Seeds of a scene are smaller; so are the numbers of realisations.
N_SEEDS = 2**31 - 1
_FARTHEST = 8.0  # standard deviations, beyond which is less than 1e-15 of a normal quantity
_WIDEST = 100.0  # standard deviations of lognormal quantities over their means


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
    import numpy as np

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
    import numpy as np

    weights = np.ones(len(table.values)) if table.weights is None else np.array(table.weights)
    ends = np.cumsum(weights) / weights.sum()
    last = int(np.flatnonzero(weights)[-1])  # where rounding leaves the sum below 1
    numbers = np.searchsorted(ends, probabilities, side="right")
    return [int(number) for number in np.minimum(numbers, last)]


def seeds(probabilities: np.ndarray) -> list[int]:
    """A whole number below ``N_SEEDS`` for each probability in (0, 1)."""
    return [int(number) for number in probabilities * N_SEEDS]
