"""Arguments of a wrong kind: a sentence that names the argument, whatever the function."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import catenary
from catenary.callers import listed, n_at_once, path_of

CASE = "en50318_2002"
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
