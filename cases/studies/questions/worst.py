"""The worst places of a run: spans, steady arms and droppers, ranked, and candidates for why.

Figures of each place say which ones stand out. Causes are candidates with figures: nearness proves
none. Text and tables show both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from catenary.base.errors import CatenaryError
from catenary.cases.run.at_rest import rest_of
from catenary.cases.scene.load import recorded_scene
from catenary.meshgen.wires import Role
from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate import statistics as stats
from catenary.postproc.evaluate.wording import capital, wire_words
from catenary.postproc.read.results import Results, in_stretch
from catenary.postproc.report.study_table import Content, StudyTable, file_table
from catenary.solver.effects.all_effects import simulated
from catenary.solver.statics.elasticity import elasticity
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.wind import GustPressure, drag_width, gust_points

# A figure stands out if it exceeds the median of its likes by this many robust standard deviations
# (1.4826 times the median absolute deviation) and by this share.
_DEVIATIONS, _SHARE, _NORMAL = 3.0, 0.1, 1.4826
# Likes of a dropper hang so close to the same share of their spans [-]; fewer than this say little.
_SAME_SHARE, _FEWEST = 0.02, 3
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
NONE = "no cause found"
_MOST_CAUSES = 4  # of a place in the text; tables have all


class Passage(NamedTuple):
    """A pantograph in a span.

    Attributes
    ----------
    span : number of the span, from 0
    start, end : masts of the span [m]
    pantograph : number of the pantograph, from 0
    std, maximum, minimum : of the contact force, 20 Hz low-pass [N]
    loss : share of time without contact [%]
    median : of the deviations of this pantograph in all spans [N]
    stands_out : whether the deviation is far above it, None where there are too few others
    """

    span: int
    start: float
    end: float
    pantograph: int
    std: float
    maximum: float
    minimum: float
    loss: float
    median: float
    stands_out: bool | None


class Spot(NamedTuple):
    """A steady arm or a dropper.

    Attributes
    ----------
    number : of it, from 0
    x : where it is [m]
    wire : name of the wire that it holds, where there are several; else empty
    value : uplift of an arm [mm], largest force of a dropper [N], or its time slack [s]
    median : of its likes
    stands_out : whether the value is far above it, None where there are too few others
    """

    number: int
    x: float
    wire: str
    value: float
    median: float
    stands_out: bool | None

    @property
    def place(self) -> str:
        """Its place, in words."""
        return f"{self.x:.1f} m{self.wire and f', {self.wire}'}"


class WorstPlaces(NamedTuple):
    """All places of the evaluated stretch, the worst first.

    Attributes
    ----------
    passages : by standard deviation, of every span that lies within the stretch
    arms : by uplift
    forces : droppers by largest force
    slack : droppers by time slack, those that are
    least : (n_droppers,) smallest force of every dropper of the line [N]
    passed_to : place that all pantographs have reached [m]; arms and droppers beyond are left out,
        as their largest values are still to come
    """

    passages: list[Passage]
    arms: list[Spot]
    forces: list[Spot]
    slack: list[Spot]
    least: np.ndarray
    passed_to: float


def worst_places(results: Results) -> WorstPlaces:
    """Rank the places of a run. Not collective.

    Raises
    ------
    InputError
        If the time step is too long for the 20 Hz filter.
    """
    statistics = stats.evaluate(results)
    supports, droppers = statistics.supports, statistics.droppers
    everywhere = np.zeros(supports.x.size, dtype=np.int64)
    names = list(results.roles)
    of_arms = _of_several(results.arm_wires())
    of_droppers = _of_several([names[wire] for wire in results.dropper_wires()[:, 1].tolist()])
    likes = _dropper_likes(results)
    times = stats.slack_times(results)
    passed_to = _passed_to(results)
    arms, hung = (one.evaluated & (one.x <= passed_to) for one in (supports, droppers))
    # One that never carries is missing or loose, and not slack at times.
    slack = _spots(droppers.x, times, hung & (droppers.highest > 0.0), likes, of_droppers)
    return WorstPlaces(
        sorted(_passages(results), key=lambda one: -one.std),
        _spots(supports.x, 1e3 * supports.uplift, arms, everywhere, of_arms),
        _spots(droppers.x, droppers.highest, hung, likes, of_droppers),
        [one for one in slack if one.value > 0.0],
        droppers.lowest,
        passed_to,
    )


def _passed_to(results: Results) -> float:
    """Place that all pantographs have reached, to within a step as ``covers`` has it [m]; infinite
    without a train."""
    if results.attributes.get("excitation"):
        return np.inf
    n = results.n_rows("time")
    step = results.fact("speed") * results.dt
    last = (
        results.column("contact_position", p, slice(n - 1, n)) for p in range(results.n_pantographs)
    )
    return min((float(one[0]) for one in last), default=-np.inf) + step if n else -np.inf


def _of_several(wires: Sequence[str]) -> list[str]:
    """Names of wires as words, all empty if they are of one wire."""
    several = len(set(wires)) > 1
    return [wire_words(name) if several else "" for name in wires]


def _spans_in_stretch(results: Results) -> list[int]:
    """Numbers of the spans that lie within the evaluated stretch, from 0."""
    within = in_stretch(results.line("support_x"), *results.evaluation)
    return [int(number) for number in np.flatnonzero(within[:-1] & within[1:])]


def _passages(results: Results) -> list[Passage]:
    masts, found = results.line("support_x"), []
    for p in range(results.n_pantographs):
        position, force = results.column("contact_position", p), results.column("contact_force", p)
        filtered = filters.contact_force(results, p)
        own = []
        for span in _spans_in_stretch(results):
            start, end = float(masts[span]), float(masts[span + 1])
            if not stats.covers(position, (start, end)):
                continue
            within = (position >= start) & (position <= end)
            part = filtered[within]
            loss = 100.0 * float((force[within] <= 0.0).mean())
            extremes = float(part.max()), float(part.min())
            own.append(Passage(span, start, end, p, float(part.std()), *extremes, loss, 0.0, False))
        values = np.array([one.std for one in own])
        found += [
            one._replace(median=float(np.median(values)), stands_out=is_out)
            for one, is_out in zip(own, stands_out(values), strict=True)
        ]
    return found


def stands_out(values: np.ndarray) -> list[bool | None]:
    """Mask (n,) of likes that are far above their median; None of all where they are too few."""
    if values.size < _FEWEST:
        return [None] * values.size
    median = float(np.median(values))
    scatter = _NORMAL * float(np.median(np.abs(values - median)))
    beyond = values > median + max(_DEVIATIONS * scatter, _SHARE * abs(median))
    return [bool(one) for one in beyond]


def _dropper_likes(results: Results) -> np.ndarray:
    """Number of the group of each dropper, (n_droppers,): those at the same share of a span."""
    x, span, masts = (
        results.line("dropper_x"),
        results.line("dropper_span"),
        results.line("support_x"),
    )
    share = (x - masts[span]) / (masts[span + 1] - masts[span])
    order = np.argsort(share, kind="stable")
    group = np.empty(x.size, dtype=np.int64)
    group[order] = np.cumsum(np.diff(share[order], prepend=share[order][:1]) > _SAME_SHARE)
    return group


def _spots(
    x: np.ndarray,
    values: np.ndarray,
    evaluated: np.ndarray,
    likes: np.ndarray,
    wires: Sequence[str],
) -> list[Spot]:
    """Evaluated places whose value is known, the largest first."""
    spots = []
    known = evaluated & np.isfinite(values)
    for group in np.unique(likes[known]):
        (own,) = np.nonzero(known & (likes == group))
        median = float(np.median(values[own]))
        for n, is_out in zip(own.tolist(), stands_out(values[own]), strict=True):
            spots.append(Spot(n, float(x[n]), wires[n], float(values[n]), median, is_out))
    return sorted(spots, key=lambda one: -one.value)


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
    pressure = GustPressure(rest.model, wind, points)
    found = []
    for start, end, begin, stop in when:
        first, last = np.searchsorted(points, (start, end)).tolist()
        low = max(round(begin / pressure.interval), 0)
        high = round(stop / pressure.interval)
        slices = np.zeros((high - low + 1, last - first))
        pressure.fill_upward(low, slice(first, last), slices)
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
        for span in _spans_in_stretch(self._results):
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
            for span in _spans_in_stretch(self._results)
        }

    def _droppers_at_rest(self, start: float, end: float) -> Iterator[str]:
        """Droppers that carry much more or less at rest than those at the same place of a span."""
        x, force = self._results.line("dropper_x"), self._results.static("dropper_force")
        likes = _dropper_likes(self._results)
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


def answer_of(results: Results, count: int) -> tuple[str, dict[str, Content]]:
    """A text about the worst places of a run with candidates for their causes, and tables of all
    places by names of files. Not collective.

    Parameters
    ----------
    count : places of each kind in the text
    """
    places = worst_places(results)
    causes, unknown = _causes(results, places.passages)
    names = results.pantograph_names()
    start, end = results.evaluation
    lines = [
        f"{results.attributes['case']} at {3.6 * results.fact('speed'):.0f} km/h, evaluated from "
        f"{start:.0f} to {end:.0f} m",
        *results.damage,
    ]
    if not places.passages:
        lines.append("No span lies whole within the evaluated stretch and the record.")
    if places.passed_to < end:
        lines.append(
            f"The record ends with the last pantograph at {places.passed_to:.0f} m: supports and "
            "droppers beyond are left out."
        )
    named = False
    for (noun, by), found in worst_of_each(places, causes, names, count).items():
        named = named or any(candidates not in ([], [NONE]) for _, candidates in found)
        lines += ["", f"{capital(noun)}s by {by}"]
        for sentence, candidates in found:
            more = len(candidates) - _MOST_CAUSES
            lines += [f"  {sentence}", *(f"    {text}" for text in candidates[:_MOST_CAUSES])]
            lines += [f"    and {more} more (-o)"] if more > 0 else []
    everywhere = causes.of_line()
    if everywhere:
        lines += ["", "Of the line as a whole:", *(f"  {text}" for text in everywhere)]
    if unknown:
        lines += ["", f"Elasticity and gusts along the line are not known: {unknown}"]
    if named or everywhere:
        lines += ["", "Candidates are near in place or frequency; none is proved."]
    text = "\n".join(lines)
    of_span = ("std_N", "max_N", "min_N", "loss_percent", "median_std_N", "stands_out")
    spans = file_table(
        ("span", "from_m", "to_m", "pantograph", *of_span, "causes"),
        (
            (p.span + 1, p.start, p.end, names[p.pantograph], *p[4:], causes.of_passage(p))
            for p in places.passages
        ),
    )
    supports = file_table(
        ("x_m", "wire", "max_uplift_mm", "median_mm", "stands_out", "causes"),
        ((*arm[1:], causes.at(arm)) for arm in places.arms),
    )
    tables = {"spans": spans, "supports": supports, "droppers": _droppers_table(places, causes)}
    return text, {f"worst_{name}.csv": own for name, own in tables.items()}


def _causes(results: Results, passages: Sequence[Passage]) -> tuple[Causes, str]:
    """Candidates by the scene that a run recorded, and why that gives no line at rest."""
    try:
        scene = recorded_scene(results.attributes["config"], results.path)
        return Causes(results, passages, rest_of(scene)), ""
    except CatenaryError as error:
        return Causes(results, passages, None), str(error)


# What is worst of a kind and by which figure, and what is said of a spot.
_SPOTS: tuple[tuple[tuple[str, str], Callable[[WorstPlaces], Sequence[Spot]], str], ...] = (
    (("support", "uplift"), lambda p: p.arms, "{at}: {v:.1f} mm, median {m:.1f} mm"),
    (("dropper", "largest force"), lambda p: p.forces, "{at}: {v:.0f} N, median {m:.0f} N"),
    (("dropper", "time slack"), lambda p: p.slack, "{at}: {v:.2f} s, median {m:.2f} s"),
)


def worst_of_each(
    places: WorstPlaces, causes: Causes, names: Sequence[str], count: int
) -> dict[tuple[str, str], list[tuple[str, Sequence[str]]]]:
    """Sentences on the worst places of each kind, by what they are and by which figure, each with
    candidates for its cause.

    Parameters
    ----------
    names : of the pantographs
    count : places of a kind, of spans the worst passage of each
    """
    worst: dict[int, Passage] = {}
    for passage in places.passages:
        worst.setdefault(passage.span, passage)
    spans = []
    for one in list(worst.values())[:count]:
        who = f", {names[one.pantograph]}" if len(names) > 1 else ""
        sentence = (
            f"span {one.span + 1}, {one.start:.6g} to {one.end:.6g} m{who}: {one.std:.1f} N, "
            f"median {one.median:.1f} N, force {one.minimum:.0f} to {one.maximum:.0f} N"
        )
        spans.append(_with_candidates(sentence, one.stands_out, causes.of_passage(one)))
    found = {("span", "standard deviation"): spans}
    for kind, spots, words in _SPOTS:
        found[kind] = [
            _with_candidates(
                words.format(at=spot.place, v=spot.value, m=spot.median),
                spot.stands_out,
                causes.at(spot),
            )
            for spot in spots(places)[:count]
        ]
    return {kind: own for kind, own in found.items() if own}


def _with_candidates(
    sentence: str, is_out: bool | None, candidates: list[str]
) -> tuple[str, Sequence[str]]:
    """The sentence with whether the place stands out, None if its likes are too few, and its
    candidates; if one that does has none, that it has none."""
    if is_out is None:
        return f"{sentence}; too few others to compare", candidates
    if not is_out:
        return f"{sentence}; within the scatter of the others", candidates
    return f"{sentence}; stands out", candidates or [NONE]


def _droppers_table(places: WorstPlaces, causes: Causes) -> StudyTable:
    slack = {one.number: one for one in places.slack}
    cells = []
    for one in places.forces:
        times, least = slack.get(one.number), float(places.least[one.number])
        stands_out = (times is not None and times.stands_out) or one.stands_out
        slack_s = 0.0 if times is None else times.value
        values = one.value, one.median, least, slack_s, stands_out
        cells.append((one.x, one.wire, *values, causes.at(one)))
    heads = ("x_m", "wire", "max_N", "usual_max_N", "min_N", "slack_s", "stands_out", "causes")
    return file_table(heads, cells)
