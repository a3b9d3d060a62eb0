"""Droppers with a measured curve: a table of slopes at rest, in time and after an incident.

What they pull is looked up here by `numpy.interp` and lines beyond its ends, rest shapes are found
by `scipy.optimize.root`, and motions by `scipy.integrate.solve_ivp`.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from dense_line import DenseLine
from equations import press
from measuring import check, march, print_table
from scipy import integrate, optimize
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train
from studies import few

from catenary.meshgen.line import DropperKind, DropperPlace
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.topologies.line_data import LineData
from catenary.solver.kernels import native
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.problem.defects import LooseClamp
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.statics.form_finding import find_form

# At rest droppers of the line below carry 125 to 167 N. Of these curves the first stiffens step by
# step, as ropes do; the second is softer to both sides of rest, and stiffer again beyond.
CURVES = {
    "stiffening": ((0.0, 0.0), (2e-3, 40.0), (3e-3, 100.0), (3.8e-3, 180.0), (4e-3, 300.0)),
    "softening": ((0.0, 0.0), (1e-3, 20.0), (2e-3, 110.0), (2.4e-3, 180.0), (4e-3, 210.0),
                  (5e-3, 700.0)),
}  # fmt: skip
Law = Callable[[np.ndarray], np.ndarray]


def line_of(curve: tuple[tuple[float, float], ...] | None) -> LineData:
    """Three spans of 60 m with five droppers each."""
    return replace(
        en50318_line(3),
        dropper_positions=((6.0, 18.0, 30.0, 42.0, 54.0),) * 3,
        pre_sag=((0.0,) * 5,) * 3,
        dropper=DropperKind(None, None, 0.0, 0.0, 0.0, curve=curve),
    )


def problem_on(line: LineData, **changes: Any) -> Problem:
    """One pantograph over the middle span, strong enough to slacken droppers."""
    run = train(70.0, 62.0, 97.0, static_force=300.0, raise_time=0.0, nominal_height=5.5)
    usual = problem_of(
        line,
        WHOLE,
        damping=Damping(alpha=2e-3, beta=0.0),
        train=run,
        numerics=numerics(1e-3),
    )
    return replace(usual, **changes)


def law_of(curve: tuple[tuple[float, float], ...], length: np.ndarray, kept: float = 0.0) -> Law:
    """Tension of droppers of lengths (n,) [m] over their stretch (n,) [m]."""
    strain, tension = np.array(curve).T
    last = (tension[-1] - tension[-2]) / (strain[-1] - strain[-2])
    first = kept * tension[1] / strain[1]

    def law(stretch: np.ndarray) -> np.ndarray:
        e = stretch / length
        beyond = last * np.maximum(e - strain[-1], 0.0) + first * np.minimum(e, 0.0)
        return np.asarray(np.interp(e, strain, tension) + beyond)

    return law


def without_droppers(model: Model, **shares: float) -> np.ndarray:
    """Matrix of a line less the part of its droppers, dense."""
    matrix = whole_matrix(model, **shares).toarray()
    worth = shares.get("stiffness", 0.0) * model.dropper_stiffness
    worth = worth + shares.get("damping", 0.0) * model.dropper_damping
    for (upper, lower), k in zip(model.dofs(model.mesh.droppers), worth, strict=True):
        ends = np.ix_([upper, lower], [upper, lower])
        matrix[ends] -= k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    held = np.isin(np.arange(model.n_dofs), model.constrained)
    matrix[held], matrix[:, held] = 0.0, 0.0
    return np.asarray(matrix)


def stretch_at_rest(curve: tuple[tuple[float, float], ...], form: Equilibrium,
                    length: np.ndarray) -> np.ndarray:  # fmt: skip
    """By which each is stretched at rest, by bisection [m]."""
    found = [
        optimize.brentq(lambda e, own=own, n=n: law_of(curve, own)(e) - n, 0.0, own, xtol=1e-16)
        for own, n in zip(length, form.dropper_force, strict=True)
    ]
    return np.array(found)


@functools.cache
def at_rest(name: str) -> tuple[Problem, LineMesh, Model, Equilibrium]:
    line = line_of(CURVES[name])
    mesh, problem = mesh_of(line, 2), problem_on(line)
    return problem, mesh, *find_form(problem, mesh)


@pytest.mark.parametrize("name", CURVES)
def test_droppers_are_cut_for_the_stretch_that_the_curve_gives_their_tension(name: str) -> None:
    _, mesh, _, form = at_rest(name)
    upper, lower = mesh.droppers.T
    apart = form.height[upper] - form.height[lower]
    stretch = stretch_at_rest(CURVES[name], form, form.dropper_length)
    # Lengths settle within 1e-10 m.
    check("lengths [m]", form.dropper_length + stretch, apart, within=1e-10)
    pieces = np.searchsorted([n for _, n in CURVES[name]], form.dropper_force)
    print(f"at rest with {form.dropper_force.min():.0f} to {form.dropper_force.max():.0f} N")
    assert set(pieces) == {3}


@pytest.mark.parametrize("name", CURVES)
def test_a_line_with_a_loose_dropper_has_the_rest_that_root_finding_gives(name: str) -> None:
    """Neighbours of a loose dropper carry its part, on another piece of their curve."""
    problem, mesh, model, form = at_rest(name)
    gone = 7
    place = float(mesh.x(mesh.droppers[gone, 1]))
    hung = replace(
        problem,
        effects=problem.effects | {"loose_clamp"},
        defects=(LooseClamp(DropperPlace(place)),),
    )
    _, found = find_form(hung, mesh)
    law = law_of(CURVES[name], form.dropper_length)
    rest = stretch_at_rest(CURVES[name], form, form.dropper_length)
    bare = without_droppers(model, stiffness=1.0)
    bare[model.constrained, model.constrained] = 1.0
    ends = np.zeros((len(rest), model.n_dofs))
    every = np.arange(len(rest))
    ends[every, model.dofs(mesh.droppers[:, 0])] = 1.0
    ends[every, model.dofs(mesh.droppers[:, 1])] = -1.0
    give = ends @ np.linalg.solve(bare, ends.T)

    def left(tension: np.ndarray) -> np.ndarray:
        pulls = law(rest - give @ (tension - form.dropper_force))
        pulls[gone] = 0.0
        return np.asarray(tension - pulls)

    solved = optimize.root(left, form.dropper_force, method="hybr", tol=1e-13)
    assert np.abs(left(solved.x)).max() < 1e-8
    moved = np.abs(solved.x - form.dropper_force)
    assert (np.searchsorted([n for _, n in CURVES[name]], solved.x) != 3).sum() > 1
    print(f"forces change by up to {moved.max():.1f} N")
    check("forces at rest [N]", found.dropper_force, solved.x, within=1e-6)


class Springs:
    """What droppers do in a line's motion, about its rest."""

    def __init__(self, name: str, kept: float = 0.0) -> None:
        _, self.mesh, self.model, self.form = at_rest(name)
        self.rest = stretch_at_rest(CURVES[name], self.form, self.form.dropper_length)
        self.law = law_of(CURVES[name], self.form.dropper_length, kept)
        self.ends = self.model.dofs(self.mesh.droppers)
        linear = self.model.dropper_stiffness > 0.0
        self.alpha = np.zeros(linear.size)
        self.alpha[linear] = (
            self.model.dropper_damping[linear] / self.model.dropper_stiffness[linear]
        )

    def stretch(self, moved: np.ndarray) -> np.ndarray:
        """(n,) of displacements (n_dofs,) [m]."""
        return np.asarray(moved[self.ends[:, 0]] - moved[self.ends[:, 1]])

    def tension(self, moved: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """(n,) [N]: dampers stretch the curve, so that they go with its slopes."""
        at = self.rest + self.stretch(moved) + self.alpha * self.stretch(velocity)
        return self.law(at)

    def add_pull(self, total: np.ndarray, tension: np.ndarray) -> None:
        """Add what they pull beside rest to forces on the line (n_dofs,) [N]."""
        np.add.at(total, self.ends[:, 0], tension - self.form.dropper_force)
        np.subtract.at(total, self.ends[:, 1], tension - self.form.dropper_force)

    def pieces(self, name: str, tension: np.ndarray) -> np.ndarray:
        """On which piece of the curve tensions are."""
        return np.searchsorted([n for _, n in CURVES[name]], tension)


WAYS: dict[str, dict[str, Any]] = {
    "implicit": {},
    "iterated": {"coupling": "iterated"},
    "explicit": {"coupling": "explicit"},
    "generalized alpha": {"integrator": "generalized_alpha", "spectral_radius": 0.6},
    "newmark 0.6": {"gamma": 0.6, "beta": 0.3025},
    "fixed point": {"scheme": "fixed_point"},
    "adaptive": {"adaptive_tolerance": 0.5, "smallest_dt": 2.5e-4},
}


@pytest.mark.parametrize("name", few(CURVES, "softening"))
@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_every_scheme_satisfies_the_law(name: str, way: dict[str, Any]) -> None:
    """Each state satisfies the equation of motion with tensions looked up in the curve."""
    problem, mesh, model, _ = at_rest(name)
    springs = Springs(name)
    seen = march(
        replace(problem, numerics=numerics(1e-3, **way)), mesh, lambda view: view.checkpoint()
    )
    mass, damping, bare = (
        without_droppers(model, **{what: 1.0}) for what in ("mass", "damping", "stiffness")
    )
    left, shown, on = 0.0, 0.0, []
    for step, state in enumerate(seen.watched[1:], start=1):
        u, v, a = (state[what] for what in ("displacement", "velocity", "acceleration"))
        tension = springs.tension(u, v)
        residual = mass @ a + damping @ v + bare @ u
        springs.add_pull(residual, tension)
        press(residual, model, seen["contact_position"][step, 0], seen["contact_force"][step, 0])
        left = max(left, np.abs(residual).max())
        shown = max(shown, np.abs(tension - seen["dropper_force"][step]).max())
        on.append(springs.pieces(name, tension))
    counts = np.bincount(np.concatenate(on))
    print(f"droppers on each piece, slack first: {counts}")
    assert (counts[: len(CURVES[name])] > 10).all()
    # The correction stops when displacements change by eps_d and velocities by eps_v.
    steepest = float(model.dropper_slopes.slope.max())
    loose = steepest * (1e-13 + 2e-3 * 1e-10) if "scheme" in way else 0.0
    check("residual of motion [N]", left, 0.0, within=1e-7 + loose)
    check("forces of droppers [N]", shown, 0.0, within=1e-7 + loose)


@pytest.mark.parametrize(
    ("name", "kept"),
    [pytest.param("stiffening", 0.0, marks=pytest.mark.study), ("softening", 0.1)],
)
def test_a_run_is_that_of_an_integrator_of_others(name: str, kept: float) -> None:
    """Steps of average acceleration come to the motion with an error of order dt^2.

    `solve_ivp` integrates matrices that are made here, looking tensions up, with steps that it
    chooses, from heads that start below the wire until after its first loss of contact.
    """
    problem, mesh, _, form = at_rest(name)
    if kept:
        own = problem.effects | {"residual_dropper_stiffness"}
        problem = replace(problem, effects=own, residual_stiffness_ratio=kept)
    springs = Springs(name, kept)
    linear = replace(line_of(None), dropper=DropperKind(1.0, None, 0.0, 0.0, 0.0))
    dense = DenseLine(problem_on(linear), mesh, form, False)
    pull, rest = dense.pull, form.dropper_force
    mass, damping, stiffness = dense.matrices
    stiffness, damping = stiffness - pull.T @ pull, damping - dense.alpha * pull.T @ pull
    free, size = dense.free, dense.size
    by_mass = np.linalg.inv(mass[np.ix_(free, free)])

    def tension(d: np.ndarray, v: np.ndarray) -> np.ndarray:
        return springs.law(springs.rest + pull @ d + dense.alpha * (pull @ v))

    def rate(time: float, state: np.ndarray) -> np.ndarray:
        d, v = np.zeros((2, size))
        d[free], v[free] = np.split(state, 2)
        along, at_rest = dense.meets(62.0 + 70.0 * time)
        force = 5e4 * max(0.0, along @ d + at_rest)
        load = dense.load - damping @ v - stiffness @ d - force * along
        load -= pull.T @ (tension(d, v) - rest)
        return np.concatenate([v[free], by_mass @ load[free]])

    def seen_with(dt: float, watch: Any = None) -> Any:
        run = replace(problem.train, end=79.5, start_below=0.02)
        return march(replace(problem, train=run, numerics=numerics(dt)), mesh, watch)

    begin = seen_with(1e-3, lambda view: view.checkpoint() if view.step == 0 else None).watched[0]
    state = np.zeros((2, size))
    state[:, -2:] = begin["pantograph_0"].reshape(3, 2)[:2]
    times = np.arange(0.0, 0.2451, 5e-3)
    exact = integrate.solve_ivp(
        rate, (0.0, 0.25), state[:, free].ravel(), method="DOP853", t_eval=times, rtol=1e-8,
        atol=1e-10,
    )  # fmt: skip
    d, v = np.zeros((2, times.size, size))
    d[:, free], v[:, free] = np.split(exact.y.T, 2, axis=1)
    expected = np.array([tension(*now) for now in zip(d, v, strict=True)])
    met = np.bincount(springs.pieces(name, expected).ravel())
    print(f"droppers on each piece, slack first: {met}")
    assert np.count_nonzero(met) > 4
    errors, steps = [], [2e-4, 1e-4, 5e-5]
    for dt in steps:
        rows = np.rint(times / dt).astype(int)
        found = seen_with(dt)["dropper_force"][rows]
        errors.append(float(np.abs(found - expected).max()))
    observed = print_table("forces of droppers [N]", steps, errors)
    # Steps in which droppers come to another slope scatter about it.
    assert observed.mean() > 1.7
    assert errors[-1] < 1e-4 * np.abs(expected - rest).max()


@pytest.mark.study
@pytest.mark.parametrize("name", [pytest.param("stiffening", marks=pytest.mark.study), "softening"])
def test_energy_is_that_of_the_curve_and_balanced_by_work(name: str) -> None:
    """Without damping, what the line holds is the integral of its curves, and what it gains the
    work of the contact force, but for steps in which a dropper comes to another slope: there the
    mean force is off by up to half the change of slope times the change of stretch."""
    problem, mesh, model, form = at_rest(name)
    problem = replace(problem, damping=Damping(0.0, 0.0), numerics=numerics(2.5e-4))
    shown: list[tuple[Any, Any]] = []
    seen = march(problem, mesh, lambda view: shown.append((view.energies(), view.checkpoint())))
    springs = Springs(name)
    springs.alpha[:] = 0.0
    mass, bare = (without_droppers(model, **{what: 1.0}) for what in ("mass", "stiffness"))
    stored = [stored_by(CURVES[name], own) for own in form.dropper_length]
    at_first = sum(energy(at) for energy, at in zip(stored, springs.rest, strict=True))
    held, works, allowed, before = [], [0.0], 0.0, None
    for step, (_, state) in enumerate(shown):
        u, v = state["displacement"], state["velocity"]
        e = springs.stretch(u)
        now = sum(energy(at) for energy, at in zip(stored, springs.rest + e, strict=True))
        of_droppers = now - at_first - form.dropper_force @ e
        held.append(0.5 * (v @ mass @ v + u @ bare @ u) + of_droppers)
        tension = springs.tension(u, v)
        load = np.zeros(model.n_dofs)
        press(load, model, seen["contact_position"][step, 0], seen["contact_force"][step, 0])
        if before is not None:
            u_before, load_before, e_before, piece = before
            works.append(works[-1] - 0.5 * float((load + load_before) @ (u - u_before)))
            on_other = springs.pieces(name, tension) != piece
            stiffest = model.dropper_slopes.slope.max(axis=1)
            allowed += float((0.5 * stiffest * (e - e_before) ** 2)[on_other].sum())
        before = u, load, e, springs.pieces(name, tension)
    energy = np.array([sum(pair) for pair, _ in shown])
    size = np.abs(energy - energy[0]).max()
    check("energy held [J]", energy - energy[0], np.array(held) - held[0], within=1e-9 * size)
    check("work [J]", energy - energy[0], works, within=allowed + 1e-9 * size)
    assert allowed < 0.1 * size


def stored_by(curve: tuple[tuple[float, float], ...], length: float) -> Callable[[float], float]:
    """What a dropper stores over its stretch [J], by quadrature between the points."""
    law = law_of(curve, np.array([length]))
    points = np.array([strain * length for strain, _ in curve])

    def energy(stretch: float) -> float:
        inside = points[(points > 0.0) & (points < stretch)]
        edges = np.concatenate([[0.0], inside, [max(stretch, 0.0)]])
        # Exact on each piece: the mean of its ends' forces.
        forces = law(edges)
        return float((0.5 * (forces[1:] + forces[:-1]) * np.diff(edges)).sum())

    return energy


def test_a_curve_of_one_slope_is_an_axial_stiffness_bit_for_bit() -> None:
    stiff = 5e4
    straight = ((0.0, 0.0), (2.0**-9, stiff * 2.0**-9))
    line = line_of(None)
    by_stiffness = replace(line, dropper=replace(line.dropper, axial_stiffness=stiff))
    found = [march(problem_on(one), mesh_of(one, 2)) for one in (by_stiffness, line_of(straight))]
    assert (found[0]["dropper_force"] == 0.0).any()
    for channel in ("contact_force", "dropper_force", "arm_uplift"):
        assert np.array_equal(found[0][channel], found[1][channel])


def test_without_slackening_droppers_keep_the_slope_that_they_have_at_rest() -> None:
    """All is linear then, as studies of stability need it: each more force adds the same."""
    problem, mesh, _, _ = at_rest("softening")
    tied = replace(problem, effects=problem.effects - {"dropper_slackening", "contact_loss"})
    found = []
    for force in (100.0, 300.0, 500.0):
        placed = tuple(replace(p, static_force=force) for p in tied.train.placements)
        run = replace(tied.train, placements=placed, raise_time=0.2)
        found.append(march(replace(tied, train=run), mesh)["dropper_force"])
    first, second = np.diff(found, axis=0)
    assert (found[2] < 0.0).any() and (np.searchsorted([20.0, 110.0, 180.0], found[2]) != 2).any()
    check("more force [N]", second, first, within=1e-8 * np.abs(first).max())


def test_links_with_any_rising_tables_of_slopes_find_their_pieces() -> None:
    """Random springs A, and links with tables that stiffen and soften in turns: where the active
    set cycles, pivoting goes from piece to piece. Forces are looked up in the tables."""
    rng, cycled = np.random.default_rng(7), 0
    for _ in range(3000):
        n_links = int(rng.integers(1, 6))
        n = n_links + int(rng.integers(0, 4))
        spread = rng.normal(size=(n, n))
        springs = spread @ spread.T + np.eye(n) * 10.0 ** rng.uniform(-2, -1)
        along = rng.normal(size=(n_links, n))
        stiff, rows, tables, at_rest_slope = 10.0 ** rng.uniform(-1, 3), [], [], []
        for link in range(n_links):
            slope = stiff * 10.0 ** rng.uniform(-2.5, 0.0, size=int(rng.integers(2, 6)))
            slope[0] *= rng.integers(0, 2)
            place = np.sort(rng.normal(size=slope.size - 1))
            piece = int(rng.integers(1, slope.size))
            place -= place[piece - 1] + 1e-3
            place[piece:] += 0.01
            side = np.where(np.arange(place.size) < piece, -1.0, 1.0)
            rows += [(link, *bend) for bend in zip(place, side, side * np.diff(slope), strict=True)]
            tables.append((place, slope, piece))
            at_rest_slope.append(slope[piece])
        link, place, side, change = np.array(rows).T
        own = np.sign(change * side)[:, None] * along[link.astype(int)]
        whole = springs + along.T @ np.diag(at_rest_slope) @ along
        load = rng.normal(size=n) * stiff * 10.0 ** rng.uniform(-1, 1)
        reserve = side * np.abs(change) * place - change * (own @ np.linalg.solve(whole, load))
        coupling = -change[:, None] * (own @ np.linalg.solve(whole, own.T))
        matrix, found = np.eye(place.size) - coupling, np.zeros(place.size)
        signs = native.Signs(np.zeros(place.size, dtype=bool), np.zeros(place.size, dtype=np.int64))
        system = native.System(-reserve, found, matrix)
        rounds, pivoted = native.find_solution(system, signs, 30, native.Room(place.size))
        assert rounds > 0
        cycled += pivoted
        moved = np.linalg.solve(whole, load - own.T @ found)
        pulled = along.T @ [
            looked_up(*table, e) for table, e in zip(tables, along @ moved, strict=True)
        ]
        size = np.abs(springs) @ np.abs(moved) + np.abs(load)
        # Round-off of the small problem in terms of its condition, up to 1e5 here.
        assert np.abs(springs @ moved + pulled - load).max() < 1e-8 * size.max()
    print(f"{cycled} active sets cycled")
    assert cycled > 30


def looked_up(place: np.ndarray, slope: np.ndarray, piece: int, stretch: float) -> float:
    """Force of a link without any at rest, by quadrature of its slopes."""
    edges = np.sort([*place[(place > min(stretch, 0)) & (place < max(stretch, 0))], 0.0, stretch])
    middle = 0.5 * (edges[1:] + edges[:-1])
    area = float(slope[np.searchsorted(place, middle)] @ np.diff(edges))
    return np.sign(stretch) * area
