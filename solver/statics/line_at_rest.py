"""The line at rest: what a march, a study and a report start from; its stability, its tensions.

A run can start from a rest that is stable, with its wires above the strips. K is a sum of element
matrices. Wires under tension, springs, clamps and droppers add positive semidefinite ones; a steady
arm that its wire pushes adds (S / l) (1 - e e^T) with S < 0, and a wire that is pushed along itself
softens as well. Only lines with such parts are looked at. K is positive definite if Cholesky's
factorisation succeeds; otherwise the row in which it fails is the first place along the track at
which the line is unstable.

The tension along wires, and where their ends have moved, are there over temperatures too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy import linalg

from catenary.base.errors import InputError
from catenary.base.parallel import on_root
from catenary.base.process import give_back
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.wires import Role
from catenary.solver.effects.all_effects import simulated, with_defects
from catenary.solver.effects.build_model import build
from catenary.solver.model.axial_motion import WireEnd, ends_of
from catenary.solver.model.matrices import OperatorBands
from catenary.solver.model.model import Model, same_matrices
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.elasticity import Elasticity, elasticity, middle_span
from catenary.solver.statics.form_finding import find_form, sound_form
from catenary.solver.statics.rest_nearby import StiffLine


class LineAtRest(NamedTuple):
    """A problem with its line in equilibrium; ``March(comm, *rest)`` runs it.

    Attributes
    ----------
    problem : everything that the run is made of, in SI units, with the wires that hang
    model : the discrete line, with the lengths of its droppers
    form : its shape at rest
    lift : elasticity of the running span in the middle of the line
    """

    problem: Problem
    model: Model
    form: Equilibrium
    lift: Elasticity

    @property
    def mesh(self) -> LineMesh:
        """The mesh of the line."""
        return self.model.mesh

    def under(self, problem: Problem) -> LineAtRest:
        """Return this line with the train and the contact law of another problem."""
        own = replace(self.problem, train=problem.train, contact=problem.contact)
        model = replace(self.model, problem=own, simulated=simulated(own))
        return LineAtRest(own, model, self.form, self.lift)


class SoundLine(NamedTuple):
    """The line for which droppers are cut; lines that differ in errors of their lengths alone share
    it.

    Attributes
    ----------
    model, form : the discrete line, and its shape at rest
    stiff : its stiffness, factored
    lift : elasticity as that of a ``LineAtRest``
    """

    model: Model
    form: Equilibrium
    stiff: StiffLine
    lift: Elasticity


def sound_line(problem: Problem, mesh: LineMesh) -> SoundLine:
    """The sound line of a problem. Not collective; raises InputError as ``line_at_rest``."""
    model, form = sound_form(problem, mesh)
    return SoundLine(model, form, StiffLine(model), _lift_of(model))


def _lift_of(model: Model) -> Elasticity:
    return elasticity(model, *middle_span(model.problem.line))


def stable_form(
    problem: Problem, mesh: LineMesh, sound: SoundLine | None = None
) -> tuple[Model, Equilibrium]:
    """``find_form``, of a rest that is stable. Not collective.

    Raises
    ------
    InputError
        As ``find_form``, and if the rest is unstable.
    """
    model, form = find_form(problem, mesh, None if sound is None else sound[:3])
    refuse_unstable(model)
    return model, form


def line_at_rest(problem: Problem, mesh: LineMesh, sound: SoundLine | None = None) -> LineAtRest:
    """The line of a problem at rest, found by this process. Not collective.

    ``sound`` is the sound line of a problem that differs only in errors of dropper length, if it
    has been found.

    Raises
    ------
    InputError
        If there is no equilibrium with all droppers taut, or if it is unstable.
    """
    model, form = stable_form(problem, mesh, sound)
    give_back(model.n_unknowns)
    is_sound = sound is not None and same_matrices(sound.model, model)
    lift = sound.lift if sound is not None and is_sound else _lift_of(model)
    return LineAtRest(model.problem, model, form, lift)


def line_at_rest_on_all(
    problem: Problem,
    mesh: LineMesh,
    comm: Any,
    alone: Callable[[Callable[[], Any]], Callable[[], Any]] = lambda work: work,
) -> LineAtRest:
    """Find the line at rest on rank 0, and send it to all ranks. Collective.

    Parameters
    ----------
    problem, mesh : Problem
        Problem and mesh of the line, the same on all ranks.
    comm : mpi4py communicator
        Communicator of the ranks.
    alone : callable, optional
        Function that wraps the work of rank 0, e.g. to end it in good order at a signal.

    Raises
    ------
    InputError
        On all ranks, if there is no equilibrium with all droppers taut.
    """

    if comm.size == 1:
        return on_root(comm, alone(lambda: line_at_rest(problem, mesh)), takes_long=True)

    def work() -> tuple[tuple[np.ndarray, ...], Equilibrium, Elasticity]:
        rest = line_at_rest(problem, mesh)
        own = rest.model
        return (own.dropper_lengths, own.dropper_gap, own.cut_lengths), rest.form, rest.lift

    (lengths, gap, cut), form, lift = on_root(comm, alone(work), takes_long=True)
    hung = with_defects(problem)
    model = build(hung, mesh, lengths, form=form, gap=gap, cut_lengths=cut)
    return LineAtRest(hung, model, form, lift)


def refuse_unstable(model: Model) -> None:
    """Refuse a line whose rest, about which a model is made, is unstable. Not collective.

    Raises
    ------
    InputError
        With the place along the line, and the arm or wire there that is pushed.
    """
    if not _softens(model):
        return
    row = _first_unstable(model)
    if row is None:
        return
    x = _place_of(model, row)
    raise InputError(
        f"the line at rest is unstable near {x:.4g} m: {_pushed_near(model, x)}, and the wires do "
        "not hold it; take less wind, a larger line.stagger_m or other tensions"
    )


def _softens(model: Model) -> bool:
    """Whether any part has a negative stiffness."""
    wires = [wire.name for wire in model.problem.line.wires]
    if any((model.tension_of(name) < 0.0).any() for name in wires):
        return True
    # The matrix of a pushed bar has a negative diagonal, at a right angle to the bar.
    return any(
        (np.diagonal(block.stiffness, axis1=1, axis2=2) < 0.0).any()
        for block in model.blocks
        if block.of_shape and block.stiffness is not None and block.component not in wires
    )


def _first_unstable(model: Model) -> int | None:
    """The first unknown at which elimination along the track finds K indefinite, None if K is
    positive definite."""
    bands = OperatorBands(model, (0.0, 1.0, 0.0)).between(0, model.n_dofs)
    _, failed = linalg.lapack.dpbtrf(bands, lower=1)
    return None if failed == 0 else int(failed) - 1


def _place_of(model: Model, unknown: int) -> float:
    nodes, _ = np.nonzero(model.numbering.numbers == unknown)
    return float(model.mesh.x(nodes[:1])[0]) if nodes.size else 0.0


def _pushed_near(model: Model, x: float) -> str:
    """Name of the arm or wire that is pushed near a place [m], in words."""
    form, mesh = model.form, model.mesh
    if form is not None and form.lateral is not None:
        tension, places = form.lateral.arm_tension, mesh.x(mesh.steady_arms)
        pushed = np.flatnonzero(tension < 0.0)
        if pushed.size:
            arm = pushed[np.argmin(np.abs(places[pushed] - x))]
            return (
                f"its wire pushes the steady arm at {places[arm]:.4g} m with "
                f"{-tension[arm]:.0f} N, so that it folds over"
            )
    for wire in model.problem.line.wires:
        tension = model.tension_of(wire.name)
        if tension.min() < 0.0:
            return f"{wire.name} is pushed along itself with up to {-tension.min():.0f} N"
    return "its stiffness is not positive definite"


def refuse_lost_wire(model: Model, form: Equilibrium) -> None:
    """Refuse a line of several contact wires that all stand beside a pantograph's strips at rest,
    blown there by the wind. Not collective.

    A wire that is alone is followed beside the strips, which the report says.

    Raises
    ------
    InputError
        With the stretch of the run in which a head finds no wire.
    """
    wires = model.problem.line.wires_of(Role.CONTACT)
    if form.lateral is None or len(wires) == 1:
        return
    train, shape = model.problem.train, form.lateral
    halves = [place.data.strips.half_length for place in train.placements]
    half = np.nanmin([*halves, np.inf])
    trailing = max(place.behind for place in train.placements)
    pieces = [piece for wire in wires for piece in model.mesh.pieces(wire.name)]
    x = np.unique(np.concatenate([model.mesh.x(piece) for piece in pieces]))
    x = x[(x >= train.start - trailing) & (x <= train.end)]
    beside = np.full(x.size, np.inf)
    for piece in pieces:
        place = model.mesh.x(piece)
        aside = np.interp(x, place, np.abs(shape.y[piece]), left=np.inf, right=np.inf)
        beside = np.minimum(beside, aside)
    lost = np.flatnonzero(np.isfinite(beside) & (beside > half))
    if lost.size:
        worst = lost[np.argmax(beside[lost])]
        raise InputError(
            f"at rest the contact wire stands beside the strips at {_stretches(x, lost)}, by "
            f"most at {x[worst]:.4g} m: {beside[worst]:.3g} m from the track's axis, and strips "
            f"end at {half:.3g} m, so that a pantograph would lose it; take less wind, another "
            "line.stagger_m or shorter spans, or longer strips (pantographs.*.strips.length_m)"
        )


def _stretches(x: np.ndarray, lost: np.ndarray) -> str:
    """Stretches of consecutive places, in words."""
    runs = np.split(lost, np.flatnonzero(np.diff(lost) > 1) + 1)
    first = runs[0]
    more = f" and in {len(runs) - 1} more stretches" if len(runs) > 1 else ""
    return f"{x[first[0]]:.4g} to {x[first[-1]]:.4g} m{more}"


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
        x = model.mesh.middles(wire.name)
        installed = wire.tension_at(x)
        tension = installed + form.gained_tension.get(wire.name, np.zeros(x.size))
        ends = tuple(end for end in every if end.wire == wire.name)
        moved, share = np.zeros(len(ends)), np.zeros(len(ends))
        for i, end in enumerate(ends):
            element = end.element(model.mesh)
            share[i] = tension[element] / installed[element] - 1.0
            moved[i] = end.outwards * form.moved_along(end.node)
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
