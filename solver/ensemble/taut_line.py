"""A line whose droppers may be slack at rest, with the matrices of one whose droppers are all taut.

Droppers that are slack at rest in some scenes are taut in the matrices, as those that slacken under
way: displacements are counted from the shape that the line would have if droppers could push, where
matrices hold without compensations, and the line starts displaced from there.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from catenary.solver.effects.all_effects import needs_form
from catenary.solver.effects.build_model import build
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.model.switching_links import LinkTable, switching_links
from catenary.solver.statics.changed_line.rest_nearby import StiffLine
from catenary.solver.statics.line_at_rest import LineAtRest


class TautLine(NamedTuple):
    """A line at rest, counted from the shape that it would have if droppers could push.

    Attributes
    ----------
    rest : the model of the line at rest, whose droppers may be slack
    model, form : with all droppers taut, in the shape from which displacements count
    moved : (n_dofs,) of the line at rest from there [m], [rad]
    links : its links whose state is followed
    """

    rest: Model
    model: Model
    form: Equilibrium
    moved: np.ndarray
    links: LinkTable


class TautLines:
    """Makes taut lines, which share a stiffness; keeps the latest."""

    def __init__(self) -> None:
        self._stiff: StiffLine | None = None
        self._latest: TautLine | None = None

    def of(self, at_rest: LineAtRest) -> TautLine:
        """The taut line of one at rest, that itself if nothing is slack or matrices depend on its
        shape. Not collective."""
        model, form = at_rest.model, at_rest.form
        if self._latest is None or self._latest.rest is not model:
            taut, moved = model, np.zeros(model.n_dofs)
            if model.dropper_gap.any() and not (model.droppers_bend or needs_form(model.problem)):
                taut = build(
                    model.problem,
                    model.mesh,
                    model.dropper_lengths,
                    model.broken,
                    form,
                    cut_lengths=model.cut_lengths,
                )
                if self._stiff is None:  # of a line with other matrices no lane takes the result
                    self._stiff = StiffLine(taut)
                moved, form = _displaced(taut, model.dropper_gap, form, self._stiff)
            links = switching_links(taut, form.dropper_force)
            self._latest = TautLine(model, taut, form, moved, links)
        return self._latest


def _displaced(
    taut: Model, gap: np.ndarray, form: Equilibrium, stiff: StiffLine
) -> tuple[np.ndarray, Equilibrium]:
    """How far a rest (``form``) is from the taut shape, and that shape.

    Droppers that lack ``gap`` [m] of being taut push the taut line up by what they release.
    """
    assert taut.droppers is not None
    unknowns, weights = taut.droppers.direction
    lacks = taut.dropper_stiffness * gap
    load, released = np.zeros(taut.n_dofs), 1.0 - taut.simulated.kept_ratio
    np.add.at(load, unknowns, -released * lacks[:, None] * weights)
    load[taut.constrained] = 0.0
    moved = stiff.moved(load)
    stretch = (weights * moved[unknowns]).sum(axis=1)
    every = np.arange(taut.mesh.n_nodes)
    force = np.where(gap > 0.0, -lacks, form.dropper_force)
    return moved, replace(
        form,
        height=form.height - moved[taut.dofs(every)],
        slope=form.slope - moved[taut.dofs(every, "theta_y")],
        dropper_force=force - taut.dropper_stiffness * stretch,
    )
