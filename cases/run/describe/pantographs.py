"""Sentences on the train's pantographs: model, static force, actuator force, assembly."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from catenary.cases.scene.scene import Scene
from catenary.mbs.head.strips import Strips
from catenary.mbs.lumped_data import LumpedData
from catenary.postproc.evaluate.wording import counted
from catenary.solver.effects.all_effects import simulated
from catenary.solver.problem.problem import Placement, Problem

if TYPE_CHECKING:
    from catenary.mbs.build import PantographData


def description_of(data: PantographData, static_force: float) -> str:
    """A line about a pantograph."""
    if not isinstance(data, LumpedData):
        from catenary.mbs.mechanism.multibody_pantograph import describe

        return describe(data) + _strips_of(data.strips)
    masses = ", ".join(f"{mass:g}" for mass in data.masses)
    noun = "mass" if len(data.masses) == 1 else "masses"
    text = f"lumped: {len(data.masses)} {noun} of {masses} kg; static force {static_force:.1f} N"
    text += _strips_of(data.strips)
    if data.tied:
        change = f"{1e-3 * data.height_stiffness:.3g} N with each mm that its head rises"
        text += f"; tied to its base: its force falls by {change}"
    return text


def _strips_of(strips: Strips) -> str:
    """Words on strips unless there is one, fixed to the head."""
    if strips.number == 1 and strips.suspension is None:
        return ""
    text = "; 1 strip" if strips.number == 1 else f"; 2 strips {strips.spacing:g} m apart"
    if strips.suspension is None:
        return text
    own, flexure = strips.suspension, strips.flexure
    text += f" of {own.mass:g} kg on {own.stiffness:g} N/m"
    if flexure is None:
        return text
    bends = "bends" if strips.number == 1 else "bend"
    return f"{text}, which {bends} in {counted(flexure.n_modes, 'mode')}"


def _description(placement: Placement, problem: Problem) -> str:
    """A line about a pantograph under way."""
    data, acts = placement.data, simulated(problem)
    if not acts.flexible_strips:
        data = replace(data, strips=replace(data.strips, flexure=None))
    if not acts.pantograph_laws:
        data = replace(data, laws=())
    text = description_of(data, placement.static_force)
    if acts.raked_strips and placement.data.strips.rake:
        text += f"; strips raked by {math.degrees(placement.data.strips.rake):.3g} degrees"
    if acts.pantograph_laws and placement.data.laws:
        n = len(placement.data.laws)
        text += f"; {counted(n, 'law')} not linear"
    if acts.regulated_lift and placement.regulator is not None:
        text += "; regulated lift"
    if not (acts.meets_air and placement.data.meets_air):
        return text
    from catenary.mbs.build import steady_forces

    lifted = steady_forces(placement.data, problem.train.speed).whole
    text += f"; {lifted:+.1f} N by the air at {3.6 * problem.train.speed:.4g} km/h"
    if acts.wind is None:
        return text
    factor = placement.data.crosswind_factor
    if factor == 0.0:
        return f"{text}; a cross wind does not change it (crosswind_factor 0)"
    return (
        f"{text}; {factor:g} of the square of a cross wind adds to that of the air's speed "
        "(crosswind_factor)"
    )


def header_words(scene: Scene, problem: Problem) -> list[dict[str, str]]:
    """Facts on each pantograph for a result file, in running order. Not collective."""
    return [
        {
            "kind": place.name,
            "model": "lumped" if isinstance(placement.data, LumpedData) else "multibody",
            "description": _description(placement, problem),
        }
        for place, placement in zip(scene.train.pantographs, problem.train.placements, strict=True)
    ]


def kind_lines(scene: Scene, problem: Problem) -> dict[str, list[str]]:
    """Lines about each kind of pantograph on the train, by its name. Not collective."""
    lines: dict[str, list[str]] = {}
    for place, placement in zip(scene.train.pantographs, problem.train.placements, strict=True):
        lines[place.name] = [_description(placement, problem)]
        if not isinstance(placement.data, LumpedData):
            from catenary.mbs.mechanism.multibody_pantograph import describe_assembly, stand

            lines[place.name].append(describe_assembly(stand(placement.data).missed))
    return lines
