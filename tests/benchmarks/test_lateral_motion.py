"""What lateral motion and its loads cost: the example of docs/architecture.md beside the vertical
march, in turns in one process. Run by ``make bench``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from measuring import registered
from mpi4py import MPI
from scenes import load_scene, mesh_of, problem_of
from step_cost import room

from catenary.cases.studies.effect_cost import RepeatedMarch, in_turns
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.solver.effects.effect import Effect
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.links import Direction, law
from catenary.solver.model.loads import FieldLoad, FunctionLoad, ShapeLoad, harmonics
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.wind import forces_along

PLANE = ("v", "theta_z")
WIND = 8.0  # [N/m]
# Of shipped length, and of 54 km; steps of a round, some milliseconds, and rounds.
LINES = {25: (400, 25), 1000: (60, 12)}
# At most so many times the vertical march of 25 spans, 1.2 times what was measured; a line of 1000
# waits for memory, of which loads take a part.
IN_MEMORY = 1.2
MOST = {"lateral": 1.8, "with wind": 1.9, "coupled": 2.3}
BUILDS = ("lateral", "with wind", "with a harmonic wind", "with gusts", "a function", "coupled")


def build_of(name: str) -> Callable[[ModelBuilder], None]:
    """The effect of docs/architecture.md with the load, or the springs, of that name."""

    def build(builder: ModelBuilder) -> None:
        for wire in (CONTACT_WIRE, MESSENGER_WIRE):
            builder.add_wire(wire, PLANE)
            unknowns, weights = forces_along(builder.model, wire, PLANE)
            even = weights @ np.full(weights.shape[1], WIND)
            if name == "with wind":
                builder.add_load(ShapeLoad(unknowns, even))
            elif name == "with a harmonic wind":
                builder.add_load(ShapeLoad(unknowns, even, harmonics([0.5], [1.0], [0.0])))
            elif name == "with gusts":
                points = np.arange(0.0, builder.mesh.points[:, 0].max() + 5.0, 5.0)
                unknowns, weights = forces_along(builder.model, wire, PLANE, points)
                builder.add_load(FieldLoad(unknowns, weights, 0.05, gusts(points)))
            elif name == "a function":
                builder.add_load(FunctionLoad("wind", unknowns, by_function(even)))
        builder.hold(builder.mesh.anchors, "v")
        if name == "coupled":
            couple(builder)

    return build


def by_function(even: np.ndarray) -> Callable[[float], np.ndarray]:
    return lambda time: even * np.sin(time)


def gusts(points: np.ndarray) -> Callable[[int, slice, np.ndarray], None]:
    def fill(first: int, part: slice, slices: np.ndarray) -> None:
        times = 0.05 * (first + np.arange(slices.shape[0]))
        slices[:] = WIND * np.sin(0.1 * points[part] - times[:, None])

    return fill


def couple(builder: ModelBuilder) -> None:
    """Inclined springs to the ground at arms and at the lower ends of droppers."""
    mesh, model = builder.mesh, builder.model
    nodes = np.unique(np.concatenate([mesh.steady_arms, mesh.droppers[:, 1]]))
    laws = law(mesh.x(nodes), np.full(nodes.size, 100.0))
    unknowns = np.stack([model.dofs(nodes), model.dofs(nodes, "v")], axis=1)
    weights = np.broadcast_to(np.array([0.6, 0.8]), unknowns.shape)
    builder.add_links("inclined", Direction(unknowns, weights), laws)


def march_of(n_spans: int, name: str) -> RepeatedMarch:
    scene = load_scene("ambrosio2012", [f"line.n_spans={n_spans}", *room(n_spans)])
    problem = problem_of(scene)
    effects = problem.effects if name == "vertical" else problem.effects | {"lateral"}
    effect = Effect(
        "lateral", name, "unknowns and wires", "benchmark", False,
        unknowns_of_wire=lambda wire: PLANE, build=build_of(name),
    )  # fmt: skip
    with registered(effect):
        at_rest = line_at_rest(replace(problem, effects=effects), mesh_of(scene))
        return RepeatedMarch(MPI.COMM_SELF, at_rest, n_steps=LINES[n_spans][0])


@pytest.mark.parametrize("n_spans", LINES)
def test_lateral_motion_costs_what_its_unknowns_cost(n_spans: int) -> None:
    marches = {name: march_of(n_spans, name) for name in ("vertical", *BUILDS)}
    least = in_turns(marches, LINES[n_spans][1])
    print(f"\n{n_spans} spans{'':22}{'us a step':>10}{'x vertical':>12}{'at most':>9}")
    for name, value in least.items():
        at_most = f"{MOST[name]:9.2f}" if name in MOST else ""
        print(f"{name:30}{value:10.1f}{value / least['vertical']:12.2f}{at_most}")
        marches[name].destroy()
    for name, most in MOST.items():
        allowed = most * (IN_MEMORY if n_spans > 25 else 1.0)
        assert least[name] < allowed * least["vertical"], name
