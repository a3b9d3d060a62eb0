"""What a verb imports before it has an answer: lists, help and refusals need no backend.

Modules are counted, not seconds: they are what costs, and a busy machine does not change them.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.process

BACKENDS = {"gmsh", "h5py", "matplotlib", "meshio", "mpi4py", "petsc4py", "scipy", "tqdm"}
TABLES = {"pandas", "xarray"}  # of the Python face, which verbs call
# One process runs all command lines, one after the other, and prints the exit code of each with
# the packages that are loaded by then.
PROGRAM = """
import contextlib, io, json, sys
from catenary.cases.cli.main import main
found = []
for words in json.loads(sys.argv[1]):
    sys.argv = ["catenary", *words.split()]
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        try:
            main()
        except SystemExit as end:
            found.append([end.code, sorted({name.partition(".")[0] for name in sys.modules})])
print(json.dumps(found))
"""
ANSWERED = ["--help", "run --help", "list", "list --keys", "list --rules", "list --rules line"]
REFUSED = [
    "check no_such_case",
    "check en50318_2002 --set train.sped=300",
    "check en50318_2002 --set train.speed_km_h=-1",
    "check en50318_2002 --set train.speed_km_h=900",
    "check ambrosio2012 --set train.speed_km_h=900",
    "check ac_simple --set evaluation.edition=1999",
    "list --rules no_such_book",
    "plan ac_simple --set line.n_spans=0",
    "run ac_simple -o nowhere --set evaluation.to_m=1e6",
    "sweep ac_simple -o nowhere --vary train.speed_km_h=250,900",
    "mesh ac_simple -o nowhere.msh --set mesh.elements_per_gap=0",
    "static ac_simple --set line.contact_wire.tension_N=0",
]


def run_all(command_lines: list[str]) -> list[Any]:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, json.dumps(command_lines)],
        capture_output=True,
        text=True,
        timeout=240,
        check=True,
        # Python's own view: MPI, once started by another test, adds a launcher's marks below it.
        env=dict(os.environ),
    )
    return list(json.loads(done.stdout))


def test_no_backend_is_loaded_for_an_answer_or_a_refusal() -> None:
    lines = ANSWERED + REFUSED
    for line, (code, loaded) in zip(lines, run_all(lines), strict=True):
        assert code == (2 if line in REFUSED else 0), line
        assert not BACKENDS & set(loaded), line


def test_help_loads_no_arrays() -> None:
    verbs = ("run", "sweep", "uncertainty", "merge", "optimise", "tolerance")
    verbs += ("speed", "separation", "what-if", "worst")
    lines = ["--help", *(f"{verb} --help" for verb in verbs)]
    for line, (code, loaded) in zip(lines, run_all(lines), strict=True):
        assert code == 0, line
        assert "numpy" not in loaded, line


def test_a_sound_case_loads_what_it_is_checked_with() -> None:
    """So that the names above are those of modules."""
    (_, lumped), (_, mechanism) = run_all(["check en50318_2002", "check ambrosio2012"])
    assert "scipy" in lumped
    unused = BACKENDS - {"scipy"} | TABLES
    assert not unused & set(lumped)
    assert not unused & set(mechanism)


def test_results_of_the_python_face_load_no_tables_to_be_printed() -> None:
    lines = ["plan ac_simple", "static ac_simple"]
    for line, (code, loaded) in zip(lines, run_all(lines), strict=True):
        assert code == 0, line
        assert not TABLES & set(loaded), line


# Prints the modules that are loaded when the march of a run begins, and at the end of the run.
OF_A_RUN = """
import json, sys
from catenary.cases.cli.main import main
from catenary.solver.time_loop.march import March
begun, run = [], March.run
def shown(self, *args, **kwargs):
    begun.extend(sys.modules)
    return run(self, *args, **kwargs)
March.run = shown
sys.argv = ["catenary", "run", *sys.argv[1:]]
try:
    main()
except SystemExit as end:
    print(json.dumps([end.code, begun, list(sys.modules)]))
"""
# What only a report needs, with SciPy's larger parts, which take long to load; what no run needs.
LARGE = {f"scipy.{name}" for name in ("integrate", "interpolate", "optimize", "spatial", "special")}
REPORTED = {"matplotlib", "PIL", "jinja2", "scipy.signal", "scipy.stats", *LARGE}
NEVER = {"gmsh", "matplotlib.pyplot", "meshio", "pandas", "xarray"}
# What a march by the usual scheme has no need of: other schemes and pantographs, results of others.
OF_OTHERS = {
    "catenary.cases.run.excited_run",
    "catenary.mbs.mechanism.full_pantograph",
    "catenary.postproc.read.results",
    "catenary.solver.schemes.adaptive_steps",
    "catenary.solver.schemes.fixed_point",
}


def printed(program: str, *words: str) -> Any:
    """The JSON that a program prints last, in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", program, *words],
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
        env=dict(os.environ),
    )
    return json.loads(done.stdout.splitlines()[-1])


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Any]]:
    """The folder of a run, and what its process printed."""
    out = tmp_path_factory.mktemp("ran") / "out"
    return out, printed(OF_A_RUN, "en50318_2002", "-o", str(out), "--short")


def test_a_run_loads_filters_and_pictures_after_its_march(ran: tuple[Path, list[Any]]) -> None:
    code, begun, ended = ran[1]
    assert code == 0
    assert {"petsc4py", "h5py"} <= set(begun)
    assert not (REPORTED | NEVER | OF_OTHERS) & set(begun)
    assert {"catenary.solver.schemes.scheme", "catenary.mbs.lumped"} <= set(begun)
    assert REPORTED <= set(ended)
    assert not NEVER & set(ended)


# Prints the modules that are loaded when a folder is open: those of the process that looks through
# it first are among them.
OPENED = """
import json, sys, catenary
run = catenary.open(sys.argv[1])
opened = list(sys.modules)
run.statistics, run.scene
print(json.dumps([opened, list(sys.modules)]))
"""
OF_EVALUATIONS = {
    "scipy",
    "catenary.cases.scene.scene",
    "catenary.postproc.evaluate.statistics",
    "catenary.solver.effects.all_effects",
}


@pytest.mark.study
def test_a_folder_is_opened_without_what_evaluates_it(ran: tuple[Path, list[Any]]) -> None:
    opened, evaluated = printed(OPENED, str(ran[0]))
    assert not (OF_EVALUATIONS | {"matplotlib", "jinja2"}) & set(opened)
    assert "catenary.postproc.read.guard" in opened
    assert OF_EVALUATIONS <= set(evaluated)
