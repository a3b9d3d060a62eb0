"""Lines stepped from Python: the steps of a run, what is set from outside, and controllers."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from acting_scenes import SCENES
from scenes import with_words

import catenary


def acting(name: str, **changes: Any) -> catenary.Scene:
    """A small scene of the tests."""
    table = SCENES[name]
    return with_words(table["case"], table["set"]).replace(changes)


@pytest.fixture(scope="module")
def scene() -> catenary.Scene:
    return acting("ac_simple")


@pytest.mark.parametrize("name", ["ac_simple", "ac_simple_3d", "overlap", "rich_train"])
def test_steps_are_those_of_a_run_to_the_last_bit(name: str) -> None:
    scene = acting(name)
    run = catenary.run(scene)
    found: dict[str, list[np.ndarray]] = {"force": [], "head_height": [], "wire_height": []}
    with catenary.Simulation(scene) as sim:
        assert sim.dt == scene["numerics.dt_s"] and sim.time == 0.0
        while sim.steps_left and sim.step():
            found["force"].append(sim.contact_force)
            found["head_height"].append(sim.head_height)
            found["wire_height"].append(sim.wire_height)
        assert sim.n_pantographs == run.force.sizes["pantograph"]
        assert sim.strip_force.size >= sim.n_pantographs
        assert not sim.step() and sim.steps_left == 0
    assert np.array_equal(found["force"], run.force[1:])
    assert np.array_equal(found["head_height"], run.channel("head_height")[1:])
    assert np.array_equal(found["wire_height"], run.channel("wire_height")[1:])


TARGET, GAIN, LEAST, MOST, BEGIN = 150.0, 0.3, -20.0, 30.0, 0.1


@pytest.mark.parametrize("sample", [1e-3, 1e-2])
def test_a_controller_from_outside_is_that_of_a_regulation(sample: float) -> None:
    """A proportional law of the contact force, sampled, within limits.

    Both measure the contact force at the end of a step and act from the next step on. The first
    sample is at ``from_s``, after the pantograph was raised in 0.02 s: until then a regulation acts
    with the part of the static force that is there, what is added from outside in full. Both add
    the same number at one place, to the static force; only its limits are taken by NumPy. Round-off
    of 1e-16 a step, which damping keeps from growing, comes to 1e-13 at most in 1e3 steps; 1e-10 of
    the force is a thousand times that.
    """
    scene = acting("ac_simple")
    kind, every = scene["train.pantographs.0.name"], round(sample / scene["numerics.dt_s"])
    law = {
        "measures": "contact_force",
        "target": TARGET,
        "gains": [{"at": 0.0, "error": GAIN}],
        "least_N": LEAST,
        "most_N": MOST,
        "sample_s": sample,
        "from_s": BEGIN,
    }
    effects = {"regulated_lift": True}
    regulated = scene.replace({f"pantographs.{kind}.regulation": law}, effects=effects)
    expected = catenary.run(regulated).force[1:]

    forces = []
    with catenary.Simulation(scene) as sim:
        while sim.steps_left:
            sim.step()
            number = round((sim.time - BEGIN) / sim.dt)
            if number >= 0 and number % every == 0:
                sim.lift_force = np.clip(GAIN * (TARGET - sim.contact_force), LEAST, MOST)
            forces.append(sim.contact_force)
    apart = np.abs(np.array(forces) - expected.values).max() / float(expected.max())
    print(f"relative difference {apart:.1e}, allowed 1e-10")
    assert apart < 1e-10
    plain = catenary.run(scene).force[1:]
    assert np.abs(expected.values - plain.values).max() > 1.0  # the law acts


def test_a_state_brings_everything_back(scene: catenary.Scene) -> None:
    with catenary.Simulation(scene) as sim:
        sim.step(100)
        sim.lift_force, sim.speed = 15.0, 70.0
        state = sim.save()
        sim.step(50)
        ahead = sim.contact_force
        sim.lift_force, sim.speed = 0.0, 60.0
        sim.step(50)
        sim.restore(state)
        assert sim.speed == 70.0 and sim.lift_force.tolist() == [15.0]
        sim.step(50)
        assert np.array_equal(sim.contact_force, ahead)
        with pytest.raises(catenary.InputError, match="no state of this line"):
            sim.restore(state[:-1])


def test_a_state_of_another_line_is_refused(scene: catenary.Scene, tmp_path: Path) -> None:
    """Also of the same scene prepared again, whose arrays lie otherwise in memory."""
    catenary.prepare(scene, tmp_path / "a.line")
    one, same, again = map(catenary.Simulation, (tmp_path / "a.line", tmp_path / "a.line", scene))
    faster = catenary.Simulation(scene.replace(train={"speed_km_h": 300.0}))
    one.step(100)
    state = one.save()
    same.restore(memoryview(state))
    assert same.step(50) and one.step(50)
    assert np.array_equal(same.contact_force, one.contact_force)
    for other in (again, faster):
        with pytest.raises(catenary.InputError, match="no state of this line: .* the same .line"):
            other.restore(state)
        assert other.time == 0.0
    for junk in (None, "spam", b"", 3):
        with pytest.raises(catenary.InputError, match="bytes that save|no state of this line"):
            one.restore(junk)  # type: ignore[arg-type]


def test_what_is_measured_stays_and_what_is_set_can_be_set_in_part() -> None:
    with catenary.Simulation(acting("overlap")) as sim:
        sim.step(50)
        before = sim.contact_force
        kept = before.copy()
        sim.step(50)
        assert np.array_equal(before, kept) and not np.array_equal(sim.contact_force, kept)
        sim.lift_force = 2.0
        sim.lift_force[0] += 1.0
        assert sim.lift_force.tolist() == [3.0] + [2.0] * (sim.n_pantographs - 1)
        state = sim.save()
        names = ("lift_force", "head_force", "base", "base_velocity", "base_acceleration")
        for name in names:
            values = np.linspace(0.001, 0.002, sim.n_pantographs)
            setattr(sim, name, values)
            assert np.array_equal(getattr(sim, name), values)
        sim.restore(state)
        for name in names[1:]:
            assert not getattr(sim, name).any()


@pytest.mark.parametrize("name", ["lift_force", "head_force", "base", "base_velocity"])
def test_what_is_set_acts_from_the_next_step_on(name: str, scene: catenary.Scene) -> None:
    with catenary.Simulation(scene) as sim:
        sim.step(200)
        state = sim.save()
        sim.step(50)
        plain = sim.contact_force
        sim.restore(state)
        setattr(sim, name, 0.01 if name.startswith("base") else 10.0)
        sim.step(50)
        assert np.abs(sim.contact_force - plain).max() > 1e-6


@pytest.mark.parametrize(
    ("value", "says"),
    [
        (np.nan, "must be finite"),
        ("5 N", 'lift_force is "5 N"; it must be a number or numbers'),
        ("5", 'lift_force is "5"; it must be a number or numbers'),
        (["5"], "it must be a number or numbers"),
        (np.array(["5"], dtype=object), "it must be a number or numbers"),
        (True, "lift_force is true; it must be a number or numbers"),
        ([np.True_], "it must be a number or numbers"),
        ([np.inf], "must be finite"),
        ([1.0, 2.0], r"shape \(2,\); it must be a number, or one of each of 1"),
        (np.zeros((1, 1)), "shape"),
    ],
)
def test_what_cannot_be_set_is_refused(value: Any, says: str, scene: catenary.Scene) -> None:
    with catenary.Simulation(scene) as sim, pytest.raises(catenary.InputError, match=says):
        sim.lift_force = value


def test_speeds_that_cannot_be_are_refused(scene: catenary.Scene) -> None:
    with catenary.Simulation(scene) as sim:
        for word in ("fast", "60", None, True, np.True_):
            with pytest.raises(catenary.InputError, match="speed is .*must be a number"):
                sim.speed = word  # type: ignore[assignment]
        for speed in (-1.0, np.nan, np.inf):
            with pytest.raises(catenary.InputError, match="must be at least 0"):
                sim.speed = speed
        # That of 22 kN and 1.35 kg/m.
        with pytest.raises(catenary.InputError, match=r"below the wave speed .* \(127\.7 m/s\)"):
            sim.speed = 128.0
        sim.speed = 0.0
        sim.step(10)
        assert sim.way == 0.0
    with catenary.Simulation(scene.replace(effects={"supercritical_speed": True})) as sim:
        sim.speed = 128.0
        assert sim.step()
    with catenary.Simulation(acting("rich_train")) as sim:
        with pytest.raises(catenary.InputError, match="heads of this scene roll or bend"):
            sim.speed = 50.0


def test_a_loop_that_looks_at_no_answer_ends(scene: catenary.Scene) -> None:
    with catenary.Simulation(scene) as sim:
        with pytest.raises(catenary.RunBroken, match="at the end of its way"):
            while sim.time < 1e6:
                sim.step(100)
        assert sim.step(0) and sim.steps_left == 0
        for n in (-1, 1.0, np.float64(3), "2", None, True):
            with pytest.raises(catenary.InputError, match="whole number of steps, at least 0"):
                sim.step(n)  # type: ignore[arg-type]


def test_any_whole_number_of_steps_can_be_asked_for(scene: catenary.Scene) -> None:
    with catenary.Simulation(scene) as sim:
        left = sim.steps_left
        assert sim.step(np.int64(3)) and sim.steps_left == left - 3
        assert not sim.step(10**30) and sim.steps_left == 0


def test_what_a_simulation_has_not_cannot_be_set(scene: catenary.Scene) -> None:
    with catenary.Simulation(scene) as sim:
        with pytest.raises(AttributeError, match="lift_forse"):
            sim.lift_forse = 5.0  # type: ignore[attr-defined]
        assert repr(sim) == f"<catenary.Simulation at 0 s, {sim.steps_left} steps left>"
    assert repr(sim) == "<catenary.Simulation at 0 s, closed>"


def test_a_step_that_cannot_be_taken_says_when_and_why_and_a_state_goes_on(
    scene: catenary.Scene,
) -> None:
    with catenary.Simulation(scene) as sim:
        sim.step(100)
        state = sim.save()
        sim.lift_force[0] = np.nan  # not checked: a view, for loops that must be quick
        says = rf"after {sim.time:g} s a step could not be taken, .*: lift_force is \[nan\]; it"
        with pytest.raises(catenary.RunBroken, match=says):
            sim.step()
        sim.lift_force = 0.0
        broken = sim.save()
        with pytest.raises(catenary.RunBroken, match="restore\\(\\) an earlier state"):
            sim.step()  # half of that step was taken, so that no other one can follow
        sim.restore(state)
        sim.restore(broken)
        with pytest.raises(catenary.RunBroken, match="could not be taken"):
            sim.step()
        sim.restore(state)
        assert sim.step() and np.isfinite(sim.contact_force).all()


def test_a_line_that_runs_away_under_a_controller_says_so(scene: catenary.Scene) -> None:
    with catenary.Simulation(scene) as sim:
        sim.step(200)
        height, state = sim.head_height[0], sim.save()

        def drive_on() -> None:
            nonlocal height
            while sim.step():
                rise, height = sim.head_height[0] - height, sim.head_height[0]
                sim.head_force = (5000.0 * rise / sim.dt).clip(-1e300, 1e300)  # with the motion

        with pytest.raises(catenary.RunBroken, match="a wire has turned by more than 1 rad"):
            drive_on()
        with pytest.raises(catenary.RunBroken, match="a wire has turned"):
            sim.step()
        sim.restore(state)
        assert sim.step(100)


def test_a_controller_that_drives_a_mechanism_down_is_told() -> None:
    """A run names the heights; steps from outside listed all that might be wrong."""
    with catenary.Simulation(catenary.load("ambrosio2012", short=True)) as sim:
        sim.step(50)
        sim.lift_force = -2000.0
        says = r": it has head_height \[[\d.]+\], contact_force \[0.0\], lift_force \[-2000.0\]"
        with pytest.raises(catenary.RunBroken, match=says):
            sim.step(1000)


def test_a_damaged_state_is_refused(scene: catenary.Scene) -> None:
    # Numbers of places are in it: with one of them changed the process ended.
    with catenary.Simulation(scene) as sim:
        state = sim.save()
        for at in range(0, len(state), len(state) // 97):
            damaged = bytearray(state)
            damaged[at] ^= 64
            with pytest.raises(catenary.InputError, match="no state of this line"):
                sim.restore(damaged)
        sim.restore(state)


def test_a_prepared_file_is_the_scene_that_it_was_made_of(
    scene: catenary.Scene, tmp_path: Path
) -> None:
    file = catenary.prepare(scene, str(tmp_path / "a.line"))
    assert file == tmp_path / "a.line"
    with pytest.raises(catenary.InputError, match="exists already; give force=True to replace it"):
        catenary.prepare(scene, file)
    with catenary.Simulation(tmp_path / "a.line") as sim, catenary.Simulation(scene) as other:
        sim.step(100)
        other.step(100)
        assert np.array_equal(sim.contact_force, other.contact_force)
    (tmp_path / "b.line").write_bytes(b"spam")
    for name, says in (("b.line", "no prepared line"), ("c.line", "no such file")):
        with pytest.raises(catenary.InputError, match=says):
            catenary.Simulation(str(tmp_path / name))


def test_what_needs_more_than_the_loop_is_refused() -> None:
    with pytest.raises(catenary.InputError, match="incidents change the line"):
        catenary.Simulation(acting("d_incidents"))


def test_a_closed_simulation_says_so(scene: catenary.Scene) -> None:
    with catenary.Simulation(scene) as sim:
        sim.step(10)
    assert sim.time == 10 * scene["numerics.dt_s"]
    sim.close()
    with pytest.raises(catenary.InputError, match="is closed"):
        sim.step()


def test_a_simulation_that_was_closed_at_the_end_of_the_line_says_so(scene: catenary.Scene) -> None:
    with catenary.Simulation(scene) as sim:
        assert not sim.step(10**9)
    with pytest.raises(catenary.InputError, match="is closed"):
        sim.step()


def test_a_simulation_says_what_to_do_where_it_is_to_be_pickled(scene: catenary.Scene) -> None:
    with catenary.Simulation(scene) as sim, pytest.raises(TypeError, match=r"prepare\(\) a file"):
        pickle.dumps(sim)
