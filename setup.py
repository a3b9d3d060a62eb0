"""Maps the five folders of the repository into the package ``catenary``, whose own files stand in
``cases/api`` and ``solver/base``, and builds the kernels of the time loop,
``catenary.solver.kernels.native``, from C++; those that step a prepared line from outside become
the library ``libcatenary.so`` besides, without Python.

setuptools builds them with pybind11, because this file describes all packages already. nanobind
wants CMake, which would describe them a second time.
"""

import logging
import os
import shlex
import subprocess
import sys
import sysconfig
import time
from glob import glob
from pathlib import Path
from typing import IO

from pybind11.setup_helpers import ParallelCompile, Pybind11Extension
from setuptools import find_packages, setup
from setuptools.command.build_ext import build_ext
from setuptools.errors import CompileError, LinkError

PARTS = ("meshgen", "solver", "mbs", "postproc", "cases")
# Folders that are installed above the part in which they stand: what ``import catenary`` gives, and
# what every part imports.
PLACED = {"catenary": "cases/api", "catenary.base": "solver/base"}
KERNELS = "solver/kernels"
# Sources that take longest to compile, by how they begin.
BINDINGS = f"{KERNELS}/python/"
LONGEST = (*(f"{KERNELS}/stations/{of}" for of in ("avx2", "avx512", "baseline")), BINDINGS)
OBJECTS, SANITIZED_OBJECTS = "build/kernels", "build/sanitized/objects"

# No target is named: a wheel runs on every processor of its architecture, and a source that has
# loops for a newer one says so itself, by pragmas. Pybind11Extension adds -fvisibility=hidden and
# -g0; -MMD writes down which headers a source includes.
FLAGS = [
    *("-O2", "-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math"),
    *("-Wall", "-Wextra", "-Wno-psabi", "-MMD"),
]
SANITIZED = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
# Python's own flags let integers wrap around, which would pass for wanted. Reports name functions
# and lines (-g1); where variables are takes long to work out.
SANITIZED_FLAGS = [
    *("-O1", "-g1", "-fno-omit-frame-pointer", "-fstrict-overflow", "-U_FORTIFY_SOURCE"),
    *("-D_GLIBCXX_ASSERTIONS", "-DCATENARY_CHECKS"),
    *SANITIZED,
]
# Kernels of stations have their products written out: checks of each access, written out as well,
# take most of the time and gigabytes to compile. They are calls there, and what the checks of
# addresses find too is left to those.
SANITIZED_STATIONS = [
    *("--param", "asan-instrumentation-with-call-threshold=0"),
    "-fno-sanitize=null,alignment,pointer-overflow",
]


class BuildKernels(build_ext):
    """Compiles on all cores, and only what has changed since.

    Objects stay in ``build/kernels``, however the package is installed. Beside each lie the names
    of the headers that it was made from, the command that made it, and what the compiler warned of.
    """

    user_options = [
        *build_ext.user_options,
        ("strict", None, "refuse sources of which the compiler warns (make lint)"),
        ("sanitize", None, "check memory and arithmetic, with objects apart (make sanitize)"),
    ]
    boolean_options = [*build_ext.boolean_options, "strict", "sanitize"]

    def initialize_options(self) -> None:
        """Show warnings and no more, unless told otherwise: compilers to come have new ones."""
        super().initialize_options()
        self.strict = self.sanitize = False

    def finalize_options(self) -> None:
        """Choose the folder of the objects; ``compile_or_link`` says which are made anew."""
        super().finalize_options()
        folder = SANITIZED_OBJECTS if self.sanitize else OBJECTS
        self.build_temp = f"{folder}/{sysconfig.get_platform()}-{sys.implementation.cache_tag}"
        self.force = True

    def build_extensions(self) -> None:
        """Run compiler and linker by ``compile_or_link``."""
        if self.sanitize:
            for extension in self.extensions:
                extension.extra_link_args += SANITIZED
        # setuptools 84 calls one, earlier ones the other.
        self.compiler.call = self.compiler.spawn = self.compile_or_link
        # It sorts sources by name: a long one that begins last leaves the other cores idle. But of
        # functions that several objects have the linker takes the first, which is to be checked.
        compile_all = self.compiler.compile
        last = BINDINGS if self.sanitize else ()
        self.compiler.compile = lambda sources, **how: compile_all(
            sorted(sources, key=lambda of: (of.startswith(last), not of.startswith(LONGEST))), **how
        )
        super().build_extensions()

    def get_ext_filename(self, fullname: str) -> str:
        """The library of C programs is no module of Python."""
        name = super().get_ext_filename(fullname)
        folder, file = os.path.split(name)
        return os.path.join(folder, "libcatenary.so") if file.startswith("libcatenary.") else name

    def compile_or_link(self, command: list[str], **_: object) -> None:
        """Run the linker, or the compiler unless its object is there and up to date.

        Bindings call what the others compute: they are compiled with less care, in a third of the
        time, and without checks, so that their objects are those of the ordinary build.
        """
        if self.sanitize:
            own, ordinary = f"{SANITIZED_OBJECTS}/", f"{OBJECTS}/"
            command = [
                word.replace(own, ordinary) if f"/{BINDINGS}" in word else word for word in command
            ]
        if any(word.startswith(BINDINGS) for word in command):
            command = [*command, "-O1"]
        elif self.sanitize and "-c" in command:
            command = [*command, *SANITIZED_FLAGS]
            if any(word.startswith(f"{KERNELS}/stations/") for word in command):
                command += SANITIZED_STATIONS
        words = shlex.join(command)
        target = Path(command[command.index("-o") + 1])
        if "-c" not in command:
            if failed(command, None):
                raise LinkError(f"the linker could not make {target}")
            return
        warnings = target.with_suffix(".warnings")
        if not is_current(target, words):
            written = target.with_suffix(".command")
            target.parent.mkdir(parents=True, exist_ok=True)
            written.unlink(missing_ok=True)
            begin = time.time_ns()
            with warnings.open("w", encoding="utf-8") as file:
                broken = failed(command, file)
            sys.stderr.write(warnings.read_text(encoding="utf-8"))
            if broken:
                raise CompileError(f"the compiler could not make {target}")
            written.write_text(words, encoding="utf-8")
            os.utime(written, ns=(begin, begin))  # what changes meanwhile is newer
        if self.strict and (text := warnings.read_text(encoding="utf-8")):
            raise CompileError(f"the compiler warns:\n{text}")


def failed(command: list[str], errors: IO[str] | None) -> bool:
    """Run a command, and say whether it failed."""
    logging.info(shlex.join(command))
    try:
        return subprocess.run(command, stderr=errors, check=False).returncode != 0
    except FileNotFoundError:
        raise CompileError(f"there is no {command[0]}; CXX names another compiler") from None


def is_current(target: Path, command: str) -> bool:
    """Whether an object was made by this command and is newer than all that it was made from."""
    try:
        if target.with_suffix(".command").read_text(encoding="utf-8") != command or (
            not target.exists()
        ):
            return False
        made = target.with_suffix(".command").stat().st_mtime_ns
        rule = target.with_suffix(".d").read_text(encoding="utf-8").replace("\\\n", " ")
        files = shlex.split(rule.partition(": ")[2])
        return all(Path(file).stat().st_mtime_ns < made for file in files)
    except OSError:  # one is missing
        return False


def extension(name: str, sources: list[str]) -> Pybind11Extension:
    """Extension module of some of the kernels; objects are shared."""
    return Pybind11Extension(
        f"catenary.solver.kernels.{name}",
        sources,
        depends=sorted(glob(f"{KERNELS}/*/*.hpp")),
        include_dirs=[KERNELS],
        extra_compile_args=FLAGS,
        cxx_std=20,
    )


SOURCES = sorted(glob(f"{KERNELS}/*/*.cpp"))
WITHOUT_PYTHON = [source for source in SOURCES if not source.startswith(f"{KERNELS}/python/")]

ParallelCompile(default=0).install()

setup(
    packages=[
        *PLACED,
        *(
            f"catenary.{package}"
            for part in PARTS
            for package in (part, *(f"{part}.{inner}" for inner in find_packages(part)))
            if package.replace(".", "/") not in PLACED.values()
        ),
    ],
    package_dir={**PLACED, **{f"catenary.{part}": part for part in PARTS}},
    package_data={
        "catenary": ["py.typed"],
        "catenary.cases": [
            "*/case.toml",
            "*/README.md",
            "*/reference/*.csv",
            "*/study.toml",
            "studies/hard/hard.toml",
            "studies/reference/*.toml",
            "studies/reference/data/*",
            "*/*.py",
        ],
        "catenary.postproc": [
            "report/templates/*",
            "film/*.template",
            "standards/books/*.toml",
        ],
        "catenary.solver": ["kernels/simulation/catenary.h"],
    },
    exclude_package_data={"catenary.cases": ["api/*"], "catenary.solver": ["base/*"]},
    # Installed files are named above; the source archive has the sources of the extension too.
    include_package_data=False,
    ext_modules=[extension("native", SOURCES), extension("libcatenary", WITHOUT_PYTHON)],
    cmdclass={"build_ext": BuildKernels},
)
