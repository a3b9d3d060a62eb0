"""The task of a study of tolerances: what FILE.toml may hold."""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from catenary.cases.scene.keys.table import Table
from catenary.cases.scene.line.imperfections import Seed, WireName
from catenary.cases.studies.scene_sets import BoundTable, SetTable, refuse_contradictions

Label = Annotated[str, Field(min_length=1, max_length=100)]


class ErrorTable(Table):
    """An error of the installation that may be as large as its tolerance, up and down."""

    name: Label = Field(description="what people call it")
    level: float = Field(
        gt=0, description="tolerance from which all together are scaled, in the error's unit"
    )
    most: float = Field(gt=0, description="greatest tolerance that is looked at, in the same unit")
    distribution: Literal["uniform", "normal"] = Field(
        "uniform",
        description="errors evenly within the tolerance, or normal ones with half of it as "
        "standard deviation, cut off at the tolerance",
    )


class DropperErrors(ErrorTable):
    """Each dropper is cut too long or too short [mm]."""

    kind: Literal["dropper_lengths"] = Field(description="kind of error")


class HeightErrors(ErrorTable):
    """The contact wire hangs too high or too low at each support, droppers are cut for it [mm]."""

    kind: Literal["contact_wire_height"] = Field(description="kind of error")


class TensionErrors(ErrorTable):
    """Wires have another tension than the one for which droppers were cut [%]."""

    kind: Literal["tension"] = Field(description="kind of error")
    wires: list[WireName] = Field(
        ["contact_wire", "messenger_wire"],
        min_length=1,
        max_length=20,
        description="names of the wires, each with an error of its own",
    )


class KeyErrors(ErrorTable):
    """A number of the scene is another one, for which droppers are cut [unit of the key]."""

    kind: Literal["key"] = Field(description="kind of error")
    key: str = Field(min_length=1, max_length=200, description="dotted key of the scene")
    entry: Annotated[int, Field(ge=1, le=10_000)] | None = Field(
        None, description="of a list, the number of its entry, from 1"
    )


ErrorKind = Annotated[
    DropperErrors | HeightErrors | TensionErrors | KeyErrors, Field(discriminator="kind")
]


class SamplesTable(Table):
    """Search for tolerances."""

    probability: float = Field(
        0.99, gt=0.5, lt=1, description="share of the installed lines that keep a criterion"
    )
    confidence: float = Field(
        0.95, ge=0.5, lt=1, description="with which the samples show that share"
    )
    number: int | None = Field(
        None,
        ge=2,
        le=100_000,
        description="random lines at each level; if absent the fewest that show the share if all "
        "keep the criterion, 299 for 99 % at 95 % confidence",
    )
    seed: Seed = Field(1, description="of the errors, the same at all levels")
    resolution: float = Field(
        0.04, gt=0.001, le=0.5, description="of a tolerance, as a share of the greatest"
    )
    worst_case: bool = Field(
        True, description="also the worst case, by slopes of all errors near the evaluated stretch"
    )

    @model_validator(mode="after")
    def _enough(self) -> SamplesTable:
        if self.number is not None and self.number < self.fewest:
            raise ValueError(
                f"must have number = {self.fewest} at least, which show "
                f"{100 * self.probability:g} % at {100 * self.confidence:g} % confidence if none "
                f"fails, but has {self.number}"
            )
        return self

    @property
    def fewest(self) -> int:
        """Samples that show the share if none fails: p^n is at most 1 - confidence."""
        return max(2, math.ceil(math.log(1.0 - self.confidence) / math.log(self.probability)))

    @property
    def n(self) -> int:
        """Number of random lines."""
        return self.number or self.fewest

    @property
    def allowed(self) -> int:
        """Number of samples that may fail: the most whose lower bound of Clopper and Pearson is
        not below the share."""
        from scipy.stats import binom

        failures = np.arange(self.n)
        shown = binom.cdf(failures, self.n, 1.0 - self.probability) <= 1.0 - self.confidence
        return int(np.count_nonzero(shown)) - 1


class ToleranceTask(Table):
    """Errors, criteria and the scenes over which these must be kept."""

    set: SetTable = Field(default_factory=SetTable, description="the scenes")
    errors: list[ErrorKind] = Field(min_length=1, max_length=20, description="what may be off")
    criteria: list[BoundTable] = Field(
        default_factory=list,
        max_length=50,
        description="what every run must keep; the acceptance criteria of the case if absent",
    )
    samples: SamplesTable = Field(default_factory=SamplesTable, description="the samples")

    @model_validator(mode="after")
    def _differ(self) -> ToleranceTask:
        names = [one.name for one in self.errors]
        if len(set(names)) < len(names):
            raise ValueError("must give each of the errors a name of its own")
        refuse_contradictions(self.criteria, "criteria")
        return self
