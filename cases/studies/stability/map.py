"""The stability map: largest step of each coupling against contact stiffness and head mass.

Each point of the map is found twice: from the matrices of a step and by marching
(`coupling_schemes`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from catenary.base.errors import InputError
from catenary.cases.process.workers import WorkerLost
from catenary.cases.scene.input.case_files import Assigned
from catenary.cases.scene.load import Draft
from catenary.cases.scene.run.numerics import MAX_DT
from catenary.cases.scene.scene import Scene, resolved
from catenary.cases.studies.hard.runs import at_rest
from catenary.cases.studies.records import NOTHING_KEPT, KeptRows
from catenary.cases.studies.stability import coupling_schemes as theory
from catenary.cases.terminal.terminal_text import RunsBar
from catenary.mbs.lumped import LumpedData
from catenary.postproc.files.disk import plain
from catenary.postproc.report.pictures import figures
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.model.partition import distribute
from catenary.solver.problem.integrator_parameters import AVERAGE_ACCELERATION
from catenary.solver.statics.elasticity import middle_span
from catenary.solver.statics.line_at_rest import LineAtRest

# A linear problem: one contact that neither parts nor damps, taut droppers, steps as tried.
_LINEAR = (
    "numerics.iterations=", "numerics.adaptive_tolerance_N=", "numerics.smallest_dt_s=",
    "numerics.eps_d_m=", "numerics.eps_v_m_per_s=", "numerics.eps_force_N=",
    "numerics.max_iterations=", "numerics.coupling=", "numerics.scheme=one_solve",
    "window.mode=off", "window.tolerance=", "window.spans_ahead=", "window.spans_behind=",
    "contact.restitution=", "contact.hertz_stiffness_N_per_m1_5=", "contact.damping_N_s_per_m=",
    "contact.least_impact_speed_m_per_s=", "contact.law=linear", "effects.contact_damping=false",
    "effects.contact_loss=false", "effects.residual_dropper_stiffness=false",
    "effects.dropper_slackening=false", "effects.uplift_stops=false",
    "effects.pantograph_laws=false", "effects.regulated_lift=false", "effects.gusts=false",
    "incidents=",
)  # fmt: skip
# Steps of the map [s], and how closely a limit is found by marching.
STEPS_RANGE = (1e-5, MAX_DT)
RESOLUTION = 0.02
# Theory covers longer ones too, so that curves leave the map where they do.
_THEORY_RANGE = (STEPS_RANGE[0], 4.0 * MAX_DT)
# First change of an iterate in depths at the start: slopes of an element are some 3 / m of it.
_START = 10.0
# Steps with which the implicit coupling, which has no limit, is tried [s].
_TRIED = (1e-5, 1e-4, 1e-3, 1e-2, MAX_DT)
# Differences below this are round-off of the bisections.
_SLACK = 1e-4


@dataclass(frozen=True)
class Grid:
    """Varied parameters: stiffnesses [N/m] and head masses [kg] of the two axes of the map, and the
    few of each that curves are drawn for on the other axis."""

    stiffnesses: tuple[float, ...] = tuple(float(f"{10**e:.4g}") for e in np.arange(4.0, 8.1, 0.5))
    head_masses: tuple[float, ...] = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
    few_stiffnesses: tuple[float, ...] = (1e5, 1e6, 1e7)
    few_masses: tuple[float, ...] = (0.5, 2.0, 8.0)

    def pairs(self) -> list[tuple[float, float]]:
        """All stiffnesses and masses, each pair once."""
        pairs = {(k, m) for k in self.stiffnesses for m in self.few_masses}
        pairs |= {(k, m) for k in self.few_stiffnesses for m in self.head_masses}
        return sorted(pairs)


QUICK = Grid((1e5, 1e6, 1e7), (0.5, 2.0, 8.0), (1e6,), (0.5, 8.0))


@dataclass(frozen=True)
class Limit:
    """The largest step of a coupling, found in two ways.

    Attributes
    ----------
    coupling : implicit, explicit, iterated or fixed_point
    stiffness, head_mass : [N/m], [kg]
    theory : from the matrices of a step [s], inf if all steps up to 0.1 s are stable
    visible : from which step on a march of so many steps or exchanges shows it [s]
    closed_form : omega dt = 2 [s], inf for the implicit coupling and with numerical damping
    stable, unstable : steps that were marched [s], the limit lies between them
    """

    coupling: str
    stiffness: float
    head_mass: float
    theory: float
    visible: float
    closed_form: float
    stable: float
    unstable: float

    @property
    def agrees(self) -> bool:
        """Whether marching found the limit of theory.

        That is, bracket and the stretch from the limit to where a march can show it overlap:
        exchanges that hardly converge do not end in time, and what hardly grows is not yet large.
        """
        low, high = sorted((self.theory, self.visible))
        return self.stable <= high * (1.0 + _SLACK) and self.unstable >= low * (1.0 - _SLACK)

    @property
    def marched(self) -> float:
        """The limit as it was marched [s]: the middle of the bracket, inf if there is none."""
        return float(np.sqrt(self.stable * self.unstable))


@dataclass(frozen=True)
class StabilityMap:
    """A map: ``limits``, its ``grid``, where on the line [m], what a force meets there [kg], and
    the case with its own stiffness [N/m] or None, head mass [kg] and step [s]; how many contact
    wires run there, ``n_wires``."""

    case: str
    limits: Sequence[Limit]
    grid: Grid
    place: float
    wire_mass: float
    own: tuple[float | None, float, float]
    n_wires: int = 1

    def of(self, coupling: str, **fixed: float) -> list[Limit]:
        """Limits of a coupling with a given ``stiffness`` or ``head_mass``."""
        return [
            limit
            for limit in self.limits
            if limit.coupling == coupling
            and all(getattr(limit, name) == value for name, value in fixed.items())
        ]


def linear_scene(draft: Draft) -> Scene:
    """The case as the map takes it: linear. Raises InputError if its pantograph is no chain."""
    scene = draft.with_words(map(Assigned, _LINEAR)).scene()
    kind = scene.train.pantographs[0].name
    if scene.pantographs[kind].type != "lumped":
        raise InputError(
            f"pantographs.{kind} of {scene.case.name} is a mechanism, but a stability map varies "
            f"the head of a chain of masses; `catenary pantograph {scene.case.name} --help` tells "
            "how to fit one, or name a lumped one with --set train.pantographs.0.name=..."
        )
    return scene


def make_map(
    draft: Draft,
    comm: Any,
    grid: Grid,
    say: Callable[[str], None] = lambda line: None,
    kept: KeptRows = NOTHING_KEPT,
    n_at_once: int = 1,
) -> StabilityMap:
    """Find all limits that are not known yet. Not collective.

    Parameters
    ----------
    draft : of the case
    comm : of this process alone
    grid : stiffnesses and masses of the map
    say : called with a line on each point that is done
    kept : limits that were found before; without it all are found anew
    n_at_once : points of the map that are tried at the same time, each in a process of its own
    """
    own, scene = draft.scene(), linear_scene(draft)
    find_all = _FindLimits(scene)
    bench, line = find_all.bench(comm)
    pairs, limits, config = grid.pairs(), [], resolved(scene)

    def depends_on(pair: tuple[float, float]) -> dict[str, Any]:
        return {"scene": config, "stiffness": pair[0], "head_mass": pair[1]}

    lost: list[WorkerLost] = []
    with RunsBar(len(pairs), say, what="points") as bar:
        for outcome in kept.each(find_all, pairs, depends_on, n_at_once, comm):
            bar.ended()
            if isinstance(outcome.error, WorkerLost):
                lost.append(outcome.error)
                continue
            found = [Limit(*row) for row in outcome.get()]
            limits += found
            words = ", ".join(f"{one.coupling} {in_ms(one.marched)}" for one in found)
            stiffness, mass = pairs[outcome.number]
            place = f"[{outcome.number + 1}/{len(pairs)}] {stiffness:g} N/m, {mass:g} kg"
            bar.say(f"{place}: {words} ms")
    if lost:  # the others are kept
        raise lost[0]
    linear = own.contact.law == "linear"
    own_point = (own.contact.stiffness_N_per_m if linear else None, bench.data.masses[0])
    point = (*own_point, own.numerics.dt_s)
    n_wires = line.load.shape[1]
    return StabilityMap(own.case.name, limits, grid, bench.x, line.mass, point, n_wires)


class _FindLimits:
    """Finds the limits of all couplings at a point of the map.

    A process makes its line at rest once: another gets the scene alone.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._bench: tuple[theory.Bench, theory.PointModel] | None = None

    def __reduce__(self) -> tuple[type[_FindLimits], tuple[Scene]]:
        return type(self), (self._scene,)

    def bench(self, comm: Any) -> tuple[theory.Bench, theory.PointModel]:
        """Bench at the place where heads are tried, and the line reduced to that place."""
        if self._bench is None:
            rest = at_rest(self._scene, comm)
            data = rest.problem.train.placements[0].data
            assert isinstance(data, LumpedData)  # the scene was refused otherwise
            wires = ContactWires(rest.model, rest.form, distribute(rest.model, 1, 0))
            place = _place(rest, wires)
            loads = theory.loads_at(wires, place, rest.model.n_dofs)
            line = theory.point_model(rest.model, loads)
            self._bench = theory.Bench(rest, data, place, comm), line
        return self._bench

    def __call__(self, pair: tuple[float, float], comm: Any) -> list[Any]:
        """Rows of ``Limit`` for a stiffness [N/m] and a head mass [kg]."""
        bench, line = self.bench(comm)
        return [astuple(find(bench, line, coupling, *pair)) for coupling in theory.COUPLINGS]


def _place(rest: LineAtRest, wires: ContactWires) -> float:
    """Place where heads are tried [m]: in the middle span, or where a head passes from one wire to
    the next if the line has such a place and all its contact wires do not run in that span."""
    spans = middle_span(rest.problem.line)
    place = theory.lightest_place(rest.model, wires, *spans, every=True)
    if place is None:
        place = theory.lightest_place(rest.model, wires, *rest.problem.line.running_range)
    assert place is not None  # between overlaps a head meets one wire alone
    return place


def find(
    bench: theory.Bench, line: theory.PointModel, coupling: str, stiffness: float, head_mass: float
) -> Limit:
    """The limit of a ``coupling`` for a head of ``head_mass`` [kg] on a contact of ``stiffness``
    [N/m]. Not collective.

    ``bench`` marches the line of the map, and ``line`` is its model for theory.
    """
    numerics = bench.rest.problem.numerics
    methods = theory.methods_of(numerics)
    both = theory.couple(line, bench.with_head(head_mass), methods)
    seen = theory.GROWN ** (1.0 / theory.STEPS)
    if coupling not in ("implicit", "explicit"):
        seen = (theory.AGREED / _START) ** (1.0 / theory.EXCHANGES)
    expected, visible = (
        both.largest_step(stiffness, coupling, _THEORY_RANGE, allowed) for allowed in (1.0, seen)
    )
    if coupling == "implicit":
        # A limit could be anywhere, and stability above it.
        tried = [dt for dt in _TRIED if not bench.is_stable(coupling, stiffness, head_mass, dt)]
        stable, unstable = (MAX_DT, np.inf) if not tried else (0.0, min(tried))
        closed = np.inf
    else:
        stable, unstable = bench.bracket(coupling, stiffness, head_mass, STEPS_RANGE, RESOLUTION)
        closed = np.inf
        if methods.line == AVERAGE_ACCELERATION:
            closed = theory.closed_form(line, head_mass, stiffness)
    return Limit(coupling, stiffness, head_mass, expected, visible, closed, stable, unstable)


def as_rows(found: StabilityMap) -> list[dict[str, Any]]:
    """The map as rows under names with units; None where there is no limit."""
    return [
        {
            "coupling": one.coupling,
            "stiffness_N_per_m": one.stiffness,
            "head_mass_kg": one.head_mass,
            "wire_mass_kg": found.wire_mass,
            "theory_s": plain(one.theory),
            "omega_dt_2_s": plain(one.closed_form),
            "marched_stable_s": one.stable,
            "marched_unstable_s": plain(one.unstable),
            "agrees": "yes" if one.agrees else "no",
        }
        for one in found.limits
    ]


def as_text(found: StabilityMap) -> str:
    """A sentence for each coupling."""
    lines = [f"{found.case} at {found.place:.2f} m, where {meets(found)} {found.wire_mass:.3g} kg:"]
    for coupling in theory.COUPLINGS:
        limits = found.of(coupling)
        agree = sum(one.agrees for one in limits)
        both = [one for one in limits if np.isfinite(one.theory) and one.marched < np.inf]
        text = f"stable at all steps of up to {1e3 * MAX_DT:g} ms"
        if both:
            apart = max(abs(one.marched / one.theory - 1.0) for one in both)
            text = f"marched limits within {100 * apart:.2g} % of theory's"
        lines.append(f"  {coupling:12} {text}; {agree} of {len(limits)} agree")
    return "\n".join(lines)


def meets(found: StabilityMap) -> str:
    """Words on what meets the head there."""
    if found.n_wires == 1:
        return "the contact wire meets a force with"
    return f"{found.n_wires} contact wires meet forces with"


def in_ms(dt: float) -> str:
    """A step as milliseconds with three digits, or that there is no limit."""
    return f"{1e3 * dt:.3g}" if np.isfinite(dt) else "no limit below 25"


# Dashes and marks tell couplings apart, widths what is fixed on a curve, without colours too [pt].
_WIDTHS = (0.7, 1.3, 2.1)
_MARKERS = {"explicit": "o", "iterated": "s", "fixed_point": "^"}
_RAISED = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_STABLE, _ONLY_IMPLICIT = "#eef3e6", "#fbeee6"


@figures.own_style()
def draw(found: StabilityMap) -> Figure:
    """Largest step over contact stiffness and over head mass, both logarithmic."""
    figure, (left, right) = figures.panels(5.6, 1, 2, sharey=True)
    masses, stiffnesses = found.grid.few_masses, found.grid.few_stiffnesses
    by_mass = [(f"head {mass:g} kg", {"head_mass": mass}) for mass in masses]
    by_stiffness = [(f"contact {_power(k)} N/m", {"stiffness": k}) for k in stiffnesses]
    _panel(left, found, by_mass, "stiffness")
    _panel(right, found, by_stiffness, "head_mass", named=True)
    figures.tidy(left, "contact stiffness [N/m]", "largest stable step [ms]")
    figures.tidy(right, "head mass [kg]", "")
    small: dict[str, Any] = {"fontsize": "small"}
    stiffness, mass, dt = found.own
    if stiffness is not None:
        at = stiffness, 1e3 * dt
        left.plot(*at, "*", ms=11, color="black", zorder=5)
        left.annotate(f"the case: {mass:g} kg", at, (0, -15), textcoords="offset points",
                      ha="center", **small)  # fmt: skip
    implicit = found.of("implicit")
    everywhere = all(one.marched == np.inf and one.theory == np.inf for one in implicit)
    word = "implicit: stable everywhere on this map" if everywhere else "implicit: see the table"
    right.text(0.97, 0.97, word, transform=right.transAxes, ha="right", va="top", **small)
    lines = [
        Line2D([], [], color=figures.colour(i), lw=_WIDTHS[i % len(_WIDTHS)], label=name)
        for i, (name, _) in enumerate(by_mass)
    ]
    left.legend(handles=lines, loc="upper right", frameon=False, **small)
    word = "a coupling is stable below its line;\nabove both lines only the implicit one is"
    left.text(0.03, 0.03, word, transform=left.transAxes, va="bottom", **small)
    title = (
        f"{found.case}: stability of the couplings while contact lasts and droppers are taut (the "
        f"linear system);\n{meets(found)} {found.wire_mass:.2g} kg"
    )
    figure.suptitle(title, x=0.01, ha="left", fontsize="medium")
    figure.legend(handles=_key(found), loc="outside lower center", ncols=3, frameon=False, **small)
    return figure


def _panel(
    axes: Axes,
    found: StabilityMap,
    curves: Sequence[tuple[str, dict[str, float]]],
    along: str,
    named: bool = False,
) -> None:
    """Curves of one panel, each of what is fixed, and the regions below and above the lowest;
    ``named`` at their ends."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    lowest: tuple[np.ndarray, np.ndarray] | None = None
    for number, (label, fixed) in enumerate(curves):
        colour, width = figures.colour(number), _WIDTHS[number % len(_WIDTHS)]
        for name, marker in _MARKERS.items():
            limits = sorted(found.of(name, **fixed), key=lambda one: float(getattr(one, along)))
            x = np.array([getattr(one, along) for one in limits])
            theory = 1e3 * np.array([one.theory for one in limits])
            marched = 1e3 * np.array([one.marched for one in limits])
            there = np.isfinite(marched)
            axes.plot(x[there], marched[there], marker, color=colour, ms=5, mfc="none")
            if name == "fixed_point":  # the line of iterated
                continue
            explicit = name == "explicit"
            axes.plot(x, theory, "-" if explicit else "--", color=colour, linewidth=width)
            if explicit and named:
                end = x[-1], theory[-1]
                axes.annotate(label, end, (-4, -13), textcoords="offset points", ha="right",
                              fontsize="small", color=colour)  # fmt: skip
            if explicit and (lowest is None or theory[0] < lowest[1][0]):
                lowest = x, theory
    top = 1.25e3 * MAX_DT
    axes.set_ylim(None, top)
    if lowest is not None:
        bottom = axes.get_ylim()[0]
        axes.fill_between(lowest[0], bottom, lowest[1], color=_STABLE, linewidth=0, zorder=0)
        axes.fill_between(lowest[0], lowest[1], top, color=_ONLY_IMPLICIT, linewidth=0, zorder=0)
        axes.set_ylim(bottom, top)


def _key(found: StabilityMap) -> list[Line2D]:
    closed = any(np.isfinite(one.closed_form) for one in found.limits)
    explicit = "explicit, theory" + (" (ω dt = 2)" if closed else "")
    lines = (("-", explicit), ("--", "exchanges, theory"))
    grey = figures.GREY
    keys = [Line2D([], [], color=grey, lw=1.2, ls=style, label=name) for style, name in lines]
    return keys + [
        Line2D([], [], color=grey, ls="", marker=marker, mfc="none", label=f"{name}, marched")
        for name, marker in _MARKERS.items()
    ]


def _power(value: float) -> str:
    """A number as a power of ten, without marks of mathematics, which pictures do not read."""
    exponent = int(np.floor(np.log10(value)))
    lead = value / 10**exponent
    front = "" if np.isclose(lead, 1.0) else f"{lead:.2g} · "
    return f"{front}10{str(exponent).translate(_RAISED)}"
