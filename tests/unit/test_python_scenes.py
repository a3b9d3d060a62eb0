"""Scenes and arguments in Python: what is changed, refused, told, beside the command line."""

from __future__ import annotations

import copy
import json
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scenes import find_case, load_scene, resolved

import catenary
from catenary.callers import listed, n_at_once, path_of
from catenary.cases.run.at_rest import check_line
from catenary.scenes import checked

# --- scenes in Python -----------------------------------------------------------------------------


CASE = "en50318_2002"


@pytest.fixture(scope="module")
def scene() -> catenary.Scene:
    return catenary.load(CASE)


@pytest.mark.parametrize(
    ("words", "changes", "tables"),
    [
        (["train.speed_km_h=275"], {"train.speed_km_h": 275}, {}),
        (["train.speed_km_h=275"], {}, {"train": {"speed_km_h": np.float64(275)}}),
        (
            ["line.contact_wire.tension_N=25e3", "line.n_spans=24"],
            {"line.n_spans": np.int64(24)},
            {"line": {"contact_wire": {"tension_N": 25e3}}},
        ),
        (["line.dropper.positions_m=[15.0,30.0,45.0]"], {},
         {"line": {"dropper": {"positions_m": np.array([15.0, 30.0, 45.0])}}}),
        (["train.raise_time_s="], {"train.raise_time_s": None}, {}),
        (["effects.dropper_slackening=false"], {}, {"effects": {"dropper_slackening": False}}),
        (["train.pantographs.0.name=reference"], {"train.pantographs.0.name": "reference"}, {}),
        (["test.line.n_spans=12"], {"test.line.n_spans": 12}, {}),
    ],
)  # fmt: skip
def test_what_is_replaced_is_what_the_command_line_sets(
    words: list[str], changes: dict[str, object], tables: dict[str, object], scene: catenary.Scene
) -> None:
    other = scene.replace(changes, **tables)
    assert resolved(checked(other)) == resolved(load_scene(CASE, words))
    assert resolved(checked(scene)) == resolved(load_scene(CASE))  # stays as it was


def test_a_change_is_checked_at_once_with_the_sentences_of_the_command_line(
    scene: catenary.Scene,
) -> None:
    for word, change in (
        ("train.sped_km_h=300", {"train.sped_km_h": 300}),
        ("train.speed_km_h=-1", {"train.speed_km_h": -1}),
        ("train.speed_km_h=900", {"train.speed_km_h": 900}),
        ('train.speed_km_h="fast"', {"train.speed_km_h": "fast"}),
        ("line.span_m=0.1", {"line.span_m": 0.1}),
    ):
        with pytest.raises(catenary.InputError) as expected:
            load_scene(CASE, [word])
        with pytest.raises(catenary.InputError) as found:
            scene.replace(change)
        said = str(expected.value).replace("on the command line (--set)", "in replace()")
        assert str(found.value) == said
        if word != "train.sped_km_h=300":
            assert found.value.faults[0].key == word.partition("=")[0]


def test_all_faults_of_a_scene_are_told(scene: catenary.Scene) -> None:
    with pytest.raises(catenary.InputError) as found:
        scene.replace(train={"speed_km_h": -1}, line={"n_spans": 0})
    assert {fault.key for fault in found.value.faults} == {"train.speed_km_h", "line.n_spans"}
    with pytest.raises(catenary.InputError) as found:
        catenary.load("no_such_case")
    assert [(fault.key, fault.sentence) for fault in found.value.faults] == [("", str(found.value))]


def test_tables_and_keywords_of_one_call_both_hold(scene: catenary.Scene) -> None:
    both = scene.replace({"train": {"speed_km_h": 200}}, train={"start_m": 100})
    assert (both["train.speed_km_h"], both["train.start_m"]) == (200.0, 100.0)
    last = scene.replace({"train.speed_km_h": 200}, train={"speed_km_h": 210})
    assert last["train.speed_km_h"] == 210.0


@pytest.mark.parametrize(
    "speed",
    [
        np.float32(275),
        np.array(275),
        xr.DataArray(275.0),
        pd.Series([270, 275]).max(),
        xr.DataArray([270.0, 275.0], dims="x").max(),
    ],
)
def test_numbers_of_numpy_xarray_and_pandas_are_numbers(speed: Any, scene: catenary.Scene) -> None:
    assert scene.replace(train={"speed_km_h": speed})["train.speed_km_h"] == 275.0


def test_lists_of_numpy_xarray_and_pandas_are_lists(scene: catenary.Scene) -> None:
    key = "line.dropper.pre_sag_mm"
    own = list(range(9))
    for given in (range(9), np.arange(9), pd.Series(own, dtype=object), xr.DataArray(own)):
        assert scene.replace({key: given})[key] == own
    row = pd.DataFrame({"train.speed_km_h": [200.0, 210.0], "train.start_m": [90, 100]}).iloc[1]
    assert scene.replace(row)["train.speed_km_h"] == 210.0


def test_a_scene_stands_for_itself(scene: catenary.Scene) -> None:
    assert catenary.load(scene).to_dict() == scene.to_dict()
    short = catenary.load(scene, short=True)
    assert short.to_dict() == catenary.load(CASE, short=True).to_dict()


def test_scenes_are_equal_where_the_same_values_hold(scene: catenary.Scene) -> None:
    faster = scene.replace(train={"speed_km_h": scene["train.speed_km_h"] + 25})
    assert faster != scene and not faster == scene.name
    for same in (
        catenary.load(scene.to_dict()),
        pickle.loads(pickle.dumps(scene)),
        copy.deepcopy(scene),
        scene.replace(train={"speed_km_h": int(scene["train.speed_km_h"])}),
        faster.replace(train={"speed_km_h": scene["train.speed_km_h"]}),
    ):
        assert same == scene and hash(same) == hash(scene)
    assert {scene: 1, faster: 2}[catenary.load(faster.to_dict())] == 2


def test_a_scene_is_no_list_and_takes_no_attribute(scene: catenary.Scene) -> None:
    for wrong in (list, lambda own: 0 in own):
        with pytest.raises(TypeError, match="iterable"):
            wrong(scene)  # type: ignore[operator]
    with pytest.raises(catenary.InputError, match="3 is no key"):
        scene[3]  # type: ignore[index]
    with pytest.raises(AttributeError, match="speed_km_h"):
        scene.speed_km_h = 300.0  # type: ignore[attr-defined]
    assert pickle.loads(pickle.dumps(scene)).to_dict() == scene.to_dict()


@pytest.mark.parametrize("value", [object(), {1, 2}, 1j, [None]])
def test_what_no_file_can_hold_is_refused(value: object, scene: catenary.Scene) -> None:
    with pytest.raises(catenary.InputError, match="must be a number, a text, a list or a table"):
        scene.replace({"train.speed_km_h": value})


def test_a_table_nested_without_end_is_refused(scene: catenary.Scene) -> None:
    table: dict[str, object] = {}
    table["train"] = table
    with pytest.raises(catenary.InputError, match="more than 32 parts"):
        scene.replace(table)
    endless: list[object] = []
    endless.append(endless)
    with pytest.raises(catenary.InputError, match="nested too deeply"):
        scene.replace({"line.span_m": endless})


def test_the_test_table_shortens(scene: catenary.Scene) -> None:
    short = catenary.load(CASE, short=True)
    assert resolved(checked(short)) == resolved(load_scene(CASE, shortened=True))
    assert short["line.n_spans"] < scene["line.n_spans"]
    again = catenary.load(scene.to_dict(), short=True)
    assert resolved(checked(again)) == resolved(checked(short))


def test_values_are_looked_up_by_their_keys(scene: catenary.Scene) -> None:
    assert scene["contact"]["stiffness_N_per_m"] == scene["contact.stiffness_N_per_m"] == 5e4
    assert scene["train.pantographs.0.name"] == "reference"
    assert scene["wind.speed_m_per_s"] is None and scene["train.end_m"] == 660.0
    for key in ("train.sped_km_h", "train.pantographs.7.nam"):
        with pytest.raises(catenary.InputError, match="is unknown"):
            scene[key]


def test_dictionaries_hold_paths_from_everywhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the case file's own folder, and of the working directory where it was replaced."""
    (tmp_path / "case").mkdir()
    own = find_case(CASE).read_text().replace("[contact]", '[vehicle.vertical]\n'
        'by_time_file = "way.csv"\n[effects]\nvehicle_motion = true\n[contact]')  # fmt: skip
    (tmp_path / "case/case.toml").write_text(own.replace(f'name = "{CASE}"\n', ""))
    (tmp_path / "case/way.csv").write_text("0,0\n1,0.01\n2,0.01\n20,0\n")
    (tmp_path / "other.csv").write_text("0,0\n2,0.02\n3,0.02\n20,0\n")
    monkeypatch.chdir(tmp_path)
    scene = catenary.load(tmp_path / "case")
    other = scene.replace({"vehicle.vertical.by_time_file": Path("other.csv")})
    monkeypatch.chdir("/")
    assert scene.name == "case" == catenary.load(scene.to_dict()).name
    again = catenary.load(scene.to_dict())
    assert again["vehicle.vertical.by_time"] == [[0, 0], [1, 0.01], [2, 0.01], [20, 0]]
    monkeypatch.chdir(tmp_path)
    kept = other.to_dict()
    monkeypatch.chdir("/")
    assert catenary.load(kept)["vehicle.vertical.by_time"][1] == [2, 0.02]


def test_warnings_are_those_of_the_command_line(scene: catenary.Scene) -> None:
    near = scene.replace({"line.n_spans": 11})
    expected = check_line(load_scene(CASE, ["line.n_spans=11"])).warnings
    assert expected and catenary.check(near) == expected == catenary.plan(near).warnings
    loose = {"line.dropper.pre_sag_mid_mm": 900.0, "case.accept_unusual": True}
    with pytest.raises(catenary.InputError, match="slack"):
        catenary.check(scene.replace(loose))


def test_tables_at_rest_are_those_of_the_line() -> None:
    rest = catenary.static("dc_twin")
    droppers = rest.droppers
    assert droppers.x_m.is_monotonic_increasing and set(droppers.carries) >= {"contact_wire"}
    assert len(set(droppers.carries)) == 2
    supports = rest._data["support_x"]
    assert np.allclose(supports[droppers.span - 1] + droppers.in_span_m, droppers.x_m)
    # Droppers carry what hangs on them: the force at rest of the whole line is part of its weight.
    assert droppers.force_N.sum() > 0.0
    names = rest.contact_wires.wire.unique()
    assert len(names) == 2
    for _, own in rest.contact_wires.groupby("wire"):
        assert own.x_m.is_monotonic_increasing
    assert "Elasticity from" in str(rest) and "dc_twin" in repr(rest)
    arms = catenary.static("ac_simple_3d").steady_arms
    assert (arms.tension_N > 0.0).all() and arms.x_m.is_monotonic_increasing


def test_the_plan_is_that_of_the_command_line(scene: catenary.Scene) -> None:
    from catenary.cases.run.plan import make_plan, plan_text

    own, plan = make_plan(load_scene(CASE)), catenary.plan(scene)
    assert str(plan) == plan_text(own)
    assert plan.figures.to_dict() == own.figures and own.figures["memory_B"] == own.needs.memory
    assert plan.effects.simulated.sum() == len(own.on) and len(plan.effects) > len(own.on)


# --- what an import loads -----------------------------------------------------------------------

HEAVY = {"numpy", "scipy", "h5py", "mpi4py", "petsc4py", "pydantic", "pandas", "xarray", "typer"}
HEAVY |= {"matplotlib", "gmsh"}
STAGES = """
import json, sys
found = []
def note():
    found.append(sorted({name.partition(".")[0] for name in sys.modules}))
import catenary; note()
catenary.__version__, catenary.InputError; note()
scene = catenary.load("en50318_2002"); scene.replace(train={"speed_km_h": 260}); note()
catenary.check(scene); note()
print(json.dumps(found))
"""


@pytest.mark.process
def test_an_import_loads_nothing_that_is_not_used() -> None:
    """Modules are counted, not seconds: they are what costs."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", STAGES],
        capture_output=True, text=True, check=True, env=dict(os.environ),
    )  # fmt: skip
    assert done.stderr == ""
    bare, named, loaded, hung = (set(names) for names in json.loads(done.stdout))
    assert not HEAVY & bare and not HEAVY & named
    assert "pydantic" in loaded
    for later in (loaded, hung):
        assert not {"petsc4py", "mpi4py", "h5py", "pandas", "xarray", "matplotlib", "typer"} & later


@pytest.mark.process
def test_nothing_is_printed_unless_a_program_asks() -> None:
    """A warning of a logger of the package: nothing hears it, until logging is set up."""
    program = (
        "import catenary, logging; log = logging.getLogger('catenary.runner');"
        "log.warning('one'); logging.basicConfig(); log.warning('two')"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout == "" and done.stderr == "WARNING:catenary.runner:two\n"


def test_derivatives_at_rest_say_what_they_are_and_what_is_left_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from catenary.cases.studies.parameters import derivatives

    own, tension = derivatives._rest_derivative, "line.contact_wire.tension_N"

    def derivative(parameter: Any, *rest: Any) -> np.ndarray:
        if parameter.key == tension:
            raise catenary.InputError("it makes a dropper slack")
        return own(parameter, *rest)

    monkeypatch.setattr(derivatives, "_rest_derivative", derivative)
    found = catenary.static(catenary.load("tramway", short=True)).sensitivity()
    assert tension not in found.parameter
    assert found.attrs["left_out"] == [f"{tension}: it makes a dropper slack"]
    assert {name: found[name].units for name in found.data_vars if name != "unit"} == {
        "height": "m",
        "elasticity": "m/N",
        "by_height": "m per unit of the parameter",
        "by_elasticity": "m/N per unit of the parameter",
        "by_non_uniformity": "1 per unit of the parameter",
    }
    assert all(found[name].long_name for name in (*found.data_vars, "x") if name != "unit")


def test_derivatives_of_a_march_say_what_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    from catenary.cases.studies.parameters import derivatives

    own, tension = derivatives.change_by, "line.contact_wire.tension_N"

    def change_by(parameter: Any, *rest: Any) -> Any:
        if parameter.key == tension:
            raise catenary.InputError("it has none")
        return own(parameter, *rest)

    monkeypatch.setattr(derivatives, "change_by", change_by)
    table = catenary.sensitivity(catenary.load(CASE, short=True))
    assert tension not in set(table.parameter)
    assert table.attrs["left_out"] == [f"{tension}: it has none"]


# --- arguments of a wrong kind --------------------------------------------------------------------


SCENE = catenary.load(CASE)
SPEED = {"train.speed_km_h": [200, 250]}
# Calls with an argument that no type checker would let pass, and the sentence about it.
PATH, FILE, NAME = "it must be a path", "it must be a file, or its tables", "it must be a name"
LOADED, AT_REST = "it must be a name, a path, its tables or a Scene", catenary.AtRest.sensitivity
WRONG: dict[str, tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any], str]] = {
    "load": (catenary.load, (3,), {}, f"the scene is 3; {LOADED}"),
    "replace": (catenary.Scene.replace, (SCENE, [1]), {}, r"replace() has [1]; it takes a table"),
    "run": (catenary.run, (CASE, 3), {}, f"out is 3; {PATH}"),
    "run, empty": (catenary.run, (CASE, ""), {}, f'out is ""; {PATH}'),
    "run, bytes": (catenary.run, (CASE, b"a"), {}, f"out is b'a'; {PATH}"),
    "run, null": (catenary.run, (CASE, "a\0b"), {}, f"; {PATH}"),
    "open, long": (catenary.open, ("a" * 5000,), {}, f"; {PATH}"),
    "restart, half a letter": (catenary.restart, ("\ud800",), {}, f"; {PATH}"),
    "uncertainty, long": (catenary.uncertainty, ("a" * 5000,), {}, f"; {PATH}"),
    "open": (catenary.open, (None,), {}, f"folder is nothing; {PATH}"),
    "restart": (catenary.restart, (3,), {}, f"folder is 3; {PATH}"),
    "restart, until": (catenary.restart, ("a", "b"), {}, 'until_m is "b"; it must be a number'),
    "run, comm": (catenary.run, (CASE,), {"comm": 3}, "comm is 3; it must be a communicator of"),
    "run, no comm": (catenary.run, (CASE,), {"comm": pd.DataFrame()}, "comm is Empty DataFrame"),
    "open, device": (catenary.open, ("/dev/null",), {}, "/dev/null is no file: name a result fi"),
    "key": (catenary.Scene.__getitem__, (SCENE, ""), {}, '"" in the scene is unknown'),
    "replace, key": (catenary.Scene.replace, (SCENE, {"": 1}), {}, '"" in replace() is unknown'),
    "separations, step": (
        catenary.separations,
        (CASE,),
        {"step": np.inf},
        "it is finite and at least 0.001 m",
    ),
    "uncertainty, 3": (catenary.uncertainty, (3,), {}, "table is 3; it must be a table, or a file"),
    "sweep": (catenary.sweep, (CASE, SPEED, 3), {}, f"out is 3; {PATH}"),
    "sample": (catenary.sweep, (CASE,), {"sample": [1]}, f"sample is [1]; {FILE}"),
    "jobs": (catenary.sweep, (CASE, SPEED), {"jobs": 1.5}, "jobs is 1.5; it is a number of"),
    "histories": (catenary.sweep, (CASE, SPEED), {"histories": 3}, f"histories is 3; {NAME}"),
    "sensitivity": (catenary.sensitivity, (CASE, [3]), {}, f"parameters is [3]; {NAME}"),
    "at rest": (AT_REST, (None, None), {}, f"parameters is nothing; {NAME}"),
    "speeds": (catenary.highest_speeds, (CASE, "a"), {}, 'slowest is "a"; it must be a number'),
    "speeds, true": (
        catenary.highest_speeds,
        (CASE, True),
        {},
        "slowest is true; it must be a num",
    ),
    "criteria": (catenary.highest_speeds, (CASE,), {"criteria": 3}, f"criteria is 3; {NAME}"),
    "separations": (catenary.separations, (CASE, None), {}, "nearest is nothing; it must be a num"),
    "optimise": (catenary.optimise, (CASE, None), {}, f"task is nothing; {FILE}"),
    "tolerance": (catenary.tolerance, (CASE, 3), {}, f"task is 3; {FILE}"),
    "identify": (catenary.identify, (CASE, pd.DataFrame(), 3), {}, f"task is 3; {FILE}"),
    "uncertainty": (catenary.uncertainty, ("",), {}, f'table is ""; {PATH}'),
    "prepare": (catenary.prepare, (CASE, 3), {}, f"out is 3; {PATH}"),
    "prepare, other name": (catenary.prepare, (CASE, "a.h5"), {}, "out a.h5 must have a name that"),
    "Simulation": (catenary.Simulation, ([CASE],), {}, LOADED),
}


@pytest.mark.parametrize("what", WRONG)
def test_an_argument_of_a_wrong_kind_is_refused(what: str) -> None:
    function, given, named, says = WRONG[what]
    with pytest.raises(catenary.InputError) as refused:
        function(*given, **named)
    assert says in str(refused.value)


def test_a_measurement_that_is_none_is_refused() -> None:
    task = {
        "measured": {
            "time": {"column": "time"},
            "force": {"column": "contact_force", "noise": np.float64(10.0)},
            "is_filtered": np.False_,
        },
        "parameters": [{"key": "pantographs.reference.static_force_N", "deviation": np.float32(5)}],
    }
    for measured in (None, [1.0], {"time": [0.0]}):
        with pytest.raises(catenary.InputError, match="measured is .* a table of pandas, or a fil"):
            catenary.identify(CASE, measured, task)  # type: ignore[arg-type]


def test_numpy_and_pandas_give_arguments() -> None:
    assert n_at_once(np.int64(2)) == 2 and n_at_once(0) == 0
    assert listed(np.array(["a", "b"]), "names") == listed(pd.Index(["a", "b"]), "names")
    assert listed("ab", "names") == ["ab"] and listed((), "names") == []


def test_a_home_folder_is_that_of_a_shell(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    assert path_of("~/run", "out") == tmp_path / "run"
    assert path_of(Path("a/b"), "out") == Path("a/b")


def test_results_are_told_apart_and_can_be_collected() -> None:
    """Tables in them have no truth value, by which they could be compared."""
    table = {"variant": ["a", "b"], "outcome": ["done", "done"], "std_N": [25.0, 27.0]}
    table |= {"failed": [[], []], "passed": [True, True]}
    one, other = catenary.uncertainty(table), catenary.uncertainty(table)
    assert one != other and len({one, other}) == 2
    fields = (catenary.Optimum, catenary.Identified, catenary.Uncertainty)
    assert all(own.__eq__ is object.__eq__ for own in fields)
