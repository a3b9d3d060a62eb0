"""Runs command lines of the program, each in a process that is forked from this one.

What is imported here, none of which starts MPI, is not imported again by every process: that is
most of what a short run costs. It is packages and half of the program's modules; the others, PETSc,
MPI and HDF5 are imported by each. Of PETSc the libraries are loaded here, without being started,
and the checks of scenes are put together. Pictures of reports are not painted, and drawn on
panels that were made here, unless ``pictures`` is true. Files are examined in forks, too.

A request is a line of JSON on standard input: ``words``, ``folder``, ``environment``, ``pictures``
and the files ``stdout`` and ``stderr``. It is answered with the number of the process, and with its
exit code when it has ended, negative for a signal.
"""

import ctypes
import gc
import importlib
import importlib.util
import json
import os
import sys
from pathlib import Path

PACKAGES = (
    "gmsh", "jinja2", "matplotlib.backends.backend_agg", "matplotlib.figure", "meshio",
    "pandas", "pydantic", "scipy.integrate", "scipy.interpolate", "scipy.optimize", "scipy.signal",
    "scipy.sparse.linalg", "tqdm", "typer",
    # Of the program, with what they import:
    "catenary.cases.cli.main", "catenary.cases.run.needs",
    "catenary.cases.run.scene_mesh", "catenary.cases.scene.load",
    "catenary.postproc.evaluate.filters", "catenary.solver.contact_problem.law_tangents",
    "catenary.solver.statics.form_finding", "catenary.solver.kernels.native",
)  # fmt: skip


def answer(number: int) -> None:
    """Write a line for who asked."""
    os.write(1, f"{number}\n".encode())


def become(words: list[str], folder: str, environment: dict[str, str], files: list[str]) -> None:
    """Give this process the surroundings of a process that a user starts."""
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = ["-c", *words]
    sys.path[0] = ""
    for number, file in enumerate(files):
        opened = os.open(file, os.O_WRONLY if number else os.O_RDONLY)
        os.dup2(opened, number)
        os.close(opened)


for name in PACKAGES:
    importlib.import_module(name)
sys.modules["catenary.cases.cli.main"].all_verbs()
started = {"mpi4py.MPI", "petsc4py.PETSc", "h5py"} & set(sys.modules)
assert not started, f"what processes are forked from must not have imported {started}"
for place in importlib.util.find_spec("petsc4py").submodule_search_locations:
    for library in Path(place).glob("lib/**/PETSc.*.so"):
        ctypes.CDLL(str(library))  # with what it needs; PETSc is started by each process
sys.modules["catenary.cases.scene.scene"].Scene.model_rebuild()  # put off until it is needed
for panels in (1, 2, 3):
    importlib.import_module("blank_panels").blank(panels)
gc.freeze()
for line in sys.stdin:
    request = json.loads(line)
    child = os.fork()
    if child == 0:
        importlib.import_module("forked_guard")
        if not request["pictures"]:
            importlib.import_module("unpainted")
        files = [os.devnull, request["stdout"], request["stderr"]]
        become(request["words"], request["folder"], request["environment"], files)
        break
    answer(child)
    answer(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
else:
    sys.exit()

# As in a process of its own, the program is the last that runs: what ends Python comes after it.
from catenary.cases.cli.main import main  # noqa: E402

main()
