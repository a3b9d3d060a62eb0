"""Distance between two pantographs: their statistics over it, best and worst, and what fails.

The trailing pantograph starts at ``train.start_m`` at every distance, so that it runs the same way;
the leading one is that far ahead. One pantograph alone is marched beside them, for reference.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import floor
from pathlib import Path
from typing import Any, NamedTuple

from catenary.base.errors import InputError
from catenary.cases.scene.load import Draft
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.questions.marching import Marching
from catenary.cases.studies.sweep.jobs import Ended, RunOptions
from catenary.cases.studies.sweep.output import failed_criteria
from catenary.cases.studies.sweep.variants import Variant, text_of

# Most distances of a study, and the bounds of a distance [m].
MOST, _LEAST, _FARTHEST = 2000, 1.0, 1000.0
DISTANCE = "separation_m"


class Distances(NamedTuple):
    """Which distances are marched: ``nearest``, ``farthest`` and ``step`` between them, all [m]."""

    nearest: float = 31.0
    farthest: float = 400.0
    step: float = 1.0

    def values(self) -> list[float]:
        """The distances, ascending.

        Raises
        ------
        InputError
            If the range is none, or the division too fine.
        """
        if not _LEAST <= self.nearest < self.farthest <= _FARTHEST:
            raise InputError(
                f"--from {self.nearest:g} --to {self.farthest:g} is no range of distances: give "
                f"two ascending ones from {_LEAST:g} to {_FARTHEST:g} m"
            )
        if not self.step > 0.0:
            raise InputError(f"--step {self.step:g} is not possible: it is above 0 m")
        length = self.farthest - self.nearest
        if length / self.step > MOST:
            raise InputError(f"--step {self.step:g} makes more than {MOST} distances")
        count = floor(length / self.step + 1e-9) + 1
        return [round(self.nearest + number * self.step, 4) for number in range(count)]


class Pair(NamedTuple):
    """Statistics at a distance, or of one pantograph alone; None where it could not be run.

    Attributes
    ----------
    separation : [m], None of one alone
    outcome : "done", or the sentence of what is wrong
    std, least : of the leading and trailing pantograph; of one alone a single value [N]
    uplift : largest at steady arms, of both passages [mm]
    loss : loss of contact of both [%]
    failed : acceptance criteria that fail
    remarks : what decides the results
    """

    separation: float | None
    outcome: str
    std: tuple[float | None, ...]
    least: tuple[float | None, ...]
    loss: tuple[float | None, ...]
    uplift: float | None
    failed: tuple[str, ...]
    remarks: tuple[str, ...]


class SeparationStudy(NamedTuple):
    """What a study of distances found.

    Attributes
    ----------
    case, kind, speed : names of case and pantograph, train speed [km/h]
    alone : one pantograph
    pairs : ascending in distance
    """

    case: str
    kind: str
    speed: float
    alone: Pair
    pairs: tuple[Pair, ...]

    @property
    def done(self) -> list[Pair]:
        """The distances that could be run."""
        return [pair for pair in self.pairs if pair.outcome == "done"]

    def best(self) -> Pair | None:
        """The pair whose larger deviation is least; None if no deviation is known."""
        return min(self._known, key=_larger, default=None)

    def worst(self) -> Pair | None:
        """The pair whose larger deviation is largest; None if no deviation is known."""
        return max(self._known, key=_larger, default=None)

    @property
    def _known(self) -> list[Pair]:
        return [pair for pair in self.done if None not in pair.std]


def _larger(pair: Pair) -> float:
    return max(value for value in pair.std if value is not None)


def find_separations(
    draft: Draft,
    scene: Scene,
    overrides: Sequence[str],
    distances: Distances,
    out: Path | None,
    comm: Any,
    options: RunOptions,
) -> SeparationStudy:
    """March one pantograph alone and two at each distance. Collective.

    Parameters
    ----------
    scene : the checked one of draft and overrides; all pantographs are of the kind of its first
    out : folder that keeps what is marched, so that the same call continues; None to keep nothing

    Raises
    ------
    InputError
        If the range is none, or if nothing can be run.
    Interrupted
        If a signal came.
    """
    values = distances.values()
    kind = scene.train.pantographs[0].name
    marching = Marching(draft, overrides, out, comm, options)
    ended = marching.of([_variant(scene, kind, value) for value in (None, *values)])
    found = [_pair(*both) for both in zip((None, *values), ended, strict=True)]
    return SeparationStudy(
        scene.case.name, kind, scene.train.speed_km_h, found[0], tuple(found[1:])
    )


def _variant(scene: Scene, kind: str, separation: float | None) -> Variant:
    if separation is None:
        train = text_of([{"name": kind}])
        return Variant("alone", (f"train.pantographs={train}",))
    train = text_of([{"name": kind}, {"name": kind, "behind_m": separation}])
    ahead = [f"train.start_m={scene.train.start_m + separation:.10g}"]
    if scene.train.end_m is not None:  # of the leading one, too
        ahead.append(f"train.end_m={scene.train.end_m + separation:.10g}")
    return Variant(f"{separation:g}m", (*ahead, f"train.pantographs={train}"))


def _pair(separation: float | None, one: Ended) -> Pair:
    rows = one.summary.get("pantographs", [])
    return Pair(
        separation,
        one.outcome,
        tuple(row["std_N"] for row in rows),
        tuple(row["min_N"] for row in rows),
        tuple(row["loss_percent"] for row in rows),
        one.summary.get("supports", {}).get("max_uplift_mm"),
        tuple(failed_criteria(one.summary)),
        tuple(one.remarks),
    )
