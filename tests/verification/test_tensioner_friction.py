"""A tensioner whose wheel sticks and slips in time: an oscillator with dry friction."""

from __future__ import annotations

import numpy as np
from axial_lines import AXIAL, OF_CONTACT_WIRE, elastic_wires
from measuring import check, march, registered
from small_lines import BARE, mesh_of, numerics, problem_of, train

from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.solver.effects.effect import Effect
from catenary.solver.effects.shipped.motion_effects import CREEP
from catenary.solver.kernels import native
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.loads import ShapeLoad
from catenary.solver.problem.ends import AlongTrack, Tensioner

LENGTH, DT = 60.0, 1e-3
STRAIGHT = (BARE | AXIAL) - {"structural_damping"}
ALONG = AlongTrack(Tensioner(efficiency=0.97), end=True)


def pushed(force: float, n_steps: int) -> np.ndarray:
    """Travel of the end of a straight wire that a constant force pulls outwards [m]."""

    def pull(builder: ModelBuilder) -> None:
        node = builder.mesh.wires[CONTACT_WIRE][[-1]]
        builder.add_load(ShapeLoad(builder.model.dofs(node, "u"), np.array([force])))

    effect = Effect("pull", "a pull", "a load", "test", default=False, build=pull)
    with registered(effect):
        line = elastic_wires(LENGTH)
        course = train(1.0, 30.0, 30.0 + n_steps * DT)
        own = {"along": ALONG, "train": course, "numerics": numerics(DT)}
        problem = problem_of(line, STRAIGHT | {"pull"}, **own)
        seen = march(problem, mesh_of(line, 8), lambda view: view.wire_end_travel.copy())
    return np.array(seen.watched)[:, 2]


def test_a_slipping_wheel_swings_as_dry_friction_lets_it() -> None:
    """Under a force F from rest, k = EA / L: out to 2 (F - f_out) / k, and back about the place
    (F + f_in) / k; f are what the band leaves beside the tension at rest.

    The wire adds a third of its mass, 27 kg, to the 6000 kg of the weights, and has waves of that
    share in energy: 0.5 % of a way.
    """
    force, stiffness = 3000.0, OF_CONTACT_WIRE / LENGTH
    line = elastic_wires(LENGTH)
    wire = line.contact_wire
    low, high = ALONG.tensioner.band(CONTACT_WIRE, wire, 9.81)
    out = 2.0 * (force - (wire.tension - low)) / stiffness
    back = 2.0 * (force + (high - wire.tension)) / stiffness - out
    mass = ALONG.tensioner.inertia(CONTACT_WIRE, wire, 9.81) + 27.0
    half = np.pi * np.sqrt(mass / stiffness)
    moved = pushed(force, round(2.2 * half / DT))
    first = int(np.argmax(moved))
    second = first + int(np.argmin(moved[first:]))
    check("outermost place [m]", moved[first], out, within=5e-3 * out)
    check("after [s]", first * DT, half, within=5e-3 * half)
    check("back at [m]", moved[second], back, within=5e-3 * out)
    check("after [s]", second * DT, 2.0 * half, within=5e-3 * half)


def test_a_standing_wheel_hardly_moves() -> None:
    """Half of what friction holds lets it creep, at half of the greatest speed of a wheel that
    stands; beside that the weights do not move, and the wire takes nothing of the force."""
    low, _ = ALONG.tensioner.band(CONTACT_WIRE, elastic_wires(LENGTH).contact_wire, 9.81)
    holds = elastic_wires(LENGTH).contact_wire.tension - low
    n_steps = 500
    moved = pushed(0.5 * holds, n_steps)
    print(f"crept by {1e6 * moved[-1]:.1f} um in {n_steps * DT:g} s")
    assert 0.3 * CREEP * n_steps * DT < moved[-1] < 0.5 * CREEP * n_steps * DT


def random_wheels(seed: int, wheels: int, links: int) -> tuple[np.ndarray, np.ndarray]:
    """The small problem of a step with wheels that may slip either way and links that only pull.

    Of n unknowns with a random stiffness, dampers of wheels and springs of links are in the matrix
    once; a wheel has a row for each way. Returns matrix and right-hand side.
    """
    rng = np.random.default_rng(seed)
    n = wheels + links
    mix, ways = rng.normal(size=(n, n)), rng.normal(size=(links, n))
    wheel = rng.normal(size=(wheels, n))
    damping, stiffness = 10 ** rng.uniform(0, 2, wheels), 10 ** rng.uniform(0, 2, links)
    whole = mix @ mix.T + 0.1 * np.eye(n)
    whole += wheel.T @ (damping[:, None] * wheel) + ways.T @ (stiffness[:, None] * ways)
    rows, each = (
        np.concatenate([wheel, -wheel, ways]),
        np.concatenate([damping, damping, stiffness]),
    )
    matrix = np.eye(rows.shape[0]) - each[:, None] * (rows @ np.linalg.solve(whole, rows.T))
    moved = np.linalg.solve(whole, 3.0 * rng.normal(size=n))
    right = each * (rows @ moved)
    right[: 2 * wheels] -= np.tile(0.3 * np.abs(rng.normal(size=wheels)), 2)
    return matrix, right


def test_wheels_that_slip_either_way_are_found_by_pivoting() -> None:
    """One way at most of each, with what is left over by none: of such random steps least-index
    pivoting through sets with both ways goes in circles in one of five."""
    for seed in range(300):
        wheels, links = 1 + seed % 6, seed % 9
        matrix, right = random_wheels(seed, wheels, links)
        none, found = np.zeros(right.size, dtype=bool), np.zeros(right.size)
        signs = native.Signs(none, none.astype(np.int64))
        system = native.System(right, found, matrix)
        assert native.find_solution(system, signs, 0, native.Room(right.size))[0] > 0
        left = matrix @ found - right
        rounding = 1e-9 * (1.0 + np.abs(right).max())
        assert min(found.min(), left.min()) > -rounding
        assert np.minimum(found, left).max() < rounding
        assert not (np.minimum(found[:wheels], found[wheels : 2 * wheels]) > rounding).any()
