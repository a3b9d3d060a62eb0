"""The plan: its counts are those of mesh and march, its estimates have the right trend."""

from __future__ import annotations

import re

import pytest
from scenes import load_scene, mesh_of, problem_of, with_words

import catenary
from catenary.cases.run.needs import LEAST_FLUSH, Needs, flush_cadence, needs_before_meshing
from catenary.cases.run.plan import make_plan
from catenary.cases.scene.checks.mesh_size import (
    Size,
    estimate_march,
    estimate_memory,
    estimate_start,
    size_of,
)
from catenary.solver.window.choice import moving_share


def test_unknowns_are_the_nodes_of_the_mesh_times_the_unknowns_of_the_effects() -> None:
    scene = load_scene("en50318_2002", ["mesh.elements_per_gap=4"])
    plan = make_plan(scene)
    # Per wire: 22 spans of 9 droppers make 10 gaps of 4 elements each, and one node more.
    assert plan.figures["n_nodes"] == 2 * (22 * 10 * 4 + 1) == mesh_of(scene).n_nodes
    rows = dict(plan.rows)
    assert rows["unknowns"].endswith("(w, theta_y)")
    assert plan.figures["n_unknowns"] == 2 * plan.figures["n_nodes"]
    assert plan.figures["n_droppers"] == 22 * 9
    assert rows["mesh"].endswith(f"elements of {5.0 / 4:.2f} to {6.5 / 4:.2f} m")


def test_steps_cover_the_run() -> None:
    words = ["train.start_m=90", "train.end_m=840", "numerics.dt_s=1e-3"]
    figures = catenary.plan(with_words("en50318_2002", words)).figures
    # 750 m at 250 km/h are 10.8 s.
    assert figures["simulated_s"] == pytest.approx(10.8, rel=1e-12)
    assert figures["n_steps"] == 10800


def test_estimates_grow_with_size_steps_and_scheme() -> None:
    assert estimate_memory(20_000) > estimate_memory(10_000) > 0
    small = estimate_march(10_000, 1000, "one_solve")
    assert estimate_march(20_000, 1000, "one_solve") > small
    assert estimate_march(10_000, 2000, "one_solve") == pytest.approx(2 * small)
    assert estimate_march(10_000, 1000, "fixed_point") > small
    assert estimate_march(10_000, 1000, "one_solve", gusts=True) > small


def test_kinds_of_spans_are_counted_and_lengthen_the_start() -> None:
    def size(*changes: str) -> Size:
        found = size_of(load_scene("ambrosio2012", ["line.n_spans=40", *changes]))
        assert found is not None
        return found

    alike, two = size(), size(f"line.span_m={[50, 54] * 17 + [50]}")
    cut = size("irregularities.dropper_lengths.standard_deviation_mm=5")
    assert 1 <= alike.kinds <= 2 and two.kinds - alike.kinds in (0, 1) and cut.kinds == 40
    starts = [estimate_start(own.nodes, own.kinds / own.spans) for own in (alike, cut)]
    assert starts[1] > 3.0 * starts[0]


def needs(*changes: str) -> Needs:
    found = needs_before_meshing(load_scene("ambrosio2012", ["train.end_m=1110", *changes]))
    assert found is not None
    return found


def test_a_window_is_estimated_by_what_moves() -> None:
    """Spans of the paper are 54 m long, those at the ends 50 m."""
    window = "window.mode=bounded", "window.spans_ahead=6", "window.spans_behind=6"
    short, long = (needs(f"line.n_spans={n}", *window) for n in (100, 400))
    assert long.march == pytest.approx(short.march, rel=0.01)
    assert short.march < 0.5 * needs("line.n_spans=100").march
    scene = load_scene("ambrosio2012", ["line.n_spans=400", "train.end_m=20110", *window])
    # The train starts at 110 m, so that three of its spans are missing on the way to the sixth.
    assert moving_share(problem_of(scene)) == pytest.approx(12 / 400, rel=0.02)
    # What waves could have reached grows: half as much as at the end, in the mean.
    exact = load_scene("ambrosio2012", ["line.n_spans=100", "window.mode=exact"])
    assert 0.05 < moving_share(problem_of(exact)) < 1.0
    assert moving_share(problem_of(load_scene("ambrosio2012"))) == 1.0


def test_a_plan_says_how_much_of_a_line_moves() -> None:
    """The default window of the light line: 13 spans, and the one that the train is in."""
    light = "line.n_spans=100", "line.damping.alpha_s=0.00275", "train.end_m=4000"
    bounded = make_plan(load_scene("ambrosio2012", [*light, "window.mode=bounded"]))
    moving = dict(bounded.rows)["moving"]
    found = re.search(r"^(\d+) of 100 spans .* (\d+) us a step in place of (\d+)", moving)
    assert found, moving
    spans, step, whole = map(int, found.groups())
    assert 12 <= spans <= 14 and 2 * step < whole
    assert "grows" not in moving
    exact = make_plan(load_scene("ambrosio2012", [*light, "window.mode=exact"]))
    assert "grows with the waves" in dict(exact.rows)["moving"]
    assert "moving" not in dict(make_plan(load_scene("ambrosio2012", light)).rows)


def test_flushes_of_a_window_are_as_rare_as_what_moves_is_small() -> None:
    """They were as frequent as steps of the whole line are slow, and wrote its state each time."""
    near = "output.line_channels_window_m=[300,200]", "output.line_channels_every_s=0.005"
    steps = {}
    for mode in ("off", "bounded"):
        scene = load_scene("ambrosio2012", ["line.n_spans=400", f"window.mode={mode}", *near])
        found, size = needs_before_meshing(scene), size_of(scene)
        assert found is not None and size is not None
        steps[mode] = flush_cadence(problem_of(scene), size.unknowns, found.recording)
    assert steps["bounded"] > 5 * steps["off"] >= 5 * LEAST_FLUSH


def test_the_text_tells_trains_of_several_pantographs() -> None:
    second = ["train.pantographs.1.name=three_masses", "train.pantographs.1.behind_m=200"]
    text = str(catenary.plan(with_words("ac_simple", ["train.start_m=310", *second])))
    assert "2 pantographs" in text
    simulated, _ = text.split("Not simulated:")
    assert "several_pantographs" in simulated


def test_long_estimates_are_told_in_minutes() -> None:
    assert " min on one rank" in str(
        catenary.plan(with_words("en50318_2002", ["numerics.dt_s=1e-6"]))
    )


def test_steps_that_adapt_are_told_with_their_shortest() -> None:
    adapted = ["numerics.adaptive_tolerance_N=2", "numerics.smallest_dt_s=2e-4"]
    # 1 ms halved twice is 0.25 ms; a third time would be below the smallest.
    told = str(catenary.plan(with_words("en50318_2002", adapted)))
    assert "wrong by more than 2 N" in told and "down to 0.25 ms" in told
    assert "adapted" not in str(catenary.plan("en50318_2002"))


def test_the_law_of_a_slack_dropper_is_told() -> None:
    residual = ["effects.residual_dropper_stiffness=true"]
    residual += ["line.dropper.residual_stiffness_ratio=0.01"]
    for words, told in (
        ([], "spring and damper are released (line.dropper.slack_damping = released)"),
        (residual, "spring and damper keep 1 % of their force"),
        (["line.dropper.slack_damping=kept"], "spring is released, damper goes on acting"),
        ([*residual, "line.dropper.slack_damping=kept"], "spring keeps 1 % of its force, damper"),
    ):
        assert f"of a slack dropper, {told}" in str(
            catenary.plan(with_words("en50318_2002", words))
        )
    linear = catenary.plan(with_words("en50318_2002", ["effects.dropper_slackening=false"]))
    assert "of a slack dropper" not in str(linear)
