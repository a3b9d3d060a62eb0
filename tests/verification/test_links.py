"""Links of further kinds: stops with a gap, props, leaning links between nodes that go slack.

A march with them is held against dense matrices with every set of switched links tried, and its
energy against the work of the contact force.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from dense_line import DenseLine, DenseLink
from measuring import History, check, march, registered, start_march
from monolithic_system import WholeSystem
from scipy import sparse
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train
from stops import (
    BELOW,
    FALL,
    GAP,
    LEANING,
    LEANING_LINKS,
    SOFT,
    STIFFNESS,
    STOP_FORCE,
    STOPS,
    UPLIFT_STOP,
)

from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE, LineMesh
from catenary.solver.effects.effect import Effect
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.link_directions import at_nodes
from catenary.solver.model.links import BOTH, NO_BENDS, PULLS, PUSHES, Bends, law
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.statics.form_finding import find_form
from catenary.solver.time_loop import march as time_loop
from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.observers import NEVER, Observer, StepView

KINDS = (UPLIFT_STOP, LEANING_LINKS)


@pytest.fixture(autouse=True)
def kinds(monkeypatch: pytest.MonkeyPatch) -> Any:
    with ExitStack() as stack:
        for kind in KINDS:
            stack.enter_context(registered(kind))
        yield


def scene(names: set[str], **changes: Any) -> tuple[Problem, LineMesh]:
    """Two spans of 24 m with three droppers each, and a head that rises into the wire."""
    line = replace(
        en50318_line(2),
        span_lengths=(24.0, 24.0),
        dropper_positions=((4.0, 12.0, 20.0),) * 2,
        pre_sag=((0.0,) * 3,) * 2,
    )
    run = train(100.0, 6.0, 42.0, static_force=260.0, raise_time=0.0, nominal_height=5.5)
    usual = problem_of(
        line,
        WHOLE | names,
        damping=Damping(alpha=2e-4, beta=0.0),
        train=replace(run, start_below=0.02),
        numerics=numerics(1e-3),
    )
    return replace(usual, **changes), mesh_of(line, 2)


DENSE = {
    "uplift_stop": (DenseLink(((CONTACT_WIRE, 24.0, 1.0),), STIFFNESS, GAP),),
    "leaning_links": (
        *(
            DenseLink(((MESSENGER_WIRE, upper, 1.0), (CONTACT_WIRE, lower, -1.0)), SOFT)
            for upper, lower in LEANING
        ),
        DenseLink(((CONTACT_WIRE, BELOW, -1.0),), SOFT, FALL),
    ),
}


@pytest.mark.parametrize("names", [{"uplift_stop"}, {"leaning_links"}, set(DENSE)], ids=sorted)
@pytest.mark.parametrize("slackening", [True, pytest.param(False, marks=pytest.mark.study)])
def test_a_march_is_that_of_dense_matrices_with_every_set_tried(
    names: set[str], slackening: bool
) -> None:
    problem, mesh = scene(names)
    if not slackening:
        problem = replace(problem, effects=problem.effects - {"dropper_slackening"})
    _, form = find_form(problem, mesh)
    seen = march(problem, mesh, lambda view: view.checkpoint() if view.step == 0 else None)
    further = tuple(link for name in DENSE if name in names for link in DENSE[name])
    dense = DenseLine(problem, mesh, form, False, 0.0 if slackening else 1.0, further)
    dense.state = np.zeros((3, dense.size))
    dense.state[:, -2:] = seen.watched[0]["pantograph_0"].reshape(3, 2)
    forces, links = [], []
    for x in seen["contact_position"][1:, 0]:
        force, carried = dense.step(x)
        forces.append(force)
        links.append(carried)
    carried = np.array(links)
    switched = (carried[:, 6:] > 0.0).sum(axis=0)
    print(f"{names}: acting steps of further links {switched} of {len(forces)}")
    # Waves that the stop throws back reach the prop; without the stop the wire does not fall on it.
    acting = switched[:-1] if names == {"leaning_links"} else switched
    assert (0 < acting).all() and (acting < len(forces)).all()
    check("contact force [N]", seen["contact_force"][1:, 0], forces, within=1e-8)
    own = seen["dropper_force"][1:]
    check("dropper forces [N]", own, carried[:, :6], within=1e-8)


@pytest.fixture
def recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    """The stops' force is a channel."""
    monkeypatch.setitem(channels.CHANNELS, STOP_FORCE.name, STOP_FORCE)


def stop_force(view: StepView) -> Any:
    return view.further_stop_force.copy(), view.energies()  # type: ignore[attr-defined]


@pytest.mark.usefixtures("recorded")
def test_a_stop_is_recorded_and_gives_back_what_it_takes() -> None:
    """The work of the contact force is all that the line's energy gains.

    Average acceleration keeps it but for steps in which a link switches: there the force of a
    spring k is off by what it is at either end, k de / 2 on average, over a stretch of de.
    """
    fine = numerics(5e-4)
    problem, mesh = scene({"uplift_stop"}, damping=Damping(0.0, 0.0), numerics=fine)
    _, form = find_form(problem, mesh)
    shown: list[tuple[Any, Any]] = []

    def watch(view: StepView) -> None:
        shown.append((stop_force(view), view.checkpoint()))

    seen = march(problem, mesh, watch)
    force = np.array([stop[0] for (stop, _), _ in shown])
    uplift = seen["arm_uplift"]
    expected = np.maximum(0.0, STIFFNESS * (uplift - GAP))
    check("force of the stop [N]", force, expected[:, 0], within=1e-9 * expected.max())
    assert force[0] == 0.0 and 10 < np.count_nonzero(force) < 0.5 * force.size
    dense = DenseLine(problem, mesh, form, False, further=DENSE["uplift_stop"])
    energy = np.array([sum(energies) for (_, energies), _ in shown])
    works, allowed = [0.0], 0.0
    model, _ = find_form(problem, mesh)
    by_node = [dense_state(model, state, dense.size) for _, state in shown]
    loads = [
        -f * dense.meets(x)[0] if f else np.zeros(dense.size)
        for f, x in zip(seen["contact_force"][:, 0], seen["contact_position"][:, 0], strict=True)
    ]
    stretch = [dense.pull @ state for state in by_node]
    tension = [dense.rest + dense.spring * e for e in stretch]
    for step in range(1, len(shown)):
        moved = by_node[step] - by_node[step - 1]
        works.append(works[-1] + float(0.5 * (loads[step] + loads[step - 1]) @ moved))
        switched = (tension[step] > 0.0) != (tension[step - 1] > 0.0)
        change = stretch[step] - stretch[step - 1]
        allowed += float((0.5 * dense.spring * change**2)[switched].sum())
    check("energy [J]", energy - energy[0], works, within=allowed + 1e-7)
    # The stop alone holds more.
    assert allowed < 0.3 * (force**2).max() / (2.0 * STIFFNESS)


def dense_state(model: Any, state: dict[str, np.ndarray], size: int) -> np.ndarray:
    """Displacements of a checkpoint in the order of the dense model's unknowns, heads at rest."""
    result = np.zeros(size)
    names = model.unknowns
    by_row = state["displacement"].reshape(-1, len(names))[model.row_of_node]
    result[: by_row.size] = by_row.ravel()
    return result


@pytest.mark.usefixtures("recorded")
def test_a_stop_that_is_not_reached_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("stops.GAP", 1.0)
    problem, mesh = scene({"uplift_stop"})
    with_stop = march(problem, mesh, stop_force)
    monkeypatch.delitem(channels.CHANNELS, STOP_FORCE.name)
    without = march(scene(set())[0], mesh)
    for name in ("contact_force", "dropper_force", "arm_uplift"):
        assert np.array_equal(with_stop[name], without[name])
    assert not any(force.any() for force, _ in with_stop.watched)


@pytest.mark.usefixtures("recorded")
def test_the_compiled_loop_shows_the_same_stops_as_steps_from_python(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem, mesh = scene({"uplift_stop"})

    class Rows(Observer):
        """Keeps rows of blocks and of single states."""

        def __init__(self) -> None:
            self.rows: list[np.ndarray] = []

        def next_state(self, step: int) -> int:
            return NEVER

        def observe(self, view: StepView) -> None:
            self.rows += list(view.rows.copy())

        def finish(self, outcome: str) -> None:
            assert outcome == "done"

    found = []
    for loop in (True, False):
        rows = Rows()
        with monkeypatch.context() as patch:
            if not loop:
                patch.setattr(time_loop, "compiled_steps", lambda *arguments: None)
            run, _ = start_march(problem, mesh)
            with run:
                run.run([rows])
        found.append(np.array(rows.rows))
    assert np.array_equal(*found, equal_nan=True) and (found[0][:, -1] > 0.0).any()


@pytest.mark.parametrize("way", ["fixed_point", "iterated"])
def test_other_schemes_find_the_same_forces(way: str) -> None:
    """Links are soft: exchanges converge while k beta dt^2 is less than what a node weighs."""
    problem, mesh = scene({"leaning_links"})
    given = {"coupling": way} if way == "iterated" else {"scheme": way}
    other = replace(problem, numerics=numerics(problem.numerics.dt, **given))  # type: ignore[arg-type]
    seen, expected = march(other, mesh), march(problem, mesh)
    largest = expected["dropper_force"].max()
    for name in ("contact_force", "dropper_force"):
        check(name, seen[name], expected[name], within=2e-6 * largest)


def test_the_whole_system_has_the_forces_and_the_jacobian_of_its_links() -> None:
    """In a state in which some act, against differences; all laws are piecewise linear."""
    problem, mesh = scene(set(DENSE))
    model, form = find_form(problem, mesh)
    system = WholeSystem(problem, model, form, lambda place: 5.5, None)
    rng = np.random.default_rng(5)
    u, v, a = 0.02 * rng.standard_normal((3, system.n))
    reserve = system.reserve(u, v)
    assert 3 < (reserve < 0.0).sum() < reserve.size - 2
    values = system.jacobian(0.1, u, v, 50.0, 4e3)
    matrix = sparse.csr_matrix((values, system.indices, system.indptr)).toarray()
    way = 1e-8 * rng.standard_normal(system.n)
    high, low = (
        system.residual(0.1, u + s * way, v + 50.0 * s * way, a + 4e3 * s * way) for s in (1, -1)
    )
    largest = np.abs(matrix).max() * np.abs(way).max()
    check("change of residual [N]", matrix @ way, 0.5 * (high - low), within=1e-6 * largest)
    # At rest all forces are those of the rest shape.
    still = np.zeros(system.n)
    assert system.n_slack(still, still) == 0


def test_laws_that_make_no_sense_are_refused() -> None:
    place = np.zeros(1)
    for wrong in (
        {"gap": 0.1},
        {"gap": -0.1, "acts": PULLS},
        {"gap": 0.1, "acts": PULLS, "rest": 1.0},
    ):
        with pytest.raises(ValueError, match="link"):
            law(place, 1e3, **wrong)  # type: ignore[arg-type]
    problem, mesh = scene(set())
    model, _ = find_form(problem, mesh)
    builder, nodes = ModelBuilder(model), mesh.steady_arms
    with pytest.raises(ValueError, match="a name of their own, not droppers"):
        builder.add_links("droppers", at_nodes(model, nodes), law(place, 1e3, acts=PULLS))
    assert law(place, 1e3)["acts"][0] == BOTH


def test_what_is_shown_is_by_component(recorded: None) -> None:
    problem, mesh = scene({"uplift_stop"})
    history: History = march(problem, mesh, stop_force)
    assert all(force.shape == (mesh.steady_arms.size,) for force, _ in history.watched)
    assert STOPS == "uplift_stops"


# Gap [m] and stiffness [N/m] of stops at the arms, and what there is more of it from where on.
FIRST, MORE = (2e-4, 3e4), (6e-4, 9e4)


def _bent(acts: int, second: bool) -> Effect:
    """Stops at the arms that stiffen, by a bend or by a ``second`` stop each; with ``acts`` of
    ``BOTH`` springs there that carry nothing where they are shorter, by a bend or as links that
    only pull."""

    def build(builder: ModelBuilder) -> None:
        arms = builder.mesh.steady_arms
        x, at = builder.mesh.x(arms), at_nodes(builder.model, arms)
        links, one = np.arange(x.size), np.ones(x.size)
        if acts == BOTH:
            bends = NO_BENDS if second else Bends(links, 0.0 * one, -one, -FIRST[1] * one)
            laws = law(x, FIRST[1], acts=PULLS if second else BOTH)
            builder.add_links(STOPS, at, laws, bends=bends)
            return
        laws, side = law(x, FIRST[1], acts=acts, gap=FIRST[0]), one if acts == PULLS else -one
        if second:
            builder.add_links(STOPS, at, laws)
            builder.add_links("more", at, law(x, MORE[1], acts=acts, gap=MORE[0]))
            return
        bends = Bends(links, side * MORE[0], side, MORE[1] * one)
        builder.add_links(STOPS, at, laws, bends=bends)

    return Effect("bent", "links with a bend", "a link each", "test", False, build=build)


@pytest.mark.parametrize("acts", [PULLS, PUSHES, BOTH])
def test_a_link_with_a_bend_is_two_links_or_one_that_slackens(
    acts: int, request: pytest.FixtureRequest
) -> None:
    """In forces of contacts and droppers, and in energy; and what is shown is the sum."""
    if acts != BOTH:
        request.getfixturevalue("recorded")
    found = []
    for second in (False, True):
        with registered(_bent(acts, second)):
            problem, mesh = scene({"bent"})
            found.append(march(problem, mesh, lambda view: view.energies()))
    for channel in ("contact_force", "dropper_force"):
        check(channel, found[0][channel], found[1][channel], within=1e-8)
    check("energy [J]", found[0].watched, found[1].watched, within=1e-10)
    if acts == BOTH:
        assert (np.abs(found[0]["arm_uplift"]) > 1e-4).any()
        return
    with registered(_bent(acts, False)):
        problem, mesh = scene({"bent"}, damping=Damping(0.0, 0.0))
        seen = march(problem, mesh, stop_force)
    way = seen["arm_uplift"] * (1.0 if acts == PULLS else -1.0)
    expected = sum(k * np.maximum(0.0, way - gap) for gap, k in (FIRST, MORE))
    assert (way > MORE[0]).sum() > 5
    force = np.array([force for force, _ in seen.watched])
    check("forces of stops [N]", force, expected, within=1e-9 * expected.max())
