"""Candidates for why a place of a line is bad, with figures; nearness proves none."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from catenary.cases.studies.questions.worst import Passage, Spot, dropper_likes, spans_in_stretch
from catenary.meshgen.wires import Role
from catenary.postproc.evaluate.wording import wire_words
from catenary.postproc.read.line_of_run import in_stretch
from catenary.postproc.read.results import Results
from catenary.solver.effects.all_effects import simulated
from catenary.solver.statics.elasticity import elasticity
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.wind.drag import upward_pressure
from catenary.solver.wind.wind_at import drag_width, gust_points

# Frequencies so close are near each other, lengths so far apart differ [-].
_NEAR, _LONGER = 0.1, 0.05
# A reflection that keeps less of its amplitude is no candidate [-].
_FELT = 0.01
# Elasticity beyond that of other spans [-], height beyond them [m] and rest force of droppers
# beyond their likes and gusts stronger than on other spans [-] from which on these are candidates.
_SOFTER, _HIGHER, _HEAVIER, _GUSTIER = 0.1, 5e-3, 0.5, 0.1
# Lift under a unit force below which a contact wire is held [m/N].
_ANCHORED = 1e-9
_POINTS = 101  # at which profiles of spans are compared
# Gusts so long before a pantograph comes still move the span, a period of its own motion [s].
_BEFORE = 1.0
_FEWEST = 3


def elasticity_along(rest: LineAtRest, start: float, end: float) -> tuple[np.ndarray, np.ndarray]:
    """Elasticity that a train's head meets along a stretch. Not collective.

    Parameters
    ----------
    rest : the line at rest, with its train
    start, end : of the stretch [m]

    Returns
    -------
    x, lift : (n,) places [m], and how far the largest static force lifts a head above the lowest
        contact wire there, over that force [m/N]; wires that hang higher are not touched by it
    """
    found = elasticity(rest.model, start, end)
    force = max((own.static_force for own in rest.problem.train.placements), default=0.0) or 1.0
    height = np.full(found.of_wires.shape, np.nan)
    for number, wire in enumerate(rest.problem.line.wires_of(Role.CONTACT)):
        nodes = rest.mesh.wires[wire.name]
        height[:, number] = np.interp(found.x, rest.mesh.x(nodes), rest.form.height[nodes])
    height[~np.isfinite(found.of_wires)] = np.nan
    return found.x, (found.pressed(height, force) - np.nanmin(height, axis=1)) / force


def gust_forces(rest: LineAtRest, when: Sequence[tuple[float, float, float, float]]) -> list[float]:
    """Largest upward or downward force of gusts on the wires of stretches [N]. Not collective.

    Parameters
    ----------
    rest : LineAtRest
        Line at rest, with its wind.
    when : sequence of tuple of float
        Start and end of each stretch [m], and from and to of the time that is looked at [s].

    Returns
    -------
    list of float
        Sums over all wires and the length of each stretch; none where no gusts are simulated.
    """
    wind, mesh = simulated(rest.problem).wind, rest.mesh
    if wind is None or wind.gusts is None:
        return []
    x = mesh.points[:, 0]
    points = gust_points(wind.gusts.spacing, float(x.min()), float(x.max()))
    interval, fill = upward_pressure(rest.model, wind, points)
    found = []
    for start, end, begin, stop in when:
        first, last = np.searchsorted(points, (start, end)).tolist()
        low, high = max(round(begin / interval), 0), round(stop / interval)
        slices = np.zeros((high - low + 1, last - first))
        fill(low, slice(first, last), slices)
        area = 0.0
        for wire in rest.problem.line.wires:
            for nodes in mesh.pieces(wire.name):
                ends = np.clip(mesh.x(nodes)[[0, -1]], start, end)
                area += drag_width(wire) * float(ends[1] - ends[0])
        found.append(area * float(np.abs(slices.mean(axis=1)).max()))
    return found


class Causes:
    """Looks for causes in the description of a line in a result file.

    Parameters
    ----------
    results : of the run, open
    passages : of all spans of the evaluated stretch
    rest : the line at rest, for its elasticity and its gusts; None if it is not known
    """

    def __init__(
        self, results: Results, passages: Sequence[Passage], rest: LineAtRest | None
    ) -> None:
        self._results, self._passages, self._rest = results, passages, rest
        self._elasticity = None if rest is None else elasticity_along(rest, *results.evaluation)
        self._masts = results.line("support_x")

    def of_passage(self, passage: Passage) -> list[str]:
        """Sentences on a pantograph in a span, none if there is no candidate."""
        return [
            *self._near(passage.start, passage.end),
            *self._reflections(passage),
            *self._pantograph_ahead(passage),
            *self._length(passage.span),
            *self._elastic(passage.span),
            *self._profile(passage.span),
            *self._droppers_at_rest(passage.start, passage.end),
            *(
                self._gusts(passage.span, passage.pantograph)
                if passage.std > passage.median
                else ()
            ),
        ]

    def at(self, spot: Spot) -> list[str]:
        """Sentences on an arm or a dropper; its own span is looked at."""
        x = spot.x
        span = int(np.clip(np.searchsorted(self._masts, x, "right") - 1, 0, self._masts.size - 2))
        reach = 0.5 * float(self._masts[span + 1] - self._masts[span])
        return [
            *self._near(x - reach, x + reach),
            *self._elastic(span),
            *self._droppers_at_rest(x - reach, x + reach),
            *(self._gusts(span, 0) if spot.value > spot.median else ()),
        ]

    def of_line(self) -> list[str]:
        """Sentences on what acts on all spans alike."""
        candidates = [
            f"known of the line, at no single place: {defect['says']}"
            for defect in self._results.attributes.get("defects", [])
            if "at_m" not in defect
        ]
        speed = self._results.fact("speed")
        wave = self._results.attributes.get("arrivals", {}).get("wave_speed_m_per_s")
        span = float(np.median(np.diff(self._masts)))
        if wave and abs(2.0 * speed / wave - 1.0) <= _NEAR:
            candidates.append(
                f"spans are passed at {speed / span:.2f} Hz, near their lowest natural frequency "
                f"c / 2 L = {wave / (2.0 * span):.2f} Hz"
            )
        if any(name == "gusts" for name, *_ in self._results.attributes.get("effects_on", [])):
            candidates.append(
                "gusts blow; one run does not tell which share of sigma is theirs, catenary "
                "what-if CASE --set effects.gusts=false does"
            )
        return candidates

    def _near(self, start: float, end: float) -> Iterator[str]:
        """Defects and ends of contact wires, up to half a stretch before and behind it."""
        reach = 0.5 * (end - start)
        low, high = start - reach, end + reach
        for defect in self._results.attributes.get("defects", []):
            if "at_m" in defect:
                first = float(defect["at_m"])
                if first <= high and self._defect_end(defect) >= low:
                    yield f"defect: {defect['says']}"
        for name, profile in self._results.contact_profiles().items():
            ends = [profile.x[0], *profile.x[profile.breaks], *profile.x[profile.breaks - 1],
                    profile.x[-1]]  # fmt: skip
            for x in sorted(set(map(float, ends))):
                if low <= x <= high:
                    yield f"{wire_words(name)} begins or ends at {x:.0f} m (overlap, section)"

    def _defect_end(self, defect: dict[str, Any]) -> float:
        """End of a defect along the track [m]: worn wires have a length."""
        at = float(defect["at_m"])
        for table in self._results.attributes.get("config", {}).get("defects", []):
            if table.get("type") == defect["type"] and table.get("from_m") == at:
                return float(table.get("to_m", at))
        return at

    def _reflections(self, passage: Passage) -> Iterator[str]:
        of_pantographs = self._results.attributes.get("arrivals", {}).get("pantographs", [])
        if passage.pantograph >= len(of_pantographs):
            return
        facts = of_pantographs[passage.pantograph]
        length = passage.end - passage.start
        for end in ("far", "near"):
            met, share = facts.get(f"{end}_end_met_at_m"), facts.get(f"{end}_end_share")
            if met is None or not passage.start - length <= met <= passage.end:
                continue
            if share is None or share >= _FELT:
                kept = "" if share is None else f", with up to {100 * share:.2g} % of its amplitude"
                yield f"the reflection from the {end} end of the line arrives at {met:.0f} m{kept}"

    def _pantograph_ahead(self, passage: Passage) -> Iterator[str]:
        leading = next(
            (o for o in self._passages if o.span == passage.span and o.pantograph == 0), None
        )
        if passage.pantograph and leading is not None and passage.std > 1.25 * leading.std:
            ahead = (
                "pantograph ahead, which" if passage.pantograph == 1
                else "pantographs ahead, of which the leading one"
            )  # fmt: skip
            yield f"it runs in the waves of the {ahead} has {leading.std:.1f} N in the same span"

    def _length(self, span: int) -> Iterator[str]:
        lengths = np.diff(self._masts)
        own, usual = float(lengths[span]), float(np.median(lengths))
        if abs(own / usual - 1.0) > _LONGER:
            yield f"the span is {own:.1f} m long, others {usual:.1f} m"

    def _elastic(self, span: int) -> Iterator[str]:
        """Softest and stiffest place of a span against those of the others."""
        table = self._elasticities
        if span not in table or len(table) < _FEWEST:
            return
        for word, column in (("softest", 0), ("stiffest", 1)):
            at, own = table[span][column]
            usual = float(np.median([row[column][1] for row in table.values()]))
            if abs(own / usual - 1.0) > _SOFTER:
                yield (
                    f"elasticity: the {word} place ({at:.0f} m) has {1e3 * own:.3f} mm/N, those of "
                    f"all spans have a median of {1e3 * usual:.3f} mm/N"
                )

    @cached_property
    def _elasticities(self) -> dict[int, tuple[tuple[float, float], tuple[float, float]]]:
        """Place and value of largest and smallest elasticity of each span of the stretch."""
        if self._elasticity is None:
            return {}
        x, lift = self._elasticity
        found = {}
        for span in spans_in_stretch(self._results):
            # An anchored wire does not give way; that is no elasticity of the line.
            (own,) = np.nonzero(
                (x >= self._masts[span]) & (x <= self._masts[span + 1]) & (lift > _ANCHORED)
            )
            if own.size:
                soft, stiff = own[np.argmax(lift[own])], own[np.argmin(lift[own])]
                found[span] = (
                    (float(x[soft]), float(lift[soft])),
                    (float(x[stiff]), float(lift[stiff])),
                )
        return found

    def _profile(self, span: int) -> Iterator[str]:
        """Height of the contact wire at rest against that of other spans."""
        table = self._profiles
        if span not in table or len(table) < _FEWEST:
            return
        away = table[span] - np.median(np.array(list(table.values())), axis=0)
        worst = int(np.argmax(np.abs(away)))
        if abs(away[worst]) > _HIGHER:
            start, end = self._masts[span], self._masts[span + 1]
            x = start + worst / (_POINTS - 1) * (end - start)
            yield (
                f"the contact wire at rest is {1e3 * abs(away[worst]):.0f} mm "
                f"{'higher' if away[worst] > 0 else 'lower'} at {x:.0f} m than in other spans"
            )

    @cached_property
    def _profiles(self) -> dict[int, np.ndarray]:
        """Height over the share of each span of the stretch, (_POINTS,) [m]; of single wires."""
        profiles = list(self._results.contact_profiles().values())
        if len(profiles) > 1 or profiles[0].breaks.size:
            return {}
        x, height = profiles[0].x, profiles[0].height
        share = np.linspace(0.0, 1.0, _POINTS)
        return {
            span: np.interp(
                self._masts[span] + share * (self._masts[span + 1] - self._masts[span]), x, height
            )
            for span in spans_in_stretch(self._results)
        }

    def _droppers_at_rest(self, start: float, end: float) -> Iterator[str]:
        """Droppers that carry much more or less at rest than those at the same place of a span."""
        x, force = self._results.line("dropper_x"), self._results.static("dropper_force")
        likes = dropper_likes(self._results)
        evaluated = in_stretch(x, *self._results.evaluation)
        for number in np.flatnonzero((x >= start) & (x <= end)):
            others = force[(likes == likes[number]) & evaluated]
            usual = float(np.median(others)) if others.size >= _FEWEST else 0.0
            if usual > 0.0 and abs(force[number] / usual - 1.0) > _HEAVIER:
                yield (
                    f"the dropper at {x[number]:.1f} m carries {force[number]:.0f} N at rest, "
                    f"others at the same place of a span {usual:.0f} N"
                )

    def _gusts(self, span: int, pantograph: int) -> Iterator[str]:
        """Gusts that are stronger on a span when a pantograph comes than on the others."""
        found = self._gust_forces.get(pantograph, {})
        if span not in found or len(found) < _FEWEST:
            return
        usual = float(np.median(list(found.values())))
        if found[span] > (1.0 + _GUSTIER) * usual:
            yield (
                f"gusts press or lift the wires of the span by up to {found[span]:.0f} N as it is "
                f"passed, median of all spans {usual:.0f} N"
            )

    @cached_property
    def _gust_forces(self) -> dict[int, dict[int, float]]:
        """Force of the gusts on each span of the stretch by pantograph [N], none without gusts."""
        if self._rest is None:
            return {}
        when = []
        numbers = {one.pantograph for one in self._passages}
        positions = {p: self._results.column("contact_position", p) for p in numbers}
        for one in self._passages:
            own = positions[one.pantograph]
            # A record may end within a step before the mast.
            rows = np.minimum(np.searchsorted(own, (one.start, one.end)), own.size - 1).tolist()
            come, gone = map(self._results.time_at, rows)
            when.append((one.start, one.end, come - _BEFORE, gone))
        found: dict[int, dict[int, float]] = {}
        for one, force in zip(self._passages, gust_forces(self._rest, when), strict=False):
            found.setdefault(one.pantograph, {})[one.span] = force
        return found
