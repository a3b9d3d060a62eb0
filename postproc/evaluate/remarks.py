"""Remarks of the report: what a run's own settings decide, and a reader should know."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from catenary.postproc.read.results import Results
from catenary.solver.problem.problem import n_halvings

# Statistics are taken below 20 Hz; a resonance below twice that still shows in them.
_FELT_HZ = 40.0
# Phase of the contact's own motion in a step beyond which its hops are not resolved [rad].
_RESOLVED = 0.5
# Stiffness of droppers times the step squared [N s2/m] from which their switches feed the line: see
# docs/hard_cases.md.
_STIFF_DROPPER = 10.0


class _Contact(NamedTuple):
    """A head on its contact: mass [kg], stiffness [N/m], step [s]."""

    mass: float
    stiffness: float
    dt: float

    @property
    def omega(self) -> float:
        return math.sqrt(self.stiffness / self.mass)

    @property
    def frequency(self) -> float:
        return self.omega / (2.0 * math.pi)


def remarks(results: Results) -> list[str]:
    """Sentences about settings that shape the results, none if none do. Not collective."""
    config = results.attributes["config"]
    return [
        *results.attributes.get("arrivals", {}).get("warnings", []),
        *_about_incidents(results),
        *_about_contact(results, config),
        *_about_droppers(config),
        *_about_iterations(results, config),
        *_about_sizes(results, config),
    ]


def _about_iterations(results: Results, config: dict[str, Any]) -> list[str]:
    """That steps went on above the tolerances, where the scene has a fixed number of iterations."""
    counted = results.attributes.get("inner_iterations", {})
    above, fixed = counted.get("unconverged_steps", 0), config["numerics"].get("iterations")
    if not above or not fixed:
        return []
    return [
        f"{above} of {counted['steps']} steps ended above the tolerances of the fixed-point "
        f"correction, because numerics.iterations = {fixed} ends each: their forces and motions do "
        "not belong together. Take more, or leave the key out."
    ]


def _about_sizes(results: Results, config: dict[str, Any]) -> list[str]:
    """That steps could not be made as short as their estimated error asks for."""
    numerics = config["numerics"]
    counted = results.attributes.get("inner_iterations", {})
    above = counted.get("steps_above_tolerance", 0)
    if not above:
        return []
    return [
        f"{above} of {counted['steps']} steps were taken with an estimated error of the contact "
        f"force above numerics.adaptive_tolerance_N = {numerics['adaptive_tolerance_N']:g}, being "
        "the shortest: take a smaller numerics.smallest_dt_s, or a larger tolerance."
    ]


def _about_incidents(results: Results) -> list[str]:
    """Incidents after which a pantograph is still within the evaluated stretch."""
    found = results.attributes.get("incidents", [])
    if not found:
        return []
    start, end = results.evaluation
    last = -1.0
    for part, position in results.blocks("contact_position"):
        evaluated = ((position >= start) & (position <= end)).any(axis=1)
        if evaluated.any():
            last = results.time_at(part.start + int(np.flatnonzero(evaluated)[-1]))
    return [
        f"At {fact['time_s']:.4g} s {fact['says']}. The statistics of the evaluated stretch cover "
        "what comes of it: they are not those of a sound line under sound pantographs."
        for fact in found
        if fact["time_s"] < last
    ]


def _about_droppers(config: dict[str, Any]) -> list[str]:
    dropper = config.get("line", {}).get("dropper", {})
    stiffness, dt = dropper.get("stiffness_N_per_m"), config["numerics"]["dt_s"]
    if not stiffness or stiffness * dt**2 <= _STIFF_DROPPER:
        return []
    damping = config["line"].get("damping", {})
    own = (damping.get("per_component") or {}).get("droppers") or damping
    if own.get("alpha_s", 0.0) >= dt:
        return []
    longest = math.sqrt(_STIFF_DROPPER / stiffness)
    return [
        f"Droppers of {stiffness:.3g} N/m are stiff for a step of {1e3 * dt:g} ms: when they "
        "slacken and tighten they give the line energy that it did not have. Take a "
        f"numerics.dt_s of {1e3 * longest:.2g} ms at most, or damp droppers by as much as a step: "
        f"line.damping.per_component.droppers with alpha_s = {dt:g}, beta_per_s = 0."
    ]


def _about_contact(results: Results, config: dict[str, Any]) -> list[str]:
    contact = config.get("contact", {})
    if contact.get("law") == "kinematic":
        return ["The contact is kinematic: head and wire do not part, so that loss cannot occur."]
    found: dict[str, None] = {}
    for facts in results.attributes.get("pantographs", []):
        if facts.get("touching_mass_kg"):
            head = _Contact(
                facts["touching_mass_kg"],
                _stiffness(contact, facts["static_force_N"]),
                _step(config["numerics"]),
            )
            found |= dict.fromkeys(_about_head(head))
    return list(found)


def _step(numerics: dict[str, Any]) -> float:
    """The shortest step that a run may take [s]."""
    if not numerics.get("adaptive_tolerance_N"):
        return float(numerics["dt_s"])
    dt: float = numerics["dt_s"]
    return dt / 2 ** n_halvings(dt, numerics.get("smallest_dt_s"))


def _stiffness(contact: dict[str, Any], static_force: float) -> float:
    """Stiffness of the contact, of Hertz's spring its tangent at the static force [N/m]."""
    # Files written before there were laws hold the linear one.
    if contact.get("law", "linear") == "linear":
        return float(contact["stiffness_N_per_m"])
    hertz = contact.get("hertz_stiffness_N_per_m1_5")
    if hertz is None:
        return 1.5 * float(contact["stiffness_N_per_m"])
    return float(1.5 * hertz ** (2 / 3) * static_force ** (1 / 3))


def _about_head(head: _Contact) -> list[str]:
    said = (
        f"A head of {head.mass:.3g} kg on a contact of {head.stiffness:.3g} N/m swings at "
        f"{head.frequency:.3g} Hz"
    )
    result = []
    if head.frequency < _FELT_HZ:
        result.append(
            f"{said}, which the forces below 20 Hz feel: contact.stiffness_N_per_m is part of the "
            "result. Figures of other contact stiffnesses cannot be compared with these."
        )
    if head.omega * head.dt > _RESOLVED:
        result.append(
            f"{said}, of which a step of {1e3 * head.dt:g} ms does not resolve the hops: forces "
            "below 20 Hz hold, but the loss of contact counts steps, not losses. Take a smaller "
            "numerics.dt_s, or a contact that damps."
        )
    return result
