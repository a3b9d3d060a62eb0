"""`plan --cost`: what is switched together, counts of the model, changes of real runs."""

from __future__ import annotations

import csv
import json
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
from catenary.cases.studies import effect_cost
from catenary.cases.studies.effect_cost import (
    UNSWITCHED,
    CostOptions,
    Costs,
    Measured,
    RepeatedMarch,
    Size,
    Switch,
    SwitchableEffects,
    beside,
    jobs_of,
    measure,
    switchable_effects,
)
from catenary.postproc.report import study_table
from catenary.postproc.report.study_table import write_files
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.build_model import build
from catenary.solver.effects.effect import Effect
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.statics.line_at_rest import line_at_rest

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
    size = Size(100, (4, 4), (4,))
    own = Measured(UNSWITCHED, "done", size, 1.0, as_it_is)
    return Costs("x", CostOptions("x"), choice, (0.0, 50.0), 10, 12.5, ["p"], own, [row])


def figures(sigma: float | None, most: float = 200.0) -> list[dict[str, float | None]]:
    return [{"mean_N": 100.0, "std_N": sigma, "max_N": most, "min_N": 50.0, "max_uplift_mm": 40.0}]


def test_advice_weighs_cost_against_change() -> None:
    on, off = (Switch("e", "an effect", now, {"e": not now}, ("f",)) for now in (True, False))
    size = Size(200, (8, 8), (4, 4))
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
