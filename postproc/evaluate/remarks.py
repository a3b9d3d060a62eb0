"""Remarks of the report: settings of a run that decide its results."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from catenary.postproc.evaluate.error_indicators import Indicators
from catenary.postproc.evaluate.filters import CUT_OFF
from catenary.postproc.evaluate.statistics import (
    lateral_ranges,
    left_strips_sentence,
    slackens_at_all,
)
from catenary.postproc.evaluate.wording import counted, stiffness_words
from catenary.postproc.read.results import Results
from catenary.solver.effects.shipped.line_effects import STIFF
from catenary.solver.problem.watched_links import HIGH_STOP, LOW_STOP

# Share of a gust's load that linear drag may leave out.
_LEFT_OUT = 0.15
# Statistics are taken below 20 Hz; a resonance below twice that still shows in them.
_FELT_HZ = 40.0
# Phase of the contact's own motion in a step beyond which its hops are not resolved [rad].
_RESOLVED = 0.5
_SIDES = ("start", "end")


def all_remarks(results: Results, indicators: Indicators) -> list[str]:
    """Sentences about everything that decides the results of a run numerically. Not collective.

    Summary, terminal, report, comparisons and studies all tell these.

    Parameters
    ----------
    results : Results
        Results of the run.
    indicators : Indicators
        Estimated errors of the run.
    """
    watched: list[str] = results.attributes.get("watched", {}).get("remarks", [])
    arms = results.registration()
    pushed = [] if arms is None else arms.warnings()
    return [*indicators.warnings, *watched, *pushed, *remarks(results)]


def remarks(results: Results) -> list[str]:
    """Sentences about settings that shape the results, none if none do. Not collective.

    Files of earlier formats lack the facts that some of them need, and have fewer.
    """
    return [
        *_about_excitation(results),
        *results.attributes.get("arrivals", {}).get("warnings", []),
        *(left_strips_sentence(p) for p in lateral_ranges(results) if p.left),
        *_about_incidents(results),
        *_about_contact(results),
        *_about_droppers(results),
        *_about_ends(results),
        *_about_stops(results),
        *_about_iterations(results),
        *_about_gusts(results),
    ]


def _about_excitation(results: Results) -> Iterator[str]:
    """Remark on a run without a train, of which nothing is judged."""
    facts = results.attributes.get("excitation")
    if facts:
        yield (
            f"The line is excited by {facts['says']}, without a train: nothing is judged, and "
            "contact forces are zero."
        )


def _about_iterations(results: Results) -> Iterator[str]:
    """Remarks on steps above the tolerances: where the scene has a fixed number of iterations, and
    where steps were the shortest."""
    steps = results.attributes.get("inner_iterations", {})
    above, fixed = steps.get("unconverged_steps", 0), results.fact("fixed_iterations")
    if above and not math.isnan(fixed):
        yield (
            f"{above} of {steps['steps']} steps ended above the tolerances of the fixed-point "
            f"correction, because numerics.iterations = {fixed:g} ends each: their forces and "
            "motions are not consistent. Take more iterations, or leave the key out."
        )
    above = steps.get("steps_above_tolerance", 0)
    if above:
        yield (
            f"{above} of {steps['steps']} steps were taken with an estimated error of the contact "
            f"force above numerics.adaptive_tolerance_N = {results.fact('step_tolerance'):g}, "
            "being the shortest: take a smaller numerics.smallest_dt_s, or a larger tolerance."
        )


def _about_gusts(results: Results) -> Iterator[str]:
    """Remark on strong gusts, much of whose load linear drag leaves out."""
    gust = results.fact("strongest_gust")
    left_out = (gust / (1.0 + gust)) ** 2
    if gust > 0.0 and left_out >= _LEFT_OUT:  # not of NaN either
        yield (
            f"Gusts reach {gust:.2g} times the mean wind, about which their drag is linear: in "
            f"those {1e2 * left_out:.0f} % of the load on a wire are left out. Take wind.drag = "
            '"quadratic".'
        )


def _about_incidents(results: Results) -> Iterator[str]:
    """Incidents after which a pantograph is still within the evaluated stretch."""
    found = results.attributes.get("incidents", [])
    if not found:
        return
    start, end = results.evaluation
    last = -1.0
    for part, position in results.blocks("contact_position"):
        evaluated = ((position >= start) & (position <= end)).any(axis=1)
        if evaluated.any():
            last = results.time_at(part.start + int(np.flatnonzero(evaluated)[-1]))
    for fact in found:
        if fact["time_s"] < last:
            yield (
                f"At {fact['time_s']:.4g} s {fact['says']}. The statistics of the evaluated "
                "stretch include its consequences: they do not describe an intact line under "
                "intact pantographs."
            )


def _about_droppers(results: Results) -> Iterator[str]:
    """Remark on droppers that are stiff for the step, and the remedy."""
    stiffness, dt = results.fact("stiffest_dropper"), results.dt
    # Not of NaN either.
    if not stiffness * dt**2 > STIFF:
        return
    begin = f"Droppers of {stiffness_words(stiffness)} are stiff for a step of {1e3 * dt:g} ms"
    longest = f"a numerics.dt_s of {1e3 * math.sqrt(STIFF / stiffness):.2g} ms at most"
    added = results.fact("added_dropper_damping")
    if added > 0.0:
        yield (
            f"{begin}: numerical damping of alpha = {1e3 * added:.3g} ms in them "
            "(effects.stiff_link_damping) keeps their switches from making energy, and softens the "
            f"forces of a few steps. Take {longest} to do without."
        )
    elif not results.fact("dropper_stiffness_damping") >= dt:
        yield (
            f"{begin}: when they slacken and tighten they give the line energy that it did not "
            f"have. Take {longest}, or leave effects.stiff_link_damping on."
        )


def _about_ends(results: Results) -> Iterator[str]:
    """Remark on slack droppers in the span before a periodic end, beyond which none slacken."""
    periodic = [side for side in _SIDES if results.fact(f"periodic_{side}") == 1.0]
    if not periodic or not slackens_at_all(results):
        return
    masts, x = results.line("support_x"), results.line("dropper_x")
    lowest, (first, last) = results.extremes("dropper_force")[0], results.evaluation
    for side in periodic:
        low, high = masts[:2] if side == "start" else masts[-2:]
        slack = int(np.count_nonzero((x > low) & (x < high) & (lowest <= 0.0)))
        if slack and first < high and last > low:
            inner = f"to_m of {low:g} at most" if side == "end" else f"from_m of {high:g} at least"
            yield (
                f"{counted(slack, 'dropper')} of the span at the periodic {side} of the line "
                "slackened, which is part of the evaluated stretch; those beyond do not slacken, "
                "and near the end the force is not that of a longer line: take an evaluation."
                f"{inner}, or a larger line.n_spans."
            )


def _about_stops(results: Results) -> Iterator[str]:
    """Remark on tensioners at their stops, at rest or under way."""
    low, high = (results.extremes(name)[1] for name in (LOW_STOP, HIGH_STOP))
    force = np.maximum(low, high)
    stopped = np.flatnonzero(force > 0.0)  # not where it is not known, NaN
    if stopped.size:
        most = stopped[np.argmax(force[stopped])]
        yield (
            f"{counted(stopped.size, 'tensioner')} met a stop, the one at "
            f"{results.line('end_x')[most]:g} m with {1e-3 * force[most]:.3g} kN the most: its "
            "wire does not have the tension of its weights. `catenary static` prints tensions at "
            "rest; take a larger line.tensioner.travel_m, or a shorter section."
        )


def _about_contact(results: Results) -> Iterator[str]:
    stiffnesses = results.facts_of("contact_stiffness")
    if np.isinf(stiffnesses).any():
        yield "The contact is kinematic: head and wire do not part, so that loss cannot occur."
        return
    masses, step = results.facts_of("touching_mass"), results.fact("shortest_step")
    yield from dict.fromkeys(
        sentence
        for mass, stiffness in zip(masses.tolist(), stiffnesses.tolist(), strict=True)
        # Without a train nothing touches the line.
        if math.isfinite(mass) and math.isfinite(stiffness) and stiffness > 0.0
        for sentence in _about_head(mass, stiffness, step)
    )


def _about_head(mass: float, stiffness: float, dt: float) -> Iterator[str]:
    """Remarks on a head of a mass [kg] on its contact [N/m] at a step [s]."""
    contact, omega = stiffness_words(float(f"{stiffness:.3g}")), math.sqrt(stiffness / mass)
    frequency = omega / (2.0 * math.pi)
    begin = (
        f"A head of {mass:.3g} kg on a contact of {contact} has a resonance at {frequency:.3g} Hz"
    )
    if frequency < _FELT_HZ:
        where = "inside" if frequency < CUT_OFF else "near"
        yield (
            f"{begin}, {where} the 20 Hz band: results depend on the "
            "stiffness of the contact. Compare them only with results of the same stiffness."
        )
    if omega * dt > _RESOLVED:
        yield (
            f"{begin}: a step of {1e3 * dt:g} ms does not resolve its hops. If the head loses "
            "contact they feed the line, with forces several times too large, and the loss of "
            "contact counts steps, not losses. Take a smaller numerics.dt_s, a contact that damps, "
            "or numerics.newmark_gamma = 0.6 with newmark_beta = 0.3025."
        )
