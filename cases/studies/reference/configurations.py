"""Configurations of the reference solutions: a model at a speed under one or two pantographs."""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from catenary.base.errors import InputError
from catenary.cases.scene.keys.keys import meant
from catenary.cases.scene.load import load_scene
from catenary.cases.scene.scene import Scene

ONE, TWO = "one", "two"
# Nothing but channels of the train is recorded; extremes of the line are kept of every step.
RECORDED = ("output.field_every_s=0", "output.energy_every_s=0", "output.line_channels=[]")


@dataclass(frozen=True)
class Configuration:
    """A model, a speed and a train.

    Attributes
    ----------
    name : of its files, such as ``ac_simple_275_one``
    model, title : name of the model, and what people call it
    case : the shipped case that has its inputs
    speed : of the train [km/h]
    train : ONE pantograph, or TWO 200 m apart
    assignments : ``key=value`` each, that make it of the case
    data : where the inputs come from, and which of them are ours
    steps : time steps [ms], finest first
    elements : elements between neighbouring droppers, finest first
    grading : how many times longer elements are midway between droppers than beside them
    """

    name: str
    model: str
    title: str
    case: str
    speed: float
    train: str
    assignments: tuple[str, ...]
    data: str
    steps: tuple[float, ...]
    elements: tuple[int, ...]
    grading: float

    @property
    def words(self) -> str:
        """Model, speed and train in words."""
        pantographs = "one pantograph" if self.train == ONE else "two pantographs"
        return f"{self.title}, {self.speed:g} km/h, {pantographs}"

    def scene(self, *further: str) -> Scene:
        """The scene, with further assignments. Not collective."""
        return load_scene(self.case, [*self.assignments, *RECORDED, *further])


@functools.cache
def table() -> dict[str, Any]:
    """Models and levels as ``models.toml`` has them. Not collective."""
    return tomllib.loads(Path(__file__).with_name("models.toml").read_text(encoding="utf-8"))


def configurations(names: Sequence[str] = ()) -> list[Configuration]:
    """All configurations, or those of the given names of models or configurations.

    Raises
    ------
    InputError
        If there is none of a name.
    """
    every = list(_every())
    known = [*(one.name for one in every), *dict.fromkeys(one.model for one in every)]
    for name in names:
        if name not in known:
            raise InputError(f"{name} is no reference model or configuration: {meant(name, known)}")
    return [one for one in every if not names or {one.name, one.model} & set(names)]


def _every() -> Iterator[Configuration]:
    levels, meshes = table()["levels"], table()["meshes"]
    for model in table()["models"]:
        for speed in model["speeds_km_h"]:
            for train in (ONE, TWO):
                name = f"{model['name']}_{speed:g}_{train}"
                mesh = {"grading": 1.0, **levels, **meshes.get(name, {})}
                yield Configuration(
                    name,
                    model["name"],
                    model["title"],
                    model["case"],
                    float(speed),
                    train,
                    (f"train.speed_km_h={speed:g}", *(model["pair"] if train == TWO else ())),
                    model["data"],
                    tuple(levels["dt_ms"]),
                    tuple(mesh["elements_per_gap"]),
                    float(mesh["grading"]),
                )
