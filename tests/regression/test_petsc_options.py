"""PETSc's options after -- are obeyed, or refused with a sentence; none changes the answer."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from petsc4py import PETSc
from program import MPIRUN, assert_sound, catenary, short_run

from catenary.base.petsc import EVENTS
from catenary.postproc.read.results import Results

# Events of a step whose parts follow one another, in place of two passes, and of several ranks.
ONE_BY_ONE, OF_RANKS = {"LineProduct", "LineSolve"}, {"ContactReduce", "ContactReply"}
# Whoever asks for events is shown those of single steps.
OF_BLOCKS = {"Steps"}
STAGES = ["mesh", "equilibrium", "prepare solver", "march", "report"]
# An end that comes early, and its exit code: what needs some steps only need not wait for 2016.
EARLY, INTERRUPTED = ["-march_ts_max_steps", "400"], 1
NO_EFFECT = "had no effect"


def run(out: Path, *options: str) -> str:
    """What a run with options prints."""
    done = catenary(*short_run(out), "--", *options, cwd=out.parent)
    assert done.code == 0, done.stderr
    assert NO_EFFECT not in done.stderr
    assert_sound(out / "run.h5")
    return done.stdout


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("plain") / "out"
    run(out)
    return out


def test_options_with_which_petsc_does_not_start_are_refused(tmp_path: Path) -> None:
    done = catenary(*short_run(tmp_path / "out"), "--", "-options_file", "none", cwd=tmp_path)
    assert done.code == 2
    assert "Unable to open options file none" in done.stderr, "PETSc says it"
    (sentence,) = done.sentences
    assert sentence.startswith("catenary: PETSc does not start with its options")
    assert "Traceback" not in done.stderr and not (tmp_path / "out").exists()


def test_views_show_stepper_solver_and_stages(tmp_path: Path) -> None:
    out = tmp_path / "out"
    options = ["-march_ts_view", "-march_ksp_view", "-march_ts_monitor", "-log_view"]
    text = run(out, *options)
    stepper = text.split("TS Object: (march_) 1 MPI process", 1)[1]
    assert (
        "type: python" in stepper and "step of the line and its train by scheme OneSolve" in stepper
    )
    solver = text.split("KSP Object: (march_) 1 MPI process", 1)[1]
    assert "type: preonly" in solver and re.search(r"exact factors of \d+ stations", solver)
    with Results(out) as results:
        n_steps = results.n_steps
        assert results.attributes["petsc_options"] == options
    monitor = [line for line in text.splitlines() if " TS dt 0.001 time " in line]
    assert [int(line.split()[0]) for line in monitor] == list(range(n_steps + 1))
    log = [line for line in text.splitlines() if line.startswith("--- Event Stage ")]
    found = [line.rsplit(": ", 1)[1] for line in log]
    # Twice: a table of times and one of memory.
    assert [name for name in found if name in STAGES] == [*STAGES, *STAGES]
    assert listed(text) == set(EVENTS) - ONE_BY_ONE - OF_RANKS - OF_BLOCKS


def test_a_step_in_parts_lists_its_parts(tmp_path: Path) -> None:
    text = run(tmp_path / "out", "-march_pc_type", "lu", "-log_view")
    assert listed(text) == set(EVENTS) - OF_RANKS - OF_BLOCKS


def test_monitors_see_each_solution(tmp_path: Path) -> None:
    out, seen = tmp_path / "out", tmp_path / "seen"
    run(out, "-march_ts_monitor_solution", f"binary:{seen}")
    viewer = PETSc.Viewer().createBinary(str(seen), "r", comm=PETSc.COMM_SELF)
    with Results(out) as results:
        uplift = results.channel("arm_uplift")
        assert np.abs(uplift[-1]).max() > 1e-3
        for expected in uplift:
            solution = PETSc.Vec().load(viewer)
            apart = np.abs(solution.array - expected[:, None]).min(axis=1)
            solution.destroy()
            assert apart.max() < 1e-15
    viewer.destroy()


def listed(text: str) -> set[str]:
    """Our events in the table of -log_view, where those that were never begun are left out."""
    return {line.split()[0] for line in text.splitlines() if line.strip()} & set(EVENTS)


@pytest.mark.parametrize(
    "options",
    [
        ["-march_pc_type", "cholesky"],
        pytest.param(["-march_pc_type", "lu"], marks=pytest.mark.study),
        pytest.param(
            ["-march_pc_type", "lu", "-march_pc_factor_mat_ordering_type", "rcm"],
            marks=pytest.mark.study,
        ),
        ["-march_ksp_type", "cg", "-march_pc_type", "jacobi"],
        pytest.param(["-march_pc_type", "ilu"], marks=pytest.mark.study),
    ],
)
def test_another_solver_gives_the_same_answer(
    options: list[str], plain: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    done = catenary(*short_run(out), "--", *options, *EARLY, cwd=tmp_path)
    assert done.code == INTERRUPTED, done.stderr
    # A direct solver leaves 1e-16 a step, an iteration is asked for 1e-12; the line forgets within
    # some ten steps per element what it was told wrongly, so that errors hardly add up.
    with Results(out) as found, Results(plain) as expected:
        assert found.n_steps == 400
        for name in ("contact_force", "arm_uplift", "dropper_force"):
            values = expected.channel(name)[:401]
            difference = np.abs(found.channel(name) - values).max() / np.abs(values).max()
            print(f"{name}: relative difference {difference:.1e}, allowed 1e-09")
            assert difference < 1e-9


def test_the_scene_may_hold_options_and_the_command_line_wins(tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = short_run(out, "petsc.march_pc_type=ilu")
    plain = catenary(*words, "--", "-march_ksp_view", *EARLY, cwd=tmp_path)
    assert plain.code == INTERRUPTED, plain.stderr
    assert "type: ilu" in plain.stdout
    options = ["-march_ksp_view", "-march_pc_type", "lu"]
    other = catenary(*words, "--force", "--", *options, *EARLY, cwd=tmp_path)
    assert other.code == INTERRUPTED, other.stderr
    assert "type: lu" in other.stdout and "type: ilu" not in other.stdout


def test_misspelt_options_are_told_with_the_nearest_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PETSC_OPTIONS", "-march_pc_typ lu -my_own 3 -march_ts_max_steps 20")
    # The last one is looked up when the process ends.
    options = ["-march_ksp_typ", "gmres", "-march_ksp_type", "cg", "-options_left"]
    done = catenary(*short_run(tmp_path / "out"), "--", *options, cwd=tmp_path)
    assert done.code == INTERRUPTED, done.stderr
    told = [line for line in done.stderr.splitlines() if NO_EFFECT in line]
    why = "had no effect: PETSc never looked it up"
    assert told == [
        f"WARNING the option -march_ksp_typ {why}; did you mean -march_ksp_type?",
        f"WARNING the option -march_pc_typ {why}; did you mean -march_pc_type?",
        f"WARNING the option -my_own {why}",
    ]


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["-march_ts_dt", "0.002"], "give numerics.dt_s instead, which is 0.001 s"),
        (["-march_ts_init_time", "0.5"], "the run starts at 0 s"),
        (["-march_ts_type", "alpha2"], "give numerics.scheme"),
        (["-march_ts_type", "nonsense"], "PETSc refuses the options under -march_"),
        (["-march_pc_factor_mat_ordering_type", "nonsense"], "type: nonsense"),
        # What PETSc would find at the end of the run, and print with its trace.
        (["-log_view", ":none/log"], "-log_view cannot write none/log: No such file or directory"),
        (["-log_view", ":log", "-march_ts_view", "ascii:none/view"], "-march_ts_view cannot write"),
        (["-log_view", "log.txt"], "-log_view log.txt names no file; write -log_view :FILE"),
        (["-march_ts_view", "ts.txt"], "-march_ts_view ts.txt names no file; write -march_ts_view"),
    ],
)
def test_impossible_options_are_refused_before_anything_is_written(
    options: list[str], expected: str, tmp_path: Path
) -> None:
    done = catenary(*short_run(tmp_path / "out"), "--", *options, cwd=tmp_path)
    assert done.code == 2, done.stderr
    (sentence,) = done.sentences
    assert sentence.startswith("catenary: ") and expected in sentence
    assert list(tmp_path.iterdir()) == []


def test_an_iteration_that_is_too_short_breaks_the_run(tmp_path: Path) -> None:
    options = ["-march_ksp_type", "cg", "-march_pc_type", "jacobi", "-march_ksp_max_it", "2"]
    done = catenary(*short_run(tmp_path / "out"), "--", *options, cwd=tmp_path)
    assert done.code == 1
    (sentence,) = done.sentences
    assert "the linear solver did not converge" in sentence


@pytest.mark.study
@pytest.mark.skipif(MPIRUN is None, reason="there is no mpirun")
def test_several_ranks_show_the_solver_that_is_used_and_list_their_messages(tmp_path: Path) -> None:
    options = ["-march_ksp_view", "-log_view", *EARLY]
    done = catenary(*short_run(tmp_path / "out"), "--", *options, cwd=tmp_path, ranks=2)
    assert done.code == INTERRUPTED, done.stderr
    text = done.stdout
    assert text.count("KSP Object") == 1 and "exact factors of" in text and "type: asm" not in text
    assert listed(text) == set(EVENTS) - ONE_BY_ONE - OF_BLOCKS


@pytest.mark.study
@pytest.mark.skipif(MPIRUN is None, reason="there is no mpirun")
def test_options_of_the_ranks_own_solvers_are_obeyed(plain: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    options = ["-march_ksp_type", "preonly", "-march_ksp_view", "-march_ts_max_steps", "100"]
    # PETSc's Cholesky of a block matrix keeps the order of the unknowns, and says so otherwise.
    reordered = [*options, "-march_sub_pc_factor_mat_ordering_type", "nd"]
    done = catenary(*short_run(out), "--", *reordered, cwd=tmp_path, ranks=2)
    assert done.code == 2, done.stderr
    (sentence,) = done.sentences
    assert "PETSc refuses the options under -march_" in sentence and "reordering" in sentence
    assert not out.exists()
    options += ["-march_sub_pc_type", "lu"]
    done = catenary(*short_run(out), "--", *options, cwd=tmp_path, ranks=2)
    assert done.code == 1, done.stderr
    assert "type: asm" in done.stdout and "type: lu" in done.stdout
    with Results(out) as found, Results(plain) as expected:
        force = expected.channel("contact_force")[:101]
        difference = np.abs(found.channel("contact_force") - force).max() / force.max()
        print(f"relative difference {difference:.1e}, allowed 1e-09")
        assert difference < 1e-9
