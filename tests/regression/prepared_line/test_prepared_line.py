"""Prepared lines, stepped from C and from Python: the same steps as those of a run, to the bit."""

from __future__ import annotations

import os
import re
import resource
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from acting_scenes import SCENES, acting_scene
from documents import blocks_of
from mpi4py import MPI
from scenes import Scene, find_case, load_scene
from studies import few

from catenary import InputError, RunBroken
from catenary.base.options import command_line
from catenary.cases.run.at_rest import HEADER, LIBRARY, prepare_line
from catenary.cases.studies.hard import runs
from catenary.solver.kernels.native import Simulation

# Lumped masses on droppers that slacken; three planes; a mechanism; two pantographs and several
# contact wires; strips that bend and roll, laws, a controller, a vehicle; all that a run may be;
# droppers with a curve; more unknowns a station than any shipped line has.
FEW = (
    *("ac_simple", "ac_simple_3d", "ambrosio2012", "overlap", "rich_train", "n_window"),
    *("dropper_curve", "f_planes"),
)
REFUSED = {
    "w_wind": "gusts are made under way, .* \\(wind.gusts = None in replace",
    "d_incidents": "incidents change the line",
    "n_fixed": "numerics.scheme is not one_solve",
    "n_newmark": "numerics.adaptive_tolerance_N lets steps be halved",
}
COMPILER = os.environ.get("CC", "cc")
DOCS = Path(__file__).parents[3] / "docs"
EXAMPLE, EMBEDDING = DOCS / "examples/steps_from_c.c", DOCS / "embedding.md"


def forces_of_run(scene: Scene) -> np.ndarray:
    """Contact forces (n_steps, n_pantographs) of a run [N]."""
    found = runs.run(runs.at_rest(scene, MPI.COMM_SELF), MPI.COMM_SELF)
    assert found.outcome == "done"
    return found.force[1:]


def forces_of(line: Simulation, n_steps: int) -> np.ndarray:
    """The same of steps from outside."""
    forces = []
    for _ in range(n_steps):
        assert line.step()
        forces.append(line.contact_force.copy())
    return np.array(forces)


@pytest.fixture(scope="module")
def line(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A line of lumped masses, with a spring to the base."""
    path = tmp_path_factory.mktemp("line") / "ac_simple.line"
    prepare_line(acting_scene("ac_simple"), path)
    return path


def compiled(source: Path, program: Path) -> Path:
    """A program of C that is linked with the library."""
    if shutil.which(COMPILER) is None:
        pytest.skip(f"there is no {COMPILER}")
    words = ["-O1", "-Wall", "-Wextra", "-Werror", f"-I{HEADER.parent}", str(LIBRARY)]
    subprocess.run([COMPILER, str(source), *words, "-o", str(program)], check=True)
    return program


@pytest.mark.parametrize("name", few(FEW, "ac_simple_3d", "overlap"))
def test_steps_from_outside_are_those_of_a_run(name: str, tmp_path: Path) -> None:
    scene = acting_scene(name)
    n_steps = prepare_line(scene, tmp_path / "a.line")
    line = Simulation(str(tmp_path / "a.line"))
    assert line.n_steps_left == n_steps and line.dt == scene.numerics.dt_s
    assert np.array_equal(forces_of(line, n_steps), forces_of_run(scene))
    assert not line.step()
    assert line.time == n_steps * line.dt and line.way == pytest.approx(line.speed * line.time)


@pytest.mark.study
@pytest.mark.parametrize("name", sorted(set(SCENES) - set(FEW)))
def test_steps_of_every_scene_that_can_be_prepared(name: str, tmp_path: Path) -> None:
    scene = acting_scene(name)
    try:
        n_steps = prepare_line(scene, tmp_path / "a.line")
    except InputError as error:
        pytest.skip(str(error))
    forces = forces_of(Simulation(str(tmp_path / "a.line")), n_steps)
    assert np.array_equal(forces, forces_of_run(scene))


@pytest.mark.parametrize("name", REFUSED)
def test_what_needs_more_than_the_loop_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=REFUSED[name]):
        prepare_line(acting_scene(name), tmp_path / "a.line")
    assert not list(tmp_path.iterdir())


def test_a_verb_says_how_its_words_take_gusts_away(tmp_path: Path) -> None:
    with command_line(), pytest.raises(InputError, match=r"take them away \(wind.gusts=\)"):
        prepare_line(acting_scene("w_wind"), tmp_path / "a.line")


@pytest.mark.parametrize("name", ["ac_simple", "dropper_curve", "overlap", "rich_train"])
def test_c_program_takes_these_steps_and_allocates_nothing(name: str, tmp_path: Path) -> None:
    program = compiled(Path(__file__).with_name("counted_steps.c"), tmp_path / "steps")
    scene = acting_scene(name)
    prepare_line(scene, tmp_path / "a.line")
    done = subprocess.run([program, tmp_path / "a.line"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "0\n")
    forces = [[float.fromhex(word) for word in row.split()] for row in done.stdout.splitlines()]
    assert np.array_equal(forces, forces_of_run(scene))


def test_example_in_c_shows_times_of_steps(line: Path, tmp_path: Path) -> None:
    program = compiled(EXAMPLE, tmp_path / "steps")
    shown = subprocess.run([program, line, "1000"], capture_output=True, text=True, check=True)
    assert re.search(r"^1000 steps, \d+ page faults", shown.stdout)
    counts = [int(row.split()[-1]) for row in shown.stdout.splitlines()[2:]]
    assert sum(counts) == 1000
    assert subprocess.run([program, EXAMPLE, "1"], capture_output=True).returncode == 2


def test_state_is_kept_and_restored_with_what_was_added(line: Path) -> None:
    one = Simulation(str(line))
    forces_of(one, 100)
    one.inputs["lift_force"] = 15.0
    one.set_speed(70.0)
    forces_of(one, 20)
    state = one.save()
    ahead = forces_of(one, 200)
    one.inputs["lift_force"] = 0.0
    one.set_speed(60.0)
    one.step(50)
    one.restore(state)
    assert one.speed == 70.0 and one.inputs["lift_force"] == 15.0
    assert np.array_equal(forces_of(one, 200), ahead)
    with pytest.raises(ValueError, match="no state of this line"):
        one.restore(state[:-1])


@pytest.mark.parametrize("name", ["ac_simple", "ac_simple_3d"])
def test_another_speed_from_the_start_is_another_run(name: str, tmp_path: Path) -> None:
    # Neither the raising nor the static force of this scene depends on the speed.
    changes = ["pantographs.three_masses.static_force_by_speed=", "train.raise_time_s=0.02"]
    changes += ["pantographs.three_masses.static_force_N=150.0"]
    fast = acting_scene(name, [*changes, "train.speed_km_h=288.0"])
    prepare_line(acting_scene(name, changes), tmp_path / "a.line")
    line = Simulation(str(tmp_path / "a.line"))
    assert line.set_speed(80.0)
    expected = forces_of_run(fast)
    forces = forces_of(line, len(expected))
    # Equal but for the round-off of the convective rate, which was divided by the other speed.
    assert np.allclose(forces, expected, rtol=0.0, atol=1e-9 * expected.max())


def test_train_ends_where_the_line_does(tmp_path: Path) -> None:
    # From 275 m on a line of 550 m, for the time in which it comes to 500 m at 76 m/s.
    prepare_line(acting_scene("ac_simple", ["train.end_m=500.0"]), tmp_path / "a.line")
    one = Simulation(str(tmp_path / "a.line"))
    for speed in (-1.0, np.inf, np.nan):
        assert not one.set_speed(speed)
    assert one.set_speed(100.0)
    assert not one.step(one.n_steps_left)
    assert one.n_steps_left > 0 and 274.8 <= one.way <= 275.0


def test_line_with_heads_that_roll_keeps_its_speed(tmp_path: Path) -> None:
    prepare_line(acting_scene("rich_train"), tmp_path / "a.line")
    assert not Simulation(str(tmp_path / "a.line")).set_speed(50.0)


def at_rest_under(line: Path, **added: float) -> tuple[float, float]:
    """Contact force [N] and height of the head [m] of a train that stands long enough."""
    one = Simulation(str(line))
    one.set_speed(0.0)
    for name, value in added.items():
        one.inputs[name] = value
    one.step(one.n_steps_left)
    return float(one.contact_force[0]), float(one.head_height[0])


def test_forces_and_base_act_as_they_do_at_rest(tmp_path: Path) -> None:
    # Two masses on springs of 4200 and 50 N/m, see the case; damped, so that rest is soon.
    changes = ["numerics.dt_s=0.01", "train.start_m=260.0", "line.n_spans=10"]
    changes += ["pantographs.reference.dampings_N_s_per_m=[400.0, 400.0]"]
    changes += [
        "line.damping.beta_per_s=2.0",
        "train.speed_km_h=30.0",
        "evaluation.from_m=300.0",
        "evaluation.to_m=400.0",
    ]
    path = tmp_path / "a.line"
    prepare_line(load_scene(find_case("en50318_2002"), changes), path)
    force, height = at_rest_under(path)
    for added in ({"lift_force": 20.0}, {"head_force": 20.0}, {"base": 0.1}):
        more, higher = at_rest_under(path, **added)
        name, value = next(iter(added.items()))
        pushes = 50.0 * value if name == "base" else value
        # The lower mass is above the head's rise by what the upper spring gives way more.
        through = more - force - (value if name == "head_force" else 0.0)
        lower = higher - height + through / 4200.0
        assert more - force == pytest.approx(pushes - 50.0 * lower, abs=1e-6 * force), name


def test_damaged_files_are_refused_in_a_sentence(line: Path, tmp_path: Path) -> None:
    whole, path = line.read_bytes(), tmp_path / "b.line"
    at = len(whole) // 2
    cases = {
        "it is damaged": whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :],
        "it ends too early": whole[:-9],
        "no prepared line of this version": b"#" + whole[1:],
    }
    for says, text in cases.items():
        path.write_bytes(text)
        with pytest.raises(RuntimeError, match=f"b.line: .*{says}"):
            Simulation(str(path))
    for end in range(0, len(whole), len(whole) // 97):
        path.write_bytes(whole[:end])
        with pytest.raises(RuntimeError, match="b.line: it "):
            Simulation(str(path))
    os.mkfifo(tmp_path / "c.line")
    for name in ("c.line", "none.line", "."):
        with pytest.raises(RuntimeError, match="there is no such file"):
            Simulation(str(tmp_path / name))


def test_c_program_is_refused_states_that_are_damaged_or_of_another_line(
    line: Path, tmp_path: Path
) -> None:
    """Of some hundred damaged states none is taken, nor that of a line as large."""
    program = compiled(Path(__file__).with_name("damaged_states.c"), tmp_path / "states")
    prepare_line(
        acting_scene("ac_simple", ["line.contact_wire.tension_N=21e3"]), tmp_path / "b.line"
    )
    done = subprocess.run([program, line, tmp_path / "b.line"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "0 1 0 0.020 0.010\n")


def test_line_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    with pytest.raises(RunBroken, match="cannot be written"):
        prepare_line(acting_scene("ac_simple"), tmp_path / "no/a.line")
    if Path("/dev/full").exists():
        with pytest.raises(RunBroken, match="to its end: free some space"):
            prepare_line(acting_scene("ac_simple"), Path("/dev/full"))


def test_an_earlier_file_stays_where_a_line_cannot_be_written_whole(tmp_path: Path) -> None:
    file = tmp_path / "a.line"
    file.write_text("the earlier line")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, before[1]))
        with pytest.raises(RunBroken, match="a.line: it cannot be written to its end"):
            prepare_line(acting_scene("ac_simple"), file)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    assert file.read_text() == "the earlier line"
    assert [one.name for one in tmp_path.iterdir()] == ["a.line"]


def test_steps_from_python_need_no_petsc(line: Path) -> None:
    program = (
        "import sys; from catenary.solver.kernels.native import Simulation; "
        "line = Simulation(sys.argv[1]); line.step(10); print(round(line.time, 9)); "
        "print([name for name in ('petsc4py', 'mpi4py', 'scipy', 'h5py') if name in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(line)], capture_output=True, text=True, check=True
    )
    assert done.stdout == "0.01\n[]\n"


def test_example_in_python_steps_a_line(
    line: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (program,) = (
        block.body for block in blocks_of(EMBEDDING.read_text()) if block.kind == "python"
    )
    shutil.copy(line, tmp_path / "en250.line")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(program.replace("2000", "200"), names)
    assert len(names["state"]) > 10_000 and np.isfinite(names["error"])
