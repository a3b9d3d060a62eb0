"""Sentences name options as they were given: arguments to a Python program, options to a shell."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from verb_runner import invoke

import catenary
from catenary.base.options import option

pytestmark = pytest.mark.usefixtures("quick_reports")

CASE = "en50318_2002"
# Of the command line alone; a dash within a word, or before a number, is none.
OPTION = re.compile(r"(?<![\w-])--?[a-zA-Z][\w-]*")
Refused = Callable[[catenary.Scene, Path], Any]
SEVERAL = {"train.speed_km_h": [200, 250]}
HEIGHTS = ["head_height"]
NEWMARK = {"numerics.integrator": "newmark", "numerics.spectral_radius": 0.9}
FAULTS = {"train.speed_km_h": -1, "line.n_spans": 0}
REFUSALS: dict[str, tuple[Refused, list[str], str, str]] = {
    "run": (
        lambda scene, done: catenary.run(scene, done),
        ["run", CASE, "--short", "-o", "DONE"],
        "name another folder with out, or give force=True to replace them",
        "name another folder with -o, or give --force to replace them",
    ),
    "values that another key sets again": (
        lambda scene, done: catenary.sweep(
            scene, {"contact.stiffness_N_per_m": [1e4], "contact": [{"stiffness_N_per_m": 2e4}]}
        ),
        ["sweep", CASE, "-o", "NONE", "--vary", "contact.stiffness_N_per_m=1e4", "--vary"]
        + ["contact={stiffness_N_per_m=2e4}"],
        "vary contact sets contact.stiffness_N_per_m again",
        "--vary contact sets contact.stiffness_N_per_m again",
    ),
    "restart": (
        lambda scene, done: catenary.restart(done),
        ["restart", "DONE"],
        "nothing to continue, unless until_m says where it is to end",
        "nothing to continue, unless --until-m says where it is to end",
    ),
    "restart, earlier": (
        lambda scene, done: catenary.restart(done, 1.0),
        ["restart", "DONE", "--until-m", "1"],
        "until_m is 1, but must be greater than",
        "--until-m is 1, but must be greater than",
    ),
    "restart, nowhere": (
        lambda scene, done: catenary.restart(done, 9e3),
        ["restart", "DONE", "--until-m", "9e3"],
        "train.end_m is 9000 m in restart() (until_m)",
        "train.end_m is 9000 m on the command line (--until-m)",
    ),
    "restart, evaluated": (
        lambda scene, done: catenary.restart(done, evaluate=(200, 220)),
        ["restart", "DONE", "--evaluate", "200:220"],
        "evaluate belongs to until_m",
        "--evaluate belongs to --until-m",
    ),
    "restart, evaluated nowhere": (
        lambda scene, done: catenary.restart(done, 1e3, evaluate=360),  # type: ignore[arg-type]
        ["restart", "DONE", "--until-m", "1e3", "--evaluate", "360"],
        "evaluate is 360, but must be two places [m], e.g. (360, 600)",
        "--evaluate is 360, but must be two places [m] as from:to, e.g. 360:600",
    ),
    "several faults": (
        lambda scene, done: scene.replace(FAULTS),
        ["check", CASE, "--set", *(f"{key}={value}" for key, value in FAULTS.items())],
        "(and 1 more, in the attribute faults)",
        "line.n_spans is 0 on the command line (--set)",
    ),
    "sweep, histories": (
        lambda scene, done: catenary.sweep(scene, SEVERAL, done / "none", histories=HEIGHTS),
        ["sweep", CASE, "-o", "NONE", "--vary", "train.speed_km_h=200,250",
         "--histories", "head_height"],
        "histories goes with only_statistics",
        "--histories goes with --only-statistics",
    ),
    "speed": (
        lambda scene, done: catenary.highest_speeds(scene, 300, 200),
        ["speed", CASE, "--from", "300", "--to", "200"],
        "slowest 300 fastest 200 is no range",
        "--from 300 --to 200 is no range",
    ),
    "speed, step": (
        lambda scene, done: catenary.highest_speeds(scene, step=1, within=2),
        ["speed", CASE, "--step", "1", "--within", "2"],
        "within 2 step 1 is not possible: within is at least 0.001 km/h and at most step",
        "--within 2 --step 1 is not possible: --within is at least 0.001 km/h and at most --step",
    ),
    "separation": (
        lambda scene, done: catenary.separations(scene, 90, 50),
        ["separation", CASE, "--from", "90", "--to", "50"],
        "nearest 90 farthest 50 is no range",
        "--from 90 --to 50 is no range",
    ),
    "separation, step": (
        lambda scene, done: catenary.separations(scene, step=0),
        ["separation", CASE, "--step", "0"],
        "step 0 is not possible",
        "--step 0 is not possible",
    ),
    "sensitivity": (
        lambda scene, done: catenary.sensitivity(scene, ["contact.stiffness"]),
        ["sensitivity", CASE, "-p", "contact.stiffness"],
        "contact.stiffness in parameters is unknown",
        "contact.stiffness in --parameter is unknown",
    ),
    "keys that exclude each other": (
        lambda scene, done: scene.replace(NEWMARK),
        ["check", CASE, "--set", *(f"{key}={value}" for key, value in NEWMARK.items())],
        "(None in replace() takes one away)",
        "(--set KEY= takes one away)",
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def scene() -> catenary.Scene:
    return catenary.load(CASE, short=True)


@pytest.fixture(scope="module")
def done(
    scene: catenary.Scene, tmp_path_factory: pytest.TempPathFactory, quick_reports: None
) -> Path:
    """The folder of a run that is done."""
    folder = tmp_path_factory.mktemp("done") / "run"
    catenary.run(scene, folder)
    return folder


@pytest.mark.parametrize("what", REFUSALS)
def test_a_refusal_names_what_was_given(what: str, scene: catenary.Scene, done: Path) -> None:
    refused, words, argument, flag = REFUSALS[what]
    with pytest.raises(catenary.InputError) as found:
        refused(scene, done)
    assert argument in str(found.value) and not OPTION.search(str(found.value)), found.value
    folders = {"DONE": str(done), "NONE": str(done / "none")}
    told = invoke(*(folders.get(word, word) for word in words))
    assert told.exit_code == 2 and flag in told.stderr.replace("\n", " "), told.output
    assert option("--force", "force=True") == "force=True"  # the verb has come to its end


@pytest.mark.process
def test_processes_of_a_program_name_its_arguments(tmp_path: Path) -> None:
    endless = catenary.load(CASE).replace({"numerics.dt_s": 1e-6, "case.accept_unusual": True})
    table = catenary.sweep(endless, SEVERAL, tmp_path / "python", jobs=2)
    assert all("steps give force=True to run it" in text for text in table.outcome)
    words = ["sweep", CASE, "-o", str(tmp_path / "verb"), "-j", "2", "--set"]
    words += ["numerics.dt_s=1e-6", "case.accept_unusual=true"]
    told = invoke(*words, "--vary", "train.speed_km_h=200,250")
    assert "steps give --force to run it" in told.output
