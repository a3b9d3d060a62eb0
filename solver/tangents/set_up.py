"""Set-up of a march as numbers, and its derivatives by a parameter.

A march depends on a parameter through its set-up only: matrices and links of the line, the wires'
shape at rest, heads, contact law, train. These are differentiated here by central differences of
set-ups, which cost no march; `tangents.march` takes the derivatives through the march without a
further approximation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from catenary.base.errors import InputError
from catenary.mbs.head.pantograph import SteppedHead
from catenary.mbs.interface import N_DRIVE, drive_width, drives_by_name
from catenary.mbs.lumped import LumpedPantograph
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.contact.pantographs import Pantographs, nominal_height_rule
from catenary.solver.contact_problem.law_tangents import law_in_steps
from catenary.solver.kernels import native
from catenary.solver.model.loads import FieldLoad, FunctionLoad, MemoryLoad, ShapeLoad
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.model.model import Model
from catenary.solver.model.partition import distribute
from catenary.solver.model.switching_links import LinkTable, switching_links
from catenary.solver.problem.contact_laws import HertzLaw
from catenary.solver.problem.problem import Numerics, steps_of
from catenary.solver.statics.line_at_rest import LineAtRest

# Numbers that differ by so many roundings of themselves are equal.
_ROUNDINGS = 64.0 * float(np.finfo(float).eps)
# Damping is proportional if no more than such a part of it is not.
_PROPORTIONAL = 1e-9
# Derivatives that differ by no more than such a part are the same: set-ups know no more.
_SAME = 1e-9
_NO_STEP = native.LinearStep(np.zeros((0, 0)), np.zeros(0), np.zeros(0), np.zeros((0, 0)))
_MATRICES = ("stiffness", "damping", "mass")


@dataclass(frozen=True)
class SetUp:
    """A march before its first step, in SI units.

    Attributes
    ----------
    matrices : K, C and M of the line, without rows and columns of held unknowns
    rest : (n_nodes, 2) height [m] and slope [-] of the contact wires' nodes at rest
    links : (n_links, 3) rest [N], stiffness [N/m] and damping [N s/m] of the laws of links
    weights : (n_links, m) of their directions
    heads : each pantograph: the step of a linear chain, of others the model itself
    states : (3 n,) of each at the start
    drives : (n_steps, n_pantographs, width) what their steps depend on besides
    law : (4, n_contacts) own, offset, by_depth and by_rate of the contact law; of a Hertzian law
        zero
    hertz : (4,) K, n, chi and least speed of a Hertzian law, else empty
    start : (n_contacts,) places of the contacts at the start [m]
    speed : of the train [m/s]
    follows_surface : whether contacts follow raked strips or an irregular running surface
    fixed : arrays that a differentiable parameter must not change, by their names in sentences
    """

    matrices: tuple[sparse.csc_matrix, ...]
    rest: np.ndarray
    links: np.ndarray
    weights: np.ndarray
    heads: Sequence[native.LinearStep | SteppedHead]
    states: Sequence[np.ndarray]
    drives: np.ndarray
    law: np.ndarray
    hertz: np.ndarray
    start: np.ndarray
    speed: float
    follows_surface: bool
    fixed: dict[str, np.ndarray]


class MatrixTerm(NamedTuple):
    """A derivative of matrices, which is multiplied with a sum of the line's motion.

    Attributes
    ----------
    rows : (m,) numbers of the rows that have any
    begin : (m + 1,) where each begins
    columns, values : of all
    weights : of displacements, velocities and accelerations in the sum
    """

    rows: np.ndarray
    begin: np.ndarray
    columns: np.ndarray
    values: np.ndarray
    weights: tuple[float, float, float]


@dataclass(frozen=True)
class Change:
    """Derivatives of a set-up by one parameter, per unit of it: as ``SetUp``, of each head with its
    state; parts that do not change are empty."""

    matrices: Sequence[MatrixTerm]
    rest: np.ndarray
    links: np.ndarray
    weights: np.ndarray
    heads: Sequence[native.HeadChange]
    drives: np.ndarray
    law: np.ndarray
    hertz: np.ndarray
    start: np.ndarray
    speed: float

    @property
    def loads_line(self) -> bool:
        """Whether the march's motion or forces load the tangent's line."""
        parts = len(self.matrices), self.weights.size, self.start.size, self.speed
        return any(parts)


def set_up_of(
    comm: Any,
    at_rest: LineAtRest,
    n_steps: int | None = None,
    same_line: SetUp | None = None,
) -> SetUp:
    """Set-up of a march from a line at rest. Not collective: one process.

    Parameters
    ----------
    comm : mpi4py communicator
        Communicator of this process alone.
    at_rest : LineAtRest
        Line at rest.
    n_steps : int, optional
        Number of steps for which drives are computed; all steps of the run if not given.
    same_line : SetUp, optional
        Set-up of another march of the same line at rest, whose matrices are taken over.

    Raises
    ------
    InputError
        If the march has parts whose derivatives are not taken.
    """
    problem, model, form, lift = at_rest
    simulated = model.simulated
    _refuse(at_rest)
    wires = ContactWires(model, form, distribute(model, 1, 0))
    height = nominal_height_rule(problem, simulated, wires, lift)
    pantographs = Pantographs(comm, problem, simulated, wires, height)
    heads = [_stepped(model) for model in pantographs.models]
    if pantographs.lateral and any(head.is_crossed for head in heads):
        raise InputError(
            "a march with heads that roll under wires which move across the track is not "
            "differentiated; set effects.head_roll = false"
        )
    n_steps = steps_of(problem) if n_steps is None else n_steps
    drives = np.zeros((n_steps, pantographs.n, drive_width(pantographs.most_contacts)))
    times = np.arange(1, n_steps + 1) * problem.numerics.dt
    pantographs.fill_drives(times, drives)
    law = law_in_steps(problem, simulated, pantographs.n_contacts)
    hertz = np.zeros(0)
    if isinstance(simulated.contact, HertzLaw):
        own = simulated.contact
        hertz = np.array([own.stiffness, own.exponent, own.hysteresis, own.least_speed])
    links = switching_links(model, form.dropper_force)
    laws = links.arrays.law
    return SetUp(
        matrices=same_line.matrices
        if same_line is not None
        else tuple(whole_matrix(model, **{name: 1.0}) for name in _MATRICES),
        rest=wires.nodes["rest"].astype(float),
        links=np.stack([laws["rest"], laws["stiffness"], laws["damping"]], axis=1),
        weights=links.arrays.weights,
        heads=[
            head.linear_step() if isinstance(head, LumpedPantograph) and head.is_linear else head
            for head in heads
        ],
        states=[head.state()[: 3 * head.position.size] for head in heads],
        drives=drives,
        law=np.stack(law.tangents),
        hertz=hertz,
        start=pantographs.places_along.start[: pantographs.n_contacts].copy(),
        speed=float(problem.train.speed),
        follows_surface=bool(pantographs.places_along.leads.contact.size)
        or bool(wires.shapes.surface.size),
        fixed=_fixed_of(model, problem.numerics, links, wires, drives)
        | {"how contact forces act on heads": np.concatenate([head.levers for head in heads])},
    )


def _fixed_of(
    model: Model, numerics: Numerics, links: LinkTable, wires: ContactWires, drives: np.ndarray
) -> dict[str, np.ndarray]:
    """Parts of a set-up that a parameter must not change, by their names in sentences."""
    laws = links.arrays.law
    return {
        "the number of unknowns": np.array([model.n_dofs, model.n_unknowns]),
        "places of nodes": wires.nodes["x"].copy(),
        "places of droppers and other links": laws["place"],
        "which links there are": np.stack([links.component, links.index, links.leader, links.bent]),
        "which links are taut at rest, or what slack ones keep": np.stack(
            [laws["released"], laws["carried"], links.broken]
        ),
        "the time step or Newmark's parameters": np.array(
            [numerics.dt, numerics.beta, numerics.gamma]
        ),
        "loads in time": _loads(model),
        "where wires cross the strips": drives[:, :, N_DRIVE:].ravel(),
        "the running surface": wires.shapes.surface["height"],
    }


def differentiate(set_up: Callable[[float], SetUp], now: SetUp, step: float, what: str) -> Change:
    """Derivatives of a set-up by a parameter, as central differences. Not collective.

    Their error is a sixth of step^2 of the set-up's third derivative, and the round-off of the
    set-up over the step.

    Parameters
    ----------
    set_up : callable
        Function that gives the set-up with the parameter changed by its argument.
    now : SetUp
        The set-up of the march.
    step : float
        Change of the parameter to either side.
    what : str
        Name of the parameter, for messages.

    Raises
    ------
    InputError
        If the parameter changes a part of the set-up without derivative, such as the mesh.
    """
    below, above = sides = set_up(-step), set_up(step)
    for other in sides:
        for name, values in now.fixed.items():
            mine = other.fixed[name]
            if mine.shape != values.shape or not np.allclose(mine, values, rtol=1e-9, atol=1e-9):
                raise InputError(
                    f"{what} changes {name}, by which a march has no derivative here; take it away"
                )

    def of(part: Callable[[SetUp], Any]) -> np.ndarray:
        return derivative(np.asarray(part(below)), np.asarray(part(above)), step)

    def or_none(values: np.ndarray) -> np.ndarray:
        """Without rows where nothing changes."""
        return np.ascontiguousarray(values if values.any() else values[:0])

    def or_one(values: np.ndarray) -> np.ndarray:
        """Of one step if they are the same in all, as a force is that a nominal height changes."""
        middle = 0.5 * (values.min(axis=0) + values.max(axis=0))
        is_same = (np.ptp(values, axis=0) <= _SAME * np.abs(middle)).all()
        return or_none(middle[None] if is_same else values)

    drives = of(lambda one: one.drives)

    def of_head(number: int) -> native.HeadChange:
        state, linear = of(lambda one: one.states[number]), now.heads[number]
        if not isinstance(linear, native.LinearStep):
            models = [head for side in sides if isinstance(head := side.heads[number], SteppedHead)]
            if models[0].steps_as(models[1]):
                # A base elsewhere is a base that is raised.
                lower, upper = (np.array(model.base_height) for model in models)
                drives_by_name(drives[:, number])["base"] += derivative(lower, upper, step)
                models = []
            beside = [model.stepped for model in models]
            return native.HeadChange(*_NO_STEP, state, beside, step)
        parts = [
            of(lambda one, name=name: getattr(one.heads[number], name))  # type: ignore[misc]
            for name in linear._fields
        ]
        own = native.LinearStep(*map(np.ascontiguousarray, parts))
        own = own if any(part.any() for part in parts) else _NO_STEP
        return native.HeadChange(*own, state, [], step)

    start, speed = or_none(of(lambda one: one.start)), float(of(lambda one: one.speed))
    if (start.size or speed) and now.follows_surface:
        raise InputError(
            f"{what} moves the contacts, by which a march has no derivative where strips are raked "
            "or contact wires have an irregular running surface"
        )
    heads = [of_head(number) for number in range(len(now.heads))]
    terms: list[MatrixTerm] = []
    if any(side.matrices is not now.matrices for side in sides):
        terms = _matrices(below.matrices, above.matrices, now.matrices, step)
    parts = {
        name: or_none(of(attrgetter(name))) for name in ("rest", "links", "weights", "law", "hertz")
    }
    drives = or_one(drives)
    return Change(terms, heads=heads, drives=drives, start=start, speed=speed, **parts)


def derivative(below: np.ndarray, above: np.ndarray, step: float) -> np.ndarray:
    """A derivative as a central difference.

    Parameters
    ----------
    below, above : ndarray
        What is differentiated, with the parameter a step lower and higher; of one shape.
    step : float
        Step of the parameter.

    Returns
    -------
    ndarray
        Of the same shape; zero if the values differ by round-off only.
    """
    change = above - below
    largest = max(float(np.abs(values).max(initial=0.0)) for values in (below, above))
    if float(np.abs(change).max(initial=0.0)) <= _ROUNDINGS * largest:
        return np.zeros_like(change)
    return np.asarray(change / (2.0 * step))


def _matrices(
    below: Sequence[sparse.csc_matrix],
    above: Sequence[sparse.csc_matrix],
    now: Sequence[sparse.csc_matrix],
    step: float,
) -> list[MatrixTerm]:
    """Derivatives of K, C and M by the parameter, from those a step below and above it."""
    stiffness, damping, mass = (
        _derivative(*sides, step) for sides in zip(below, above, strict=True)
    )

    def left_by(shares: Sequence[float]) -> sparse.csc_matrix:
        return damping - shares[0] * stiffness - shares[1] * mass

    # Most parameters leave the factors of damping as they are.
    for matrices in (now, (stiffness, damping, mass)):
        shares = _shares(matrices[1], matrices[0], matrices[2])
        if abs(left_by(shares)).max() <= _PROPORTIONAL * abs(damping).max():
            terms = [(stiffness, 1.0, shares[0], 0.0), (mass, 0.0, shares[1], 1.0)]
            break
    else:
        terms = [(stiffness, 1.0, 0.0, 0.0), (mass, 0.0, 0.0, 1.0), (damping, 0.0, 1.0, 0.0)]
    return [_term(matrix.tocsr(), by) for matrix, *by in terms if matrix.nnz]


def _derivative(
    below: sparse.csc_matrix, above: sparse.csc_matrix, step: float
) -> sparse.csc_matrix:
    """Derivative of a matrix, zero where its change is round-off of the entry."""
    change = above - below
    derivative = change.multiply(abs(change) > _ROUNDINGS * abs(above)).tocsc() / (2.0 * step)
    derivative.eliminate_zeros()
    return derivative


def _shares(whole: sparse.csc_matrix, *parts: sparse.csc_matrix) -> list[float]:
    """Least-squares factors of ``parts`` whose sum approximates ``whole``; small ones are zero.

    They are rounded to digits beyond ``_PROPORTIONAL``, so that different parameters get equal
    factors and their tangents share sums of motions.
    """
    sizes = [float(np.sqrt(part.multiply(part).sum())) or 1.0 for part in parts]
    scaled = [part / size for part, size in zip(parts, sizes, strict=True)]
    products = np.array([[float(one.multiply(two).sum()) for two in scaled] for one in scaled])
    right = np.array([float(one.multiply(whole).sum()) for one in scaled])
    found = np.linalg.lstsq(products, right, rcond=None)[0]
    found[np.abs(found) <= _PROPORTIONAL * np.linalg.norm(found)] = 0.0
    return [float(f"{share / size:.9e}") for share, size in zip(found, sizes, strict=True)]


def _term(matrix: sparse.csr_matrix, by: Sequence[float]) -> MatrixTerm:
    matrix.sort_indices()
    rows = np.flatnonzero(np.diff(matrix.indptr)).astype(np.int64)
    begin = np.append(matrix.indptr[rows], matrix.nnz).astype(np.int64)
    columns, weights = matrix.indices.astype(np.int64), (by[0], by[1], by[2])
    return MatrixTerm(rows, begin, columns, matrix.data, weights)


def _stepped(model: Any) -> SteppedHead:
    if isinstance(model, SteppedHead) and not (model.is_regulated or model.is_lowered):
        return model
    raise InputError(
        "a pantograph has all its bodies in the time loop, is lowered, or its lift is regulated: "
        "of such a march there are no derivatives"
    )


def _loads(model: Model) -> np.ndarray:
    """Numbers of loads in time: those of shapes, and of fields their weights and first slices."""
    found = [np.zeros(0)]
    for load in model.loads:
        if isinstance(load, ShapeLoad):
            found += [load.forces, load.factor.numbers]
        elif isinstance(load, FieldLoad):
            slices = np.zeros((2, load.weights.shape[1]))
            load.fill(0, slice(0, slices.shape[1]), slices)
            found += [load.weights.data, slices.ravel()]
    return np.concatenate(found)


def _refuse(at_rest: LineAtRest) -> None:
    """Refuse a march with parts whose derivatives are not taken."""
    problem, simulated = at_rest.problem, at_rest.model.simulated
    numerics = problem.numerics
    lacking = {
        'numerics.scheme other than "one_solve"': numerics.scheme != "one_solve",
        'numerics.coupling other than "implicit"': numerics.coupling != "implicit",
        'numerics.integrator other than "newmark"': numerics.integrator != "newmark",
        "steps that adapt": numerics.adaptive_tolerance is not None,
        "incidents": bool(simulated.incidents),
        "a window that moves with the train": problem.window.moves,
        "ends that go on": any(isinstance(load, MemoryLoad) for load in at_rest.model.loads),
        "loads that a function in Python gives": any(
            isinstance(load, FunctionLoad) for load in at_rest.model.loads
        ),
    }
    for what, has in lacking.items():
        if has:
            raise InputError(f"a march with {what} is not differentiated")
