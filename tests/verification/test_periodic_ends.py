"""Lines that go on beyond their ends: a short line is the middle of a long one.

The half line beyond is stepped as the line is, and eliminated exactly; what differs is the
round-off of the numbers of its memory, which grows to 1e-16 of the largest times 1e6 where a march
ends (the root of 1e-12, see `periodic_end`). The long line is so long that nothing comes back from
its ends.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from going_on import EN, SPAN, heights, line_of, struck_line, with_more
from measuring import check, march, start_march
from scipy.sparse.linalg import spsolve
from small_lines import WHOLE, ac_simple_line, en50318_line, mesh_of, numerics, problem_of, train
from studies import few

from catenary import InputError
from catenary.solver import ends
from catenary.solver.effects.build_model import build
from catenary.solver.ends import Chain, half_lines
from catenary.solver.model.matrices import stiffness_matrix
from catenary.solver.problem.ends import AbsorbingLayer, Fixed, Periodic
from catenary.solver.problem.problem import Damping, Numerics, Problem
from catenary.solver.time_loop.views.observers import Observer, StepView

GOES_ON = Periodic(), Periodic()
STEPS, DT, SHORT, BESIDE = 1500, 2e-3, 4, 5
METHODS: dict[str, tuple[Numerics, Damping]] = {
    "average acceleration": (numerics(DT), EN),
    "undamped": (numerics(DT), Damping(0.0, 0.0)),
    "Newmark": (with_more(numerics(DT), beta=0.3, gamma=0.55), EN),
    "HHT": (numerics(DT, integrator="hht", spectral_radius=0.8), EN),
    "generalized alpha": (numerics(DT, integrator="generalized_alpha", spectral_radius=0.5), EN),
    "damping by component": (
        numerics(DT), Damping(1e-4, 0.0125, {"droppers": (1e-3, 0.0), "contact_wire": (5e-4, 0.01)})
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", few(METHODS, "generalized alpha", "damping by component"))
def test_a_short_line_moves_as_the_middle_of_a_long_one(name: str) -> None:
    method, damping = METHODS[name]
    short = struck_line(SHORT, method, STEPS, GOES_ON, damping)
    # 5 spans beside: 600 m there and back, some 5 s of the fastest waves; the march takes 3 s.
    long = struck_line(SHORT + 2 * BESIDE, method, STEPS, damping=damping, before=BESIDE)
    of_long = heights(long, STEPS, SPAN * BESIDE, SPAN * (BESIDE + SHORT))
    found = heights(short, STEPS, 0.0, SPAN * SHORT)
    largest = np.abs(of_long).max()
    # 1e-16 x 1e6, and as many steps; without damping 2e-9 of fast waves are back on the long line.
    check("uplift", found / largest, of_long / largest, within=1e-8)
    in_parts = heights(short, STEPS, 0.0, SPAN * SHORT, ahead=False)
    check("in parts", in_parts / largest, found / largest, within=1e-12)
    held = heights(struck_line(SHORT, method, STEPS, damping=damping), STEPS, 0.0, SPAN * SHORT)
    assert np.abs(held - of_long).max() > 0.1 * largest  # what ends that are held send back


def test_at_rest_an_end_is_as_stiff_as_a_long_line() -> None:
    def elasticity(n_spans: int, at: float, ends: Any) -> float:
        model = struck_line(n_spans, numerics(DT), 1, ends)
        node = model.contact_nodes[[np.argmin(np.abs(model.contact_x - at))]]
        load = np.zeros(model.n_dofs)
        load[model.dofs(node)] = 1.0
        return float(spsolve(stiffness_matrix(model), load)[model.dofs(node)][0])

    # A static load is felt some spans away only.
    found = elasticity(3, 0.0, GOES_ON)
    check("elasticity at the end", found, elasticity(21, 600.0, (Fixed(), Fixed())), within=1e-12)


SPEED = 160.0 / 3.6


def running(n_spans: int, offset: float, **changes: Any) -> Problem:
    """A pantograph over five spans of a line that is moved by ``offset`` [m]."""
    first, last = offset + 2.5 * SPAN, offset + 7.5 * SPAN
    return problem_of(
        en50318_line(n_spans), WHOLE | {"periodic_ends"},
        train=train(SPEED, first, last), evaluation=(first + SPAN, last), **changes,
    )  # fmt: skip


def force_of(problem: Problem) -> np.ndarray:
    history = march(problem, mesh_of(problem.line, 2))
    return np.asarray(history["contact_force"][:, 0])


def test_the_contact_force_of_a_short_line_is_that_of_a_long_one() -> None:
    """Within 1e-6 of its standard deviation; droppers slacken in between, and not at the ends."""
    n, beside = 10, 9
    of_long = force_of(running(n + 2 * beside, beside * SPAN))
    short = force_of(running(n, 0.0, ends=GOES_ON))
    sigma = float(of_long[500:].std())
    check("contact force over sigma", short / sigma, of_long / sigma, within=1e-6)
    held = force_of(running(n, 0.0))
    print(f"ends that are held: {np.abs(held - of_long).max() / sigma:.3f} of sigma")
    assert np.abs(held - of_long).max() > 0.1 * sigma


def test_the_force_is_that_of_a_long_line_to_the_very_end() -> None:
    """The line hangs at its end as at any mast: with clamps, pre-sag and arms that hold no height.

    Droppers that slacken beyond the end, as the train comes within a tenth of a span of it, are not
    those of the half line: here they push.
    """
    n, beside, speed = 4, 6, 275.0 / 3.6
    effects = WHOLE - {"dropper_slackening"} | {"periodic_ends"}

    def force(n_spans: int, before: int, ends: Any) -> np.ndarray:
        line, first = ac_simple_line(n_spans), 55.0 * before + 60.0
        problem = problem_of(
            replace(line, stagger=(0.0,) * (n_spans + 1)), effects, ends=ends, damping=EN,
            train=train(speed, first, 55.0 * (before + n) - 1e-3),
            evaluation=(first + 40.0, first + 100.0),
        )  # fmt: skip
        return force_of(problem)

    of_long = force(n + 2 * beside, beside, (Fixed(), Fixed()))
    short = force(n, 0, GOES_ON)
    sigma = float(of_long[500:].std())
    check("contact force over sigma", short / sigma, of_long / sigma, within=1e-8)


@pytest.mark.study
def test_a_march_that_is_continued_is_the_same_to_the_last_bit() -> None:
    problem = running(6, 0.0, ends=GOES_ON)
    mesh, at = mesh_of(problem.line, 2), 700
    kept: dict[str, Any] = {}

    def watch(view: StepView) -> None:
        if view.step == at:
            kept.update(view.checkpoint() or {})

    whole = march(problem, mesh, watch)
    run, _ = start_march(problem, mesh)
    with run:
        run.restore(kept)
        rest = Rows()
        run.run([rest])
    assert rest.in_blocks > 500
    np.testing.assert_array_equal(rest.forces, whole["contact_force"][at:, 0])
    without = {name: value for name, value in kept.items() if name != "line_past"}
    run, _ = start_march(problem, mesh)
    with run, pytest.raises(InputError, match="line_past is missing"):
        run.restore(without)


class Rows(Observer):
    """Forces of all steps, of which most are taken in one compiled loop."""

    def __init__(self) -> None:
        self.forces: list[float] = []
        self.in_blocks = 0

    def next_state(self, step: int) -> int:
        return step + 64

    def observe(self, view: StepView) -> None:
        self.forces += view.each("contact_force")[:, 0].tolist()
        self.in_blocks += len(view.rows) - 1

    def finish(self, outcome: str) -> None:
        assert outcome == "done"


def test_spans_of_two_kinds_are_refused() -> None:
    line = en50318_line(4)
    longer = (*line.span_lengths[:-1], 55.0)
    droppers = (*line.dropper_positions[:-1], line.dropper_positions[-1][:-1])
    for changed, sentence in (
        (replace(line, span_lengths=longer, dropper_positions=droppers,
            pre_sag=(*line.pre_sag[:-1], line.pre_sag[-1][:-1])), "give both one length"),
        (replace(line, dropper_positions=droppers,
            pre_sag=(*line.pre_sag[:-1], line.pre_sag[-1][:-1])), "the last one"),
    ):  # fmt: skip
        problem = problem_of(changed, WHOLE | {"periodic_ends"}, ends=(Fixed(), Periodic()))
        mesh = mesh_of(changed, 2)
        with pytest.raises(InputError, match=sentence) as refused:
            build(problem, mesh, np.full(mesh.droppers.shape[0], 1.0))
        assert "line.ends.end.kind is periodic" in str(refused.value)


def test_a_line_on_which_a_force_is_felt_without_end_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A chain of springs that nothing holds has a half line without stiffness, which doubling its
    length only halves; the sentence names the end."""
    spring = np.ones((1, 1, 1))
    with pytest.raises(InputError, match="does not fade along it"):
        half_lines(Chain(2.0 * spring, spring * 0.0, spring * 0.0, -spring))

    def without_end(chain: Chain) -> tuple[np.ndarray, np.ndarray]:
        raise InputError("what acts on it does not fade")

    monkeypatch.setattr(ends, "half_lines", without_end)
    with pytest.raises(InputError, match=r"line\.ends\.start\.kind is periodic, but .* not fade"):
        struck_line(3, numerics(DT), 1, (Periodic(), Fixed()))


def test_one_end_may_go_on_and_the_other_absorb() -> None:
    model = struck_line(6, numerics(DT), 10, (AbsorbingLayer(3, 2.0), Periodic()))
    line = line_of(model)
    try:
        assert line.remembers and line.slow_path is None
        past = line.past()
        assert past is not None and past.shape == (4, 11)
    finally:
        line.destroy()
