"""The plan: its counts are those of mesh and march, its estimates have the right trend; costs."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from measuring import registered
from mpi4py import MPI
from scenes import load_scene, mesh_of, problem_of, with_words
from verb_runner import invoke

import catenary
from catenary import InputError
from catenary.cases.run.needs import LEAST_FLUSH, Needs, flush_cadence, needs_before_meshing
from catenary.cases.run.plan import make_plan
from catenary.cases.scene.checks.mesh_size import (
    Size,
    estimate_march,
    estimate_memory,
    estimate_start,
    size_of,
)
from catenary.cases.studies import effect_cost
from catenary.cases.studies.effect_cost import (
    UNSWITCHED,
    CostOptions,
    Costs,
    Measured,
    RepeatedMarch,
    Switch,
    SwitchableEffects,
    beside,
    jobs_of,
    measure,
    switchable_effects,
)
from catenary.cases.studies.effect_cost import Size as SizeOfModel
from catenary.postproc.report import study_table
from catenary.postproc.report.study_table import write_files
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.build_model import build
from catenary.solver.effects.effect import Effect
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.window.choice import moving_share

# --- the plan -------------------------------------------------------------------------------------


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


# --- `plan --cost` --------------------------------------------------------------------------------


CASE = "en50318_2002"
SHORT = (
    "line.n_spans=4", "mesh.elements_per_gap=2", "train.start_m=60", "train.end_m=150",
    "train.raise_time_s=0.2", "evaluation.from_m=90", "evaluation.to_m=140",
)  # fmt: skip
PLANE = ("v", "theta_z")
TWO = ["dropper_slackening", "arm_stiffness"]


def _sideways(builder: ModelBuilder) -> None:
    for wire in builder.problem.line.wires:
        builder.add_wire(wire.name, PLANE)
    builder.hold(builder.mesh.anchors, "v")


SIDEWAYS = Effect(
    "sideways", "a plane of its own", "unknowns", "test", False,
    unknowns_of_wire=lambda wire: PLANE, build=_sideways,
)  # fmt: skip


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Costs:
    options = CostOptions(CASE, SHORT, stretch=30.0, rounds=1, only=TWO)
    costs = measure(options, tmp_path_factory.mktemp("cost"), lambda line: None)
    assert costs is not None
    return costs


def test_effects_that_require_each_other_are_switched_together() -> None:
    choice = switchable_effects(load_scene("ac_simple"))
    gravity = next(switch for switch in choice.switches if switch.name == "gravity")
    assert gravity.on and set(gravity.together) == {"pre_sag", "dropper_slackening"}
    assert "effects.dropper_slackening=false" in gravity.assignments
    ratio = "line.dropper.residual_stiffness_ratio=0.1"
    out = "effects.residual_dropper_stiffness=false"
    off = load_scene("ac_simple", [*gravity.assignments, ratio, out])
    residual = next(
        s for s in switchable_effects(off).switches if s.name == "residual_dropper_stiffness"
    )
    assert not residual.on and set(residual.together) == {"dropper_slackening", "gravity"}


@pytest.mark.parametrize("case", ["ac_simple", "ambrosio2012", "tramway"])
def test_every_effect_is_switched_lacks_data_or_is_part_of_all_scenes(case: str) -> None:
    choice = switchable_effects(load_scene(case))
    told = [s.name for s in choice.switches] + choice.always + list(choice.lacking)
    assert sorted(told) == sorted(effects.registry())
    for switch in choice.switches:
        if switch.on:
            scene = load_scene(case, switch.assignments)
            assert switch.name not in problem_of(scene).effects


@pytest.mark.study
def test_changes_are_those_of_two_runs(found: Costs) -> None:
    assert found.stretch == (90.0, 120.0)
    scene = with_words(CASE, [*SHORT, "evaluation.to_m=120", "train.end_m=120"])
    summaries = [
        catenary.run(scene.replace(effects=left_out)).summary
        for left_out in ({}, *({effect: False} for effect in TWO))
    ]
    for figures, summary in zip(
        (found.as_it_is.figures, *(row.figures for row in found.rows)), summaries, strict=True
    ):
        (own,) = figures
        assert own["std_N"] == summary["pantographs"][0]["std_N"]
        assert own["max_uplift_mm"] == summary["supports"]["max_uplift_mm"]
    rows = {row["effect"]: row for row in effect_cost.table_of(found).records()}
    for name, summary in zip(TWO, summaries[1:], strict=True):
        expected = summary["pantographs"][0]["max_N"] - summaries[0]["pantographs"][0]["max_N"]
        assert rows[name]["change_of_max_N"] == expected != 0.0


def test_counts_are_those_of_the_model() -> None:
    with registered(SIDEWAYS):
        scene = load_scene(CASE, SHORT)
        problem, mesh = problem_of(scene), mesh_of(scene)
        switch = next(s for s in switchable_effects(scene).switches if s.name == SIDEWAYS.name)
        assert not switch.on
        wide = replace(problem, effects=problem.effects | {SIDEWAYS.name})
        for one, planes in ((problem, (4,)), (wide, (4, 2, 2))):
            model = build(one, mesh, np.ones(mesh.droppers.shape[0]))
            with RepeatedMarch(MPI.COMM_SELF, line_at_rest(one, mesh), 10, 5) as march:
                size = march.size
                assert march.step_cost() > 0.0
            assert size.n_unknowns == model.numbering.n_unknowns == sum(planes) // 2 * mesh.n_nodes
            assert size.planes == planes
    assert effect_cost.width_text(size) == "4+2+2"


def test_a_march_goes_back_behind_an_incident() -> None:
    words = [*SHORT, "incidents=[{type='tension_loss',at_s=0.5,wire='contact_wire',share=0.8}]"]
    scene = load_scene(CASE, words)
    at_rest = line_at_rest(problem_of(scene), mesh_of(scene))
    with RepeatedMarch(MPI.COMM_SELF, at_rest, 400, 200) as march:
        heights = []
        for _ in range(2):
            march.step_cost()
            heights.append(march._march._line.displacement.copy())
    assert np.array_equal(*heights)


class Scripted:
    """Steps that take what a list says."""

    def __init__(self, costs: list[float]) -> None:
        self._costs = iter(costs)

    def step_cost(self) -> float:
        return next(self._costs)


def test_rounds_that_a_busy_machine_slows_down_do_not_change_a_ratio() -> None:
    """Of three rounds, a b b a, one is twice as slow for both, and one has a disturbed march."""
    ours, others = [20.0, 21.0, 40.0, 44.0, 90.0, 22.0], [10.0, 11.0, 21.0, 20.0, 10.0, 12.0]
    found = beside(Scripted(ours), Scripted(others), 3)  # type: ignore[arg-type]
    assert found == (20.0, 10.0, 2.0)


def costs_of(row: Measured, as_it_is: list[dict[str, float | None]]) -> Costs:
    choice = SwitchableEffects([row.switch], ["vertical"], {"pre_sag": "a pre-sag"})
    size = SizeOfModel(100, (4, 4), (4,))
    own = Measured(UNSWITCHED, "done", size, 1.0, as_it_is)
    return Costs("x", CostOptions("x"), choice, (0.0, 50.0), 10, 12.5, ["p"], own, [row])


def figures(sigma: float | None, most: float = 200.0) -> list[dict[str, float | None]]:
    return [{"mean_N": 100.0, "std_N": sigma, "max_N": most, "min_N": 50.0, "max_uplift_mm": 40.0}]


def test_advice_weighs_cost_against_change() -> None:
    on, off = (Switch("e", "an effect", now, {"e": not now}, ("f",)) for now in (True, False))
    size = SizeOfModel(200, (8, 8), (4, 4))
    for switch, ratio, after, words in (
        (on, 0.5, figures(30.09), "makes a step 2.00 times as long; without it sigma changes most, "
         "by +0.3 %: leave it out for figures within 1 %."),
        (on, 0.5, figures(30.0, 206.0), "the maximum changes most, by +6 % of the mean: "
         "keep it."),
        (on, 1.0, figures(30.0), "has no measurable cost; without it no figure "
         "changes: keep it, or leave it out."),
        (off, 2.0, figures(36.0), "with it sigma changes most, by +20 %: switch it on"),
        (off, 2.0, figures(30.0), "no figure changes: leave it out"),
        (off, 0.8, figures(None), "makes a step 0.80 times as long, and with it sigma comes or go"),
    ):  # fmt: skip
        row = Measured(switch, "done", size, ratio, after)
        assert words in effect_cost.advice(costs_of(row, figures(30.0)), row)
    broken = Measured(on, "at 3 s it broke.")
    assert effect_cost.advice(costs_of(broken, figures(1.0)), broken).endswith(
        "here: at 3 s it broke."
    )


def test_table_csv_and_json_hold_the_same(found: Costs, tmp_path: Path) -> None:
    files = write_files(tmp_path, effect_cost.files_of(found))
    assert [path.name for path in files] == ["cost.csv", "cost.json", "cost.txt"]
    text, record = files[2].read_text(), json.loads(files[1].read_text())
    rows = list(csv.DictReader(files[0].read_text().splitlines()))
    assert [row["effect"] for row in rows] == ["", *TWO]
    assert record["rows"][1]["std_N"] == pytest.approx(float(rows[1]["std_N"]), rel=1e-8)
    assert "vertical" in record["always"] and "pre_sag" in record["lacking_data"]
    change = record["rows"][2]["change_of_mean_N"]
    assert f"{change:+.2f}" in next(line for line in text.splitlines() if "arm_stiff" in line)
    assert f"without {TWO[1]}" in text and "evaluated from 90 to 120 m" in text
    assert found.as_it_is.remarks and "; ".join(found.as_it_is.remarks) == rows[0]["remarks"]
    for number, row in enumerate(found.rows, start=1):
        assert record["rows"][number]["remarks"] == row.remarks
    both = [("as it is", found.as_it_is.remarks), *((f"without {r.switch.name}", r.remarks)
            for r in found.rows)]  # fmt: skip
    for name, remarks in both:
        for remark in remarks:
            (line,) = [line for line in text.splitlines() if line.endswith(f": {remark}")]
            assert line.startswith("REMARK      ") and name in line


def test_the_text_of_a_file_does_not_depend_on_the_terminal(
    found: Costs, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its table was cut to pieces as wide as the terminal of who wrote it."""
    before = effect_cost.files_of(found)[effect_cost.TEXT]
    assert before == effect_cost.as_text(found) + "\n"
    monkeypatch.setattr(study_table, "terminal_width", lambda: 60)
    assert effect_cost.files_of(found)[effect_cost.TEXT] == before
    assert effect_cost.as_text(found) + "\n" != before


def test_an_effect_that_a_scene_refuses_to_leave_out_is_told() -> None:
    second = ["train.pantographs.1.name=two_masses", "train.pantographs.1.behind_m=20"]
    name = load_scene(CASE).train.pantographs[0].name
    words = [
        *SHORT,
        second[0].replace("two_masses", name),
        second[1],
        "train.start_m=80",
        "train.raise_time_s=0.1",
        "evaluation.to_m=120",
    ]
    _, jobs, refused = jobs_of(CostOptions(CASE, words, only=["several_pantographs"]))
    assert [job.variant.name for job in jobs] == ["as-it-is"]
    assert "train.pantographs has 2 entries" in refused["several_pantographs"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--json"], "--json belongs to plan --cost"),
        (["--cost", "--only", "vertical"], "--only vertical: it is part of every scene"),
        (["--cost", "--only", "pre_sag"], "the scene has no data for it: line.dropper.pre_sag_mm"),
        (["--cost", "--only", "nothing"], "--only nothing is no effect; there are gravity"),
        (["--cost", "--rounds", "0"], "--rounds 0 must be between 1 and 1000"),
        (["--cost", "--stretch-m", "0"], "--stretch-m 0 must be between 1 and 1e+07"),
        (["--cost", "--tolerance", "x"], "--tolerance x must be a percentage"),
        (["--cost", "--set", "train.speed=3"], "train.speed"),
    ],
)
def test_bad_options_are_refused_in_a_sentence(words: list[str], sentence: str) -> None:
    ended = invoke("plan", CASE, *words)
    assert ended.exit_code == 2 and sentence in ended.stderr


def test_costs_that_are_there_are_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "cost.json").write_text("{}")
    ended = invoke("plan", CASE, "--cost", "-o", str(tmp_path))
    assert ended.exit_code == 2 and "is there already" in ended.stderr
    assert (tmp_path / "cost.json").read_text() == "{}"


def test_names_are_refused_before_anything_runs() -> None:
    with pytest.raises(InputError, match="is no effect"):
        jobs_of(CostOptions(CASE, SHORT, only=["nothing"]))
