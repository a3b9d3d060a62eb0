# One thread a rank: the linear algebra is small, and MPI is what runs in parallel.
export OMP_NUM_THREADS = 1
export OPENBLAS_NUM_THREADS = 1
# What the environment holds is used, not what a user's shell adds; but on a cluster that may bring
# the packages that setup links. Bytecode is kept: tests start some hundred processes.
unexport PYTHONPATH PYTHONHOME PYTHONDONTWRITEBYTECODE

PYTHON := .venv/bin/python
PYTEST := $(PYTHON) -m pytest
# Tests that measure no time share the cores, a file at a time (benchmarks cannot), in the order of the
# folders named: the longest files first, so that quick ones fill the cores up at the end.
PYTEST_SHARED = $(PYTEST) -p no:benchmark --numprocesses auto --maxprocesses 4 --dist loadfile --no-loadscope-reorder
# An uncaught error on one rank ends all; ranks must not write one cache at a time.
MPI_PYTEST := $(PYTHON) -m mpi4py -m pytest -p no:cacheprovider
KERNELS := $(wildcard solver/kernels/*/*.cpp solver/kernels/*/*.hpp)
PARTS := meshgen solver mbs postproc cases
RESULT := results/ambrosio2012
SEED ?= 1
VTK ?= 9.3.1 9.4.2 9.5.2 9.6.1
LONG_RUNS := $(wildcard tests/benchmarks/test_multibody_*.py) tests/benchmarks/test_killed_runs.py \
    tests/benchmarks/test_long_line.py tests/benchmarks/test_exact_window.py

# Open MPI starts neither as root nor with more ranks than cores unless told to; other MPI
# libraries know neither option.
OPEN_MPI = $(shell mpirun --version 2>/dev/null | grep 'Open MPI')
MPI_FLAGS = $(if $(OPEN_MPI),--oversubscribe --bind-to none)
# A rank that waits keeps its core busy; for tests, which may meet others on the machine, it lets them
# have it. Where time is measured cores are free.
MPI_SHARED = $(MPI_FLAGS) $(if $(OPEN_MPI),--mca mpi_yield_when_idle 1)
ifeq ($(shell id -u),0)
export OMPI_ALLOW_RUN_AS_ROOT = 1
export OMPI_ALLOW_RUN_AS_ROOT_CONFIRM = 1
endif

.DEFAULT_GOAL := help
# The targets share .venv and two cores: one after the other, also under make -j.
.NOTPARALLEL:
.PHONY: help setup setup-tests setup-newest update-versions run check test test-studies test-unit \
    test-verification test-regression test-mpi test-ranks bench long-runs fuzz test-paraview test-readers docs sanitize aarch64 lint types mypy links format clean

help: ## list the targets
	@sed -n 's/^\([a-z0-9-]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 20

setup: ## install the program and what it needs, system packages included; quick when all is there
	@PYTHONPATH="$(PYTHONPATH)" bash .setup/setup.sh

setup-tests: ## the same with what tests, lint and documentation need
	@PYTHONPATH="$(PYTHONPATH)" bash .setup/setup.sh --tests

setup-newest: ## all of that in the newest versions that pyproject.toml allows; says what differs
	@PYTHONPATH="$(PYTHONPATH)" bash .setup/setup.sh --newest

update-versions: setup-tests ## write what is installed into .setup/tested, from where make setup takes it
	@.venv/bin/python -I .setup/versions.py write

run: setup ## simulate the paper's case and write its report
	.venv/bin/catenary run ambrosio2012 -o $(RESULT) --force
	@echo "report: $(CURDIR)/$(RESULT)/report.html"

# Lint takes one core, and as long as ten tests: it runs beside them and speaks when they are done.
BESIDE_LINT = @mkdir -p build; $(MAKE) --no-print-directory lint >build/lint.log 2>&1 & lint=$$!; \
    trap 'kill $$lint' INT TERM; $(1); tested=$$?; wait $$lint; linted=$$?; cat build/lint.log; \
    [ $$tested = 0 ] && [ $$linted = 0 ]

check: setup-tests ## lint, and the unit tests that start no process; a good minute
	$(call BESIDE_LINT,$(PYTEST_SHARED) -q -m "not process and not study" tests/unit)

test: setup-tests ## lint and tests, also on several ranks
	$(call BESIDE_LINT,$(PYTEST_SHARED) -m "not study" tests/regression tests/verification tests/unit)
	@$(MAKE) --no-print-directory test-mpi

test-studies: setup-tests ## whole studies: hard cases, stability, accuracy, waves, the paper's; random scenes; 2 ranks
	$(PYTEST_SHARED) -m "study and not long" tests/regression tests/verification tests/unit
	timeout 1200 mpirun -n 2 $(MPI_SHARED) $(MPI_PYTEST) -m "not study" tests/mpi
	timeout 1200 mpirun -n 3 $(MPI_SHARED) $(MPI_PYTEST) -m study --ignore=tests/mpi/test_rank_counts.py tests/mpi

test-unit: setup-tests ## tests of single parts
	$(PYTEST_SHARED) tests/unit

test-verification: setup-tests ## tests against closed-form and published solutions
	$(PYTEST_SHARED) tests/verification

test-regression: setup-tests ## every case, shortened, against published ranges
	$(PYTEST_SHARED) tests/regression

test-mpi: setup-tests ## the same answers on 3 ranks; those on 2 are among the studies
	timeout 1200 mpirun -n 3 $(MPI_SHARED) $(MPI_PYTEST) -m "not study" tests/mpi

test-ranks: setup-tests ## lines of all topologies and in all planes on 1, 2, 3, 5 and 8 ranks
	timeout 3600 mpirun -n 8 $(MPI_SHARED) $(MPI_PYTEST) tests/mpi/test_rank_counts.py

bench: setup-tests ## what steps cost: against their floor, by phase, spans and ranks
	@mkdir -p results
	MPI_FLAGS="$(MPI_FLAGS)" $(PYTEST) -q -s tests/benchmarks $(LONG_RUNS:%=--ignore=%) --benchmark-json=results/bench.json

fuzz: setup-tests ## random small problems; scenes: 4000 that run, 4000 refused, 50 sweeps, 25 killed, 25 on 2 to 4 ranks; SEED=...
	@echo "seeds from $(SEED); FUZZ_SEED=<seed> FUZZ_CASES=1 $(PYTEST) tests/regression/test_fuzz.py replays one"
	$(PYTEST) -q --hypothesis-profile=others --hypothesis-seed=$(SEED) $$(grep -rl 'import given' tests)
	FUZZ_SEED=$(SEED) FUZZ_CASES=2000 $(PYTEST) -q tests/regression/test_fuzz.py tests/regression/test_fuzz_equations.py
	FUZZ_SEED=$(SEED) FUZZ_FLIPS=120 $(PYTEST) -q tests/regression/test_fuzz_damage.py
	FUZZ_SEED=$(SEED) FUZZ_DAMAGE=2000 $(PYTEST) -q tests/unit/postproc/test_postproc_damage.py
	FUZZ_SEED=$(SEED) FUZZ_SWEEPS=50 $(PYTEST) -q tests/regression/test_fuzz_sweeps.py
	FUZZ_SEED=$(SEED) FUZZ_PROCESSES=25 $(PYTEST) -q tests/regression/test_fuzz_processes.py
	FUZZ_SEED=$(SEED) FUZZ_WINDOWS=300 $(PYTEST) -q tests/regression/test_fuzz_windows.py
	FUZZ_SEED=$(SEED) FUZZ_CASES=100 timeout 1800 mpirun -n 2 $(MPI_SHARED) $(MPI_PYTEST) -q tests/regression/test_fuzz.py

long-runs: setup-tests ## 20 s and ten minutes of all bodies, 1000 spans killed, exact windows, 540 km; reference solutions
	$(PYTEST) -q -s $(LONG_RUNS)
	$(PYTEST) -q -p no:benchmark -m long tests/verification

test-paraview: setup-tests ## open runs in the ParaView of this machine (Debian: paraview python3-paraview xvfb)
	@command -v pvpython >/dev/null && command -v xvfb-run >/dev/null || \
	    { echo "test-paraview needs pvpython and xvfb-run: apt-get install python3-paraview xvfb"; exit 1; }
	$(PYTEST) -q tests/paraview

test-readers: setup-tests ## what other programs read of a run: versions of VTK and xarray, from the package index; VTK="9.3.1 9.4.2"
	.venv/bin/catenary run en50318_2002 --short --quiet --force -o build/film
	.venv/bin/catenary run en50318_2002 --short --quiet --force -o build/film_of_window \
	    --set 'output.field_window_m=[100,100]' output.line_channels_every_s=0.01
	set -e; for reader in $(VTK:%=vtk==%) xarray; do \
	    place=build/reader-$$reader; test -x $$place/bin/python || $(PYTHON) -m venv $$place; \
	    case $$reader in xarray) also="h5netcdf netCDF4"; script=xarray_shows;; *) also=; script=vtk_by_time;; esac; \
	    $$place/bin/pip install --quiet $$reader h5py $$also; \
	    for film in film film_of_window; do $$place/bin/python tests/readers/$$script.py build/$$film; done; \
	done

# GCC's sanitizers. The package is laid apart, with kernels that check each access and each operation,
# and is found before the editable one. The libraries that are loaded
# first are the one that replaces malloc, and the one whose exceptions it watches. A fault ends the tests,
# with a report that pytest must not hold back.
SANITIZED := $(CURDIR)/build/sanitized
SANITIZED_TESTS ?= $(addprefix tests/unit/solver/,test_stations.py test_inner_problem.py test_end_memory.py) \
    $(addprefix tests/unit/mbs/,test_native_heads.py test_multibody_flat.py) \
    tests/verification/test_partly_slack_droppers.py \
    tests/verification/test_tangents.py::test_tangents_side_by_side_are_those_of_each_alone \
    tests/verification/test_ensembles.py::test_lanes_are_filled_again_with_trains_of_other_lengths \
    tests/regression/prepared_line/test_prepared_line.py::test_state_is_kept_and_restored_with_what_was_added

sanitize: setup-tests ## tests with kernels that check memory and arithmetic; SANITIZED_TESTS="FILE..."
	rm -rf $(SANITIZED)/package
	$(PYTHON) -I setup.py --quiet build --build-lib $(SANITIZED)/package build_ext --sanitize
	PYTHONPATH=$(SANITIZED)/package PYTHONMALLOC=malloc \
	    ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1 \
	    LD_PRELOAD="$$(g++ -print-file-name=libasan.so) $$(g++ -print-file-name=libstdc++.so)" \
	    $(PYTEST) -p no:benchmark --capture=sys --timeout=3000 $(SANITIZED_TESTS)

# No test runs there; a compiler sees at least that nothing takes an x86 processor for granted.
AARCH64 := aarch64-linux-gnu-g++
aarch64: ## whether a compiler for ARM takes the kernels, without Python (Debian: g++-aarch64-linux-gnu)
	@command -v $(AARCH64) >/dev/null || { echo "aarch64 needs $(AARCH64): apt-get install g++-aarch64-linux-gnu"; exit 1; }
	$(AARCH64) -std=c++20 -fsyntax-only -Wall -Wextra -Wno-psabi -Werror -Isolver/kernels \
	    $(filter-out solver/kernels/python/%,$(filter %.cpp,$(KERNELS)))

# Material for MkDocs warns of what a next major version of MkDocs will change; the bounds hold that off.
docs: setup-tests links ## the documentation as a site, build/site/index.html; warnings are errors
	NO_MKDOCS_2_WARNING=1 $(PYTHON) -m mkdocs build --config-file .site/mkdocs.yml
	@echo "documentation: $(CURDIR)/build/site/index.html"

lint: setup-tests ## ruff (lint and format), mypy, clang-format and the compiler's warnings
	$(PYTHON) -m ruff check .
	$(PYTHON) -m ruff format --check .
	.venv/bin/clang-format --dry-run -Werror $(KERNELS)
	$(PYTHON) -I setup.py --quiet build_ext --strict
	@$(MAKE) --no-print-directory types

# Its cache, .mypy_cache, stays: without it the check takes some 10 s, with it below one. What NumPy
# and petsc4py say of their types differs from version to version: code is checked against one.
types:
	@if ! $(PYTHON) -I .setup/versions.py is-tested; then \
	    echo "types: not checked with this Python, for whose packages no versions are tested"; exit 0; fi; \
	$(MAKE) --no-print-directory mypy

# The package as it is installed, of links to its folders, for programs that read sources. Links that
# are right stay: lint and tests use them at the same time.
links:
	@mkdir -p build/typing/catenary
	@find build/typing/catenary -xtype l -delete
	@for part in $(PARTS) solver/base cases/api/*.py*; do \
	    link=build/typing/catenary/$$(basename $$part); \
	    [ "$$(readlink $$link)" = ../../../$$part ] || ln -sfn ../../../$$part $$link; done

mypy: links
	@$(PYTHON) .setup/kernel_types.py
	MYPYPATH=build/typing $(PYTHON) -m mypy --exclude '/(cases/api|solver/base)/' -p catenary
	@# Benchmarks run by themselves only: this sees when what they call has gone.
	MYPYPATH=build/typing:tests/support:tests/benchmarks/drivers $(PYTHON) -m mypy --allow-untyped-defs \
	    --ignore-missing-imports tests/benchmarks/*.py

format: setup-tests ## bring all files into the format of ruff and clang-format
	$(PYTHON) -m ruff check --fix .
	$(PYTHON) -m ruff format .
	.venv/bin/clang-format -i $(KERNELS)

clean: ## remove what can be made again, results and .venv excepted
	rm -rf build solver/kernels/*.so solver/kernels/native.pyi *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +
