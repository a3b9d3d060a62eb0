"""Tension along the wires at rest, and where their ends have moved: over temperatures too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.mesh import LineMesh
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.model.wire_ends import WireEnd, ends_of
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.form_finding.equilibrium import find_form


@dataclass(frozen=True)
class WireAtRest:
    """A wire at a temperature.

    Attributes
    ----------
    name : of the wire
    x : (n_elements,) middle of each element [m]
    tension : (n_elements,) [N]
    installed : (n_elements,) at the installation [N]
    ends : its ends that no clamp carries
    moved : (n_ends,) how far each has moved outwards since the installation [m]
    at_ends : (n_ends,) share by which the tension there is another one than at the installation
    """

    name: str
    x: np.ndarray
    tension: np.ndarray
    installed: np.ndarray
    ends: tuple[WireEnd, ...]
    moved: np.ndarray
    at_ends: np.ndarray

    @property
    def change(self) -> np.ndarray:
        """(n_elements,) share by which the tension is another one than at the installation."""
        return self.tension / self.installed - 1.0

    @property
    def along(self) -> float:
        """Change of the tension along the wire, as a share, tensioners aside."""
        return float(np.ptp(self.change))

    @property
    def at_tensioners(self) -> float:
        """Largest share by which a tensioner lets the tension change."""
        own = [abs(v) for v, end in zip(self.at_ends, self.ends, strict=True) if end.tensioned]
        return max(own, default=0.0)

    @property
    def largest(self) -> float:
        """Largest share by which the tension is another one anywhere."""
        return float(np.abs(self.change).max())


@dataclass(frozen=True)
class LineAtTemperature:
    """A line at ``warmer`` [K] above its installation: its ``wires``, and why there is no
    rest, "" if there is one."""

    warmer: float
    wires: tuple[WireAtRest, ...]
    why_not: str = ""


def tension_along(model: Model, form: Equilibrium) -> tuple[WireAtRest, ...]:
    """The wires of a line at rest whose effects let them move along the track."""
    every, found = ends_of(model), []
    for wire in model.problem.line.wires:
        pairs = model.mesh.elements(wire.name)
        x = model.mesh.x(pairs).mean(axis=1)
        installed = wire.tension_at(x)
        tension = installed + form.gained_tension.get(wire.name, np.zeros(x.size))
        ends = tuple(end for end in every if end.wire == wire.name)
        moved, share = np.zeros(len(ends)), np.zeros(len(ends))
        for i, end in enumerate(ends):
            element = int(np.flatnonzero((pairs == end.node).any(axis=1))[0])
            share[i] = tension[element] / installed[element] - 1.0
            if form.along.size:
                moved[i] = end.outwards * form.along[end.node]
        found.append(WireAtRest(wire.name, x, tension, installed, ends, moved, share))
    return tuple(found)


def over_temperatures(
    problem: Problem, mesh: LineMesh, differences: Sequence[float]
) -> list[LineAtTemperature]:
    """The line at rest at differences from the temperature of its installation [K]. Not
    collective."""
    found = []
    for warmer in differences:
        at = replace(problem, along=replace(problem.along, warmer=float(warmer)))
        try:
            model, form = find_form(at, mesh)
        except InputError as error:
            found.append(LineAtTemperature(float(warmer), (), str(error)))
            continue
        found.append(LineAtTemperature(float(warmer), tension_along(model, form)))
    return found
