"""Whether what the program needs is installed and works here, found by trying each part.

Parts are tried in processes of their own with a limit in time, so that a library which hangs or
crashes is a finding and not the end. No library is imported here.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from catenary.base.process import MPI_SETTINGS

OK, MISSING, BROKEN = "OK", "missing", "broken"
# No part answers later than this on a machine that works [s].
LIMIT = 60.0
_SETUP = "run `make setup` in the folder of the source"
# Free memory below which even short runs may end early [B]; they take 0.4 GB.
_LEAST_MEMORY = 1e9
_LONGEST = 200  # characters of a library's answer


@dataclass(frozen=True)
class Finding:
    """State of one part.

    Attributes
    ----------
    part : name of the part
    state : ``OK``, ``MISSING`` or ``BROKEN``
    facts : versions and facts, or the fault
    remedy : sentence on how to mend it, "" if it is OK
    needed : whether no run is possible without it
    """

    part: str
    state: str
    facts: str
    remedy: str = ""
    needed: bool = False

    def line(self) -> str:
        """The finding in one line."""
        mend = f"; to mend it: {self.remedy}" if self.state != OK else ""
        return f"{self.state:8} {self.part:15} {self.facts}{mend}"

    @property
    def prevents_runs(self) -> bool:
        """Whether no run is possible."""
        return self.needed and self.state != OK


def examined(folder: Path) -> Iterator[Finding]:
    """Findings of all parts, one after the other, those first that every run needs.

    ``folder`` is where results would be written. Takes some seconds. Not collective.
    """
    yield _python()
    yield from _packages()
    yield _tried("compiled kernels", _KERNELS, _SETUP, needed=True)
    yield _tried("PETSc", _PETSC, f"{_SETUP}, or apt-get install python3-petsc4py", needed=True)
    yield _tried("MUMPS", _MUMPS, "install a PETSc with MUMPS; Catenary's own solver does without")
    yield _tried("HDF5", _HDF5, "apt-get install python3-h5py", needed=True)
    yield _mpi()
    yield _compiler()
    yield _film()
    yield _paraview()
    yield _folder(folder)
    yield _memory()
    yield _threads()


_KERNELS = """
from catenary.solver.kernels import native
print("loaded, instruction sets", ", ".join(native.targets()))
"""
_SYSTEM = """
from petsc4py import PETSc
m = PETSc.Mat().createAIJ((3, 3), comm=PETSc.COMM_SELF); m.setUp()
for i in range(3):
    m[i, i] = 2.0
    if i: m[i, i - 1] = m[i - 1, i] = -1.0
m.assemble()
b, x = m.createVecs(); b.set(1.0)
ksp = PETSc.KSP().create(PETSc.COMM_SELF); ksp.setOperators(m); ksp.setType("preonly")
pc = ksp.getPC(); pc.setType("lu"); SOLVER
ksp.solve(b, x)
assert max(abs(x.array - [1.5, 2.0, 1.5])) < 1e-12, f"a system of three unknowns gave {x.array}"
"""
_SOLVES = 'print(".".join(map(str, PETSc.Sys.getVersion())), "solves a small system")'
_PETSC = _SYSTEM.replace("SOLVER", "pass") + _SOLVES
_MUMPS = _SYSTEM.replace("SOLVER", 'pc.setFactorSolverType("mumps")') + (
    'print("solves a small system")'
)
_HDF5 = """
import tempfile, h5py
with tempfile.TemporaryFile() as stream, h5py.File(stream, "w") as file:
    file["x"] = [1.0]
    assert file["x"][0] == 1.0
kind = "parallel" if h5py.get_config().mpi else "serial, which suffices: the first rank writes"
print(".".join(map(str, h5py.h5.get_libversion())), f"writes and reads ({kind})")
"""
_RANKS = """
from mpi4py import MPI
n = MPI.COMM_WORLD.allreduce(1)
if MPI.COMM_WORLD.rank == 0: print("ranks", n, MPI.Get_library_version().split(",")[0].strip())
"""


def _tried(part: str, program: str, remedy: str, needed: bool = False) -> Finding:
    """Output of a short Python program on a part, if it ends well."""
    code, answer = _answer([sys.executable, "-c", program])
    if code == 0:
        return Finding(part, OK, answer)
    lacks = "No module named" in answer or "Could not locate" in answer
    state = MISSING if lacks else BROKEN
    return Finding(part, state, answer, remedy, needed)


def _answer(command: list[str], *, launches: bool = False) -> tuple[int, str]:
    """Exit code and last line of a command's answer; whatever it started has ended then.

    Unless the command ``launches`` ranks, MPI starts there as it does in a run.
    """
    # Files, not pipes: a process that is left behind would hold a pipe open. Their folder is their
    # own, as a program of Open MPI that ends removes what others make in a common one.
    with (
        tempfile.TemporaryFile("w+", errors="replace") as stream,
        tempfile.TemporaryDirectory(prefix="doctor", ignore_cleanup_errors=True) as folder,
    ):
        environment = (
            os.environ
            | ({} if launches else MPI_SETTINGS)
            | {
                "OMPI_ALLOW_RUN_AS_ROOT": "1",
                "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
                "OMPI_MCA_rmaps_base_oversubscribe": "1",
                "TMPDIR": folder,
            }
        )
        try:
            process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                env=environment,
                start_new_session=True,
            )
        except OSError as error:
            return 1, (error.strerror or str(error)).lower()
        try:
            code = process.wait(LIMIT)
        except subprocess.TimeoutExpired:
            return -1, f"no answer within {LIMIT:g} s"
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        stream.seek(0)
        lines = [line.strip() for line in stream.read().splitlines() if re.search(r"\w", line)]
    if code < 0:
        return code, f"ended by signal {-code}"
    return code, (lines[-1] if lines else f"exit code {code}")[:_LONGEST]


def _python() -> Finding:
    version = ".".join(map(str, sys.version_info[:3]))
    wanted = metadata.metadata("catenary")["Requires-Python"] or ""
    if _fits(version, wanted):
        return Finding("Python", OK, f"{version}, {sys.executable}")
    return Finding("Python", BROKEN, f"{version}, wanted {wanted}", "install a newer one", True)


def _fits(version: str, bounds: str) -> bool:
    """Whether a version lies within bounds such as ``>=1.24,<3``."""

    def numbers(text: str) -> list[int]:
        return [int(part) for part in re.findall(r"\d+", text)[:3]]

    least = re.search(r">=\s*([\d.]+)", bounds)
    most = re.search(r"<\s*([\d.]+)", bounds)
    own = numbers(version)
    if least and own < numbers(least[1]):
        return False
    return not most or own < numbers(most[1])


def _packages() -> Iterator[Finding]:
    """One finding on all packages that are as wanted, and one for each other."""
    fine = []
    for text in metadata.requires("catenary") or []:
        requirement, _, marker = text.partition(";")
        if "extra" in marker:
            continue
        name = re.match(r"[\w.-]+", requirement.strip())
        assert name is not None
        bounds = requirement.strip().removeprefix(name[0])
        try:
            version = metadata.version(name[0])
        except metadata.PackageNotFoundError:
            if _is_there(name[0]):  # linked from the system's packages, without a record of it
                fine.append(name[0])
                continue
            yield Finding(name[0], MISSING, "the package is not installed", _SETUP, True)
            continue
        if _fits(version, bounds):
            fine.append(f"{name[0]} {version}")
        else:
            facts = f"{version} is outside of {bounds.strip()}"
            yield Finding(name[0], BROKEN, facts, f"{_SETUP}; it may work all the same")
    yield Finding("packages", OK, ", ".join(fine))


def _mpi() -> Finding:
    remedy = "apt-get install openmpi-bin python3-mpi4py; runs on one rank do without mpirun"
    code, answer = _answer([sys.executable, "-c", _RANKS])
    if code or not answer.startswith("ranks 1 "):
        state = MISSING if "No module named" in answer else BROKEN
        return Finding("MPI", state, answer, remedy, True)
    launcher = shutil.which("mpirun")
    if launcher is None:
        return Finding("MPI", MISSING, "there is no mpirun in PATH", remedy)
    code, answer = _answer([launcher, "-n", "2", sys.executable, "-c", _RANKS], launches=True)
    if code == 0 and answer.startswith("ranks 2 "):
        library = answer.removeprefix("ranks 2 ")
        return Finding("MPI", OK, f"{library}, two ranks started and added up")
    if code == 0:
        answer = "mpirun and mpi4py belong to different MPI libraries: two ranks did not meet"
    return Finding("MPI", BROKEN, answer, remedy)


def _compiler() -> Finding:
    for name in ("c++", "g++", "clang++"):
        path = shutil.which(name)
        if path is not None:
            return Finding("compiler", OK, _answer([path, "-dumpfullversion"])[1] + f", {path}")
    why = "no c++, g++ or clang++ in PATH; only `make setup` needs one"
    return Finding("compiler", MISSING, why, "apt-get install g++")


def _film() -> Finding:
    remedy = "pip install 'catenary[film]'"
    if not _is_there("imageio_ffmpeg"):
        return Finding("films", MISSING, "no imageio_ffmpeg; `animate` needs it", remedy)
    return _tried(
        "films", "import imageio_ffmpeg as i; print('ffmpeg', i.get_ffmpeg_version())", remedy
    )


def _is_there(module: str) -> bool:
    from importlib.util import find_spec

    return find_spec(module) is not None


def _paraview() -> Finding:
    part, path = "ParaView", shutil.which("paraview")
    if path is None:
        remedy = "install it, from paraview.org or as a package, to open runs"
        return Finding(part, MISSING, "no paraview in PATH", remedy)
    return Finding(part, OK, path)


def _folder(folder: Path) -> Finding:
    """Whether files can be written, linked and locked in a folder, as results are."""
    part, elsewhere = "results folder", "write results elsewhere with -o FOLDER"
    try:
        with tempfile.TemporaryDirectory(dir=folder, prefix=".catenary") as inner:
            path = Path(inner, "lock")
            path.write_text("x", encoding="utf-8")
            lacking = []
            with path.open("r+") as stream:
                try:
                    fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except OSError:
                    lacking.append("locks (flock)")
            try:
                os.link(path, Path(inner, "other"))
            except OSError:
                lacking.append("hard links")
            free = shutil.disk_usage(folder).free
    except OSError as error:
        fault = f"{folder} cannot be written to ({(error.strerror or str(error)).lower()})"
        return Finding(part, BROKEN, fault, elsewhere)
    facts = f"{folder} can be written to, {free / 1e9:.0f} GB are free"
    if lacking:
        why = f"{facts}, but it has no {' and no '.join(lacking)}: two runs may write to one folder"
        return Finding(part, MISSING, why, elsewhere)
    return Finding(part, OK, f"{facts}, files can be locked")


def _memory() -> Finding:
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    free = _available()
    limited = "" if limit == resource.RLIM_INFINITY else f", ulimit -v {limit / 1e9:.1f} GB"
    facts = f"{free / 1e9:.1f} GB available{limited}, {len(os.sched_getaffinity(0))} cores"
    if free < _LEAST_MEMORY:
        return Finding(
            "memory", BROKEN, f"only {facts}", "end other programs; `plan` says how much"
        )
    return Finding("memory", OK, facts)


def _available() -> float:
    """Memory that programs may still take [B]; infinite where the system does not say."""
    try:
        text = Path("/proc/meminfo").read_text(encoding="ascii")
    except OSError:
        return float("inf")
    found = re.search(r"MemAvailable:\s*(\d+) kB", text)
    return 1024.0 * int(found[1]) if found else float("inf")


def _threads() -> Finding:
    """Threads of libraries beside ranks, which take each other's cores."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    several = [f"{name}={os.environ[name]}" for name in names if os.environ.get(name, "1") != "1"]
    if several:
        why = f"{', '.join(several)}: threads take cores from each other, matrices are small here"
        return Finding("threads", BROKEN, why, "set them to 1, or leave them out")
    return Finding("threads", OK, "one for each rank")
