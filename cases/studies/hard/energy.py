"""Energy that leaves a line at its incidents, by what is known of dropper and wire alone.

A dropper takes along the T^2 / 2k that its tension T at that time has stored. A wire whose tension
falls from T to T' gives (T - T') / 2 times the integral of z'^2 to its tensioner, z' being its
slope then, pre-sag and motion included.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from catenary.cases.studies.hard.runs import Watched
from catenary.solver.model.elements.beam import shape_slopes
from catenary.solver.problem.incidents import DropperBreak, LineIncident, in_steps
from catenary.solver.statics.line_at_rest import LineAtRest

# Gauss's rule of three points is exact for the square of a cubic's slope.
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(3)


class Left(NamedTuple):
    """Energy that left in a step [J]: as the balance of the run says, and as theory says."""

    step: int
    observed: float
    expected: float


def energy_that_left(rest: LineAtRest, run: Watched) -> list[Left]:
    """What left at each incident of a run that was watched for it. Not collective."""
    found: list[Left] = []
    shares: dict[str, float] = {}
    seen: Sequence[LineIncident] = ()
    balance = run.energy - run.work
    for happened in in_steps(rest.problem.incidents, rest.problem.numerics.dt):
        force, displacement = run.kept[happened.step]
        new = happened.incidents[len(seen) :]
        expected = sum(_leaves(rest, incident, shares, force, displacement) for incident in new)
        observed = float(balance[happened.step] - balance[happened.step + 1])
        found.append(Left(happened.step, observed, expected))
        seen = happened.incidents
    return found


def _leaves(
    rest: LineAtRest,
    incident: LineIncident,
    shares: dict[str, float],
    force: np.ndarray,
    displacement: np.ndarray,
) -> float:
    mesh, line = rest.model.mesh, rest.problem.line
    if isinstance(incident, DropperBreak):
        number = int(np.argmin(np.abs(mesh.x(mesh.droppers[:, 1]) - incident.x)))
        return float(rest.model.dropper_slopes.energy_under(force)[number])
    before = shares.get(incident.wire, 1.0)
    shares[incident.wire] = incident.share
    dofs, length = rest.model.wire_elements(incident.wire)
    form, pairs = rest.form, mesh.elements(incident.wire)
    at = np.stack([form.height[pairs], form.slope[pairs]], axis=2)
    shape = at.reshape(-1, 4) + displacement[dofs]
    total = 0.0
    for values, h in zip(shape, length, strict=True):
        slopes = [shape_slopes(0.5 * (1.0 + point), h) @ values for point in _POINTS]
        total += 0.5 * h * float(_WEIGHTS @ np.square(slopes))
    return 0.5 * (before - incident.share) * line.wire(incident.wire).tension * total
