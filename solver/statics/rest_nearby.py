"""The rest that a line comes to from one that is known, once something about it has changed.

Newton's method on its potential energy, all planes at once; its tangent is the stiffness of the
model about each shape, and one step is all that a line needs whose matrices do not depend on its
shape and whose droppers have one slope each. Droppers only pull, and wheels of tensioners stand or
turn: which ones do is found by switching all at once, until nothing switches; should that go round,
one at a time from the first on, which ends always where shapes are small displacements (K. G.
Murty, Linear Algebra Appl. 7, 1974: the matrix of that problem is positive definite).

A line with defects hangs so from that for which its droppers were cut: they keep their lengths.
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from catenary.base.errors import InputError
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.build_model import build, rebuilt
from catenary.solver.model.axial_motion import WireEnd, tensioned_ends
from catenary.solver.model.link_directions import dropper_directions
from catenary.solver.model.matrices import stiffness_matrix
from catenary.solver.model.model import Model, same_matrices
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.problem.defects import HardSpot
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.potential import Potential, dead_loads
from catenary.solver.statics.repeated_ends import NO_ENDS, OF_REST, ends_that_follow, settled

# Displacements change by less than this where Newton's method ends [m].
_SETTLED = 1e-9
_MOST_STEPS = 40
# A step that moves a line by more goes nowhere [m].
_FARTHEST = 1e3
# Steps at first in which droppers switch as they are, where matrices depend on the shape.
_SWITCHING = 12
# Passes in which all switch at once, before one at a time does, and the most after these.
_ALL_AT_ONCE = 40
# Forces below this are none [N]: what a dropper of 1e6 N/m pulls when it stretches by 1e-13 m.
_NO_FORCE = 1e-7
# Tensions that differ by less are one [N].
_SAME_TENSION = 1e-6


class TensionedEnd:
    """A tensioned end: whether its wheel stands, turns at an edge of its band, or is at a stop.

    Attributes
    ----------
    end : WireEnd
    unknown : number of its place along the track
    pull : force that the tensioner has while it turns, None while the end is held [N]
    held_at : place outwards at which it is held otherwise [m]
    """

    def __init__(self, model: Model, end: WireEnd) -> None:
        tensioner, wire = model.simulated.tensioner, model.problem.line.wire(end.wire)
        assert tensioner is not None
        self.end, self._travel = end, tensioner.travel
        self.unknown = int(model.dofs(np.array([end.node]), "u")[0])
        self._low, self._high = tensioner.band(end.wire, wire, model.problem.gravity)
        self._element = end.element(model.mesh)
        self._installed = float(wire.tension_at(model.mesh.middles(end.wire)[self._element]))
        self.pull = wire.tension if tensioner.turns else None
        self.held_at = 0.0

    def changes(self, form: Equilibrium) -> bool:
        """Go over to the state that follows at this rest; returns whether it is another one."""
        before = self.pull, self.held_at
        outwards = self.end.outwards * float(form.along[self.end.node])
        tension = self._installed + form.gained_tension[self.end.wire][self._element]
        if self.pull is None:
            # A stop takes up what the weights pull more, and keeps what the wire pulls more.
            if tension < self._low - _SAME_TENSION and self.held_at <= 0.0:
                self.pull = self._low
            elif tension > self._high + _SAME_TENSION and self.held_at >= 0.0:
                self.pull = self._high
        elif self._travel is not None and abs(outwards) > self._travel:
            self.held_at = float(np.copysign(self._travel, outwards))
            self.pull = None
        return (self.pull, self.held_at) != before


class Rest(NamedTuple):
    """A rest near a known one.

    Attributes
    ----------
    form : the shape, with the forces of droppers in it
    moved : (n_dofs,) displacement from the known rest [m], [rad]
    reserve : (n_droppers,) tension of droppers if they could push [N]
    gap : (n_droppers,) stretch that slack droppers lack to be taut [m], 0 for taut ones
    """

    form: Equilibrium
    moved: np.ndarray
    reserve: np.ndarray
    gap: np.ndarray


class StiffLine:
    """A line's stiffness, factored. Not collective.

    Attributes
    ----------
    model : with droppers as it has them
    matrix : K (n_dofs, n_dofs), held unknowns with a unit diagonal
    """

    def __init__(self, model: Model) -> None:
        self.model, self.matrix = model, stiffness_matrix(model)

    def moved(self, load: np.ndarray) -> np.ndarray:
        """Displacement (n_dofs,) under a load (n_dofs,) that is zero on held unknowns [m], [rad].

        Raises
        ------
        RuntimeError
            If the matrix is singular.
        """
        return np.asarray(self._factor.solve(load))

    @cached_property
    def _factor(self) -> sparse_linalg.SuperLU:
        return sparse_linalg.splu(self.matrix)


class RestNearby:
    """The search for a rest near a known one. Not collective.

    Parameters
    ----------
    potential : of the line as it is now about the known rest
    load : (n_dofs,) loads of the line less those of the former line [N], [N m]
    ends_stay : whether ends that are held along the track at the known rest remain held
    stiff : factors of a line with the same matrices, if there are any; ignored if matrices depend
        on the shape
    """

    def __init__(
        self,
        potential: Potential,
        load: np.ndarray,
        ends_stay: bool = False,
        stiff: StiffLine | None = None,
    ) -> None:
        self._potential, self._load = potential, load
        self._model = model = potential.model
        self._ends: list[TensionedEnd] = []
        if model.simulated.tensioner is not None and not ends_stay:
            self._ends = [TensionedEnd(model, end) for end in tensioned_ends(model)]
        self._bends = effects.needs_form(model.problem)
        self._lost = 1.0 - model.simulated.kept_ratio if model.simulated.slackening else 0.0
        self._switches = ~model.broken & (self._lost > 0.0)
        self._follow = NO_ENDS
        if any(model.simulated.goes_on):
            self._follow = ends_that_follow(model, self._first_loads())
        # Ends that follow are held in each turn, which they are not by other lines.
        self._stiff = None if self._follow.ends.size else stiff

    def _first_loads(self) -> np.ndarray:
        """What the line lacks to be at rest where the former one was, (n_dofs,) [N], [N m]."""
        potential = self._potential
        form = potential.form(np.zeros(self._model.n_dofs))
        reserve = form.dropper_force
        carried = self._carried(reserve, self._switches & (reserve < 0.0))
        return self._load - potential.pull(np.zeros(self._model.n_dofs), form, carried)

    def find(self) -> Rest:
        """The rest.

        Raises
        ------
        InputError
            If there is none.
        """
        potential, ends = self._potential, self._follow
        rest: Rest
        moved = np.zeros(self._model.n_dofs)
        slack = self._switches & (potential.reserve(potential.known) < -_NO_FORCE)

        def turn(values: np.ndarray) -> np.ndarray:
            nonlocal rest, moved, slack
            moved[ends.ends] = values
            rest = self._find(moved, slack)
            moved, slack = rest.moved.copy(), rest.gap > 0.0
            return rest.moved[ends.masts]

        settled(turn, np.zeros(ends.ends.size), OF_REST)
        return rest

    def _find(self, moved: np.ndarray, slack: np.ndarray) -> Rest:
        """The rest near a displacement, from droppers that are slack there, with ends that follow
        where they are."""
        model, potential = self._model, self._potential
        n = model.broken.size
        switches = self._switches
        for again in itertools.count():
            moved, form, slack = self._newton(moved, slack)
            reserve = form.dropper_force
            wrong = switches & np.where(slack, reserve > _NO_FORCE, reserve < -_NO_FORCE)
            # All ends are looked at: each goes over to the state that follows.
            turned = [end.changes(form) for end in self._ends]
            if not (wrong.any() or any(turned)):
                break
            if again > _ALL_AT_ONCE + 2 * n + 2 * len(self._ends):
                raise InputError(
                    f"the line has no static equilibrium{where(model)}: its droppers or "
                    "tensioners keep switching"
                )
            chosen = wrong if again < _ALL_AT_ONCE else np.arange(n) == np.argmax(wrong)
            slack = slack ^ (chosen & wrong)
        gap = np.where(slack, -model.dropper_slopes.stretch_under(reserve), 0.0)
        force = np.where(np.abs(reserve) < _NO_FORCE, 0.0, reserve)
        carried = self._carried(force, slack)
        held = potential.with_forces_that_hold(form, moved, carried, self._load)
        return Rest(replace(held, dropper_force=carried), moved, reserve, gap)

    def _carried(self, reserve: np.ndarray, slack: np.ndarray) -> np.ndarray:
        # Nothing is left of most slack droppers: no negative zero for tables.
        return np.where(slack, (1.0 - self._lost) * reserve, reserve) + 0.0

    def _newton(
        self, moved: np.ndarray, slack: np.ndarray
    ) -> tuple[np.ndarray, Equilibrium, np.ndarray]:
        """Displacement and shape at rest with some droppers slack, from a displacement nearby.

        Where shapes bend matrices, droppers go slack under way at first: one that pushes would
        buckle sideways.
        """
        model, potential, moved = self._model, self._potential, moved.copy()
        free = [end.unknown for end in self._ends if end.pull is not None]
        held = [end.unknown for end in self._ends if end.pull is None]
        held += self._follow.ends.tolist()
        constrained = np.union1d(np.setdiff1d(model.constrained, free), held).astype(np.int64)
        load = self._load.copy()
        for end in self._ends:
            if end.pull is None:
                already = float(self._potential.known.moved_along(end.end.node))
                moved[end.unknown] = end.end.outwards * end.held_at - already
            else:
                tension = model.problem.line.wire(end.end.wire).tension
                load[end.unknown] += end.end.outwards * (end.pull - tension)
        change, form = np.inf, potential.form(moved)
        for again in range(_MOST_STEPS):
            if self._bends and again < _SWITCHING:
                slack = self._switches & (form.dropper_force < -_NO_FORCE)
            carried = self._carried(form.dropper_force, slack)
            lacks = load - potential.pull(moved, form, carried)
            lacks[constrained] = 0.0
            about = replace(model, constrained=constrained) if self._follow.ends.size else model
            if self._bends:
                shape = replace(form, dropper_force=carried)
                about = rebuilt(
                    model, problem=self._follow.held(model.problem), form=shape, gap=None
                )
                about.constrained = constrained
            step = self._solved(about, self._softening(about, form, slack), lacks)
            change = float(np.abs(step).max())
            if not change < _FARTHEST:
                raise InputError(
                    f"the line has no static equilibrium{where(model)}: Newton's method "
                    "diverges; its wires may be slack there"
                )
            moved += step
            form = potential.form(moved)
            if change < _SETTLED or not (self._bends or model.droppers_bend):
                return moved, form, slack
        raise InputError(
            f"the line has no static equilibrium{where(model)}: it still moves by {change:.2g} "
            f"m after {_MOST_STEPS} steps of Newton's method; its wires may be slack there"
        )

    def _softening(self, about: Model, form: Equilibrium, slack: np.ndarray) -> np.ndarray:
        """Stiffness that droppers in a shape lack of that in the model, (n_droppers,) [N/m]."""
        slopes = about.dropper_slopes
        now = slopes.at(slopes.piece_under(form.dropper_force)).slope
        lost = np.where(slack, self._lost * now, 0.0)
        return np.where(about.broken, 0.0, lost + (about.dropper_stiffness - now))

    def _solved(self, about: Model, softer: np.ndarray, lacks: np.ndarray) -> np.ndarray:
        """Displacement under what is lacking (n_dofs,), by the stiffness with droppers softer.

        Infinite where that is singular.
        """
        if self._stiff is None or self._bends:
            self._stiff = StiffLine(about)
        changed = softer != 0.0
        try:
            if not changed.any():
                return self._stiff.moved(lacks)
            unknowns, weights = (part[changed] for part in about.droppers.direction)
            rows = np.repeat(np.arange(len(unknowns)), unknowns.shape[1])
            shape = len(unknowns), about.n_dofs
            spread = sparse.csr_matrix((weights.ravel(), (rows, unknowns.ravel())), shape=shape)
            free = np.ones(about.n_dofs)
            free[about.constrained] = 0.0
            spread = spread @ sparse.diags(free)
            gone = sparse.diags(softer[changed])
            matrix = (self._stiff.matrix - spread.T @ gone @ spread).tocsc()
            return np.asarray(sparse_linalg.splu(matrix).solve(lacks))
        except RuntimeError:  # of SuperLU: the matrix is singular
            return np.full(about.n_dofs, np.inf)


def where(model: Model) -> str:
    """Words on the temperature of a line without a rest, for a message; "" at that of its
    installation."""
    warmer = model.simulated.warmer
    if not warmer:
        return ""
    return f" at {abs(warmer):g} K {'above' if warmer > 0 else 'below'} its installation"


def hang(
    problem: Problem, cut: Model, form: Equilibrium, stiff: StiffLine | None = None
) -> tuple[Model, Equilibrium]:
    """The model of a line with its defects, and its equilibrium. Not collective.

    Parameters
    ----------
    problem : Problem
        Problem of the line with its defects, with all its effects.
    cut : Model
        Model of the line for which droppers were cut.
    form : Equilibrium
        Equilibrium of ``cut``; droppers that push there slacken, and others take over their force.
    stiff : StiffLine, optional
        Factors of a line, used if the matrices are the same.

    Raises
    ------
    InputError
        If a dropper would have no length, or there is no rest.
    """
    mesh, errors = cut.mesh, errors_of_length(problem, cut)
    length = cut.dropper_lengths + errors
    if (length <= 0.0).any():
        number = int(np.argmin(length))
        raise InputError(
            f"irregularities.dropper_lengths leaves the dropper at "
            f"{mesh.x(mesh.droppers[number, 1]):g} m a length of {length[number]:.3f} m: "
            "take smaller errors"
        )
    springless = _without_springs(problem)
    model = build(springless, mesh, length, form=form, cut_lengths=cut.dropper_lengths)
    potential = Potential(cut, model, form, form.dropper_length + errors)
    if stiff is not None and not same_matrices(stiff.model, model):
        stiff = None
    load = dead_loads(model) - dead_loads(cut)
    rest = RestNearby(potential, load, stiff=stiff).find()
    if model.simulated.uplift_stops:
        arms = mesh.steady_arms
        rest = rest._replace(
            form=replace(rest.form, arm_raised=rest.form.height[arms] - form.height[arms])
        )
    _refuse_slack_wires(model, rest.form)
    moved_stops = rest.form.arm_raised.any()
    depends = effects.needs_form(problem) or model.droppers_bend or springless is not problem
    if not (depends or rest.gap.any() or moved_stops):
        model.form = rest.form
        if all(map(np.array_equal, dropper_directions(model), model.droppers.direction)):
            return model, rest.form  # no matrix depends on the shape
    return rebuilt(model, problem=problem, form=rest.form, gap=rest.gap), rest.form


def _without_springs(problem: Problem) -> Problem:
    """The problem without the springs of hard spots, which carry nothing at rest."""
    defects = tuple(
        replace(defect, stiffness=0.0) if isinstance(defect, HardSpot) else defect
        for defect in problem.defects
    )
    return problem if defects == tuple(problem.defects) else replace(problem, defects=defects)


def errors_of_length(problem: Problem, cut: Model) -> np.ndarray:
    """Errors of the droppers' lengths, (n_droppers,) [m]."""
    errors, n = effects.simulated(problem).length_errors, cut.dropper_lengths.size
    if errors is None:
        return np.zeros(n)
    found = errors.of(n)
    np.add.at(
        found, cut.droppers_at([place for place, _ in errors.given]), [e for _, e in errors.given]
    )
    return found


def _refuse_slack_wires(model: Model, form: Equilibrium) -> None:
    for name, gained in form.gained_tension.items():
        middle = model.mesh.middles(name)
        left = model.problem.line.wire(name).tension_at(middle) + gained
        if left.min() <= 0.0:
            raise InputError(
                f"{name} would be slack{where(model)} (tension {left.min() + 0.0:.3g} N at "
                f"{middle[left.argmin()]:.1f} m): give its end a tensioner (line.ends, "
                "line.tensioner), or change line.temperature.difference_K"
            )
