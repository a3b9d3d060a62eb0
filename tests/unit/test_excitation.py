"""What sets a contact wire into motion: forces on nodes, courses in time, what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from small_lines import BARE, bare_wires, mesh_of, problem_of, train

from catenary import InputError
from catenary.cases.studies.asked import Excited
from catenary.cases.studies.waves.study import excitation_of, without_train
from catenary.solver.effects.build_model import build
from catenary.solver.model.loads import FieldLoad, ShapeLoad
from catenary.solver.problem.problem import Problem
from catenary.solver.waves.excitation import Blow, MovingForce, hammer
from catenary.solver.waves.excitation_load import load_of

LENGTH = 60.0


def problem() -> Problem:
    return problem_of(bare_wires(LENGTH), BARE, train=train(50.0, 10.0, 40.0))


def test_a_force_between_nodes_does_the_work_of_its_place() -> None:
    """Shape functions are cubic: a force F at x does the work F x^3 on w = x^3, whatever its
    element."""
    model = build(problem(), mesh_of(bare_wires(LENGTH), 16), np.zeros(0))
    nodes = model.contact_nodes
    x = model.mesh.x(nodes)
    cubic = np.zeros(model.n_dofs)
    cubic[model.dofs(nodes)], cubic[model.dofs(nodes, "theta_y")] = x**3, 3 * x**2
    blow = load_of(Blow(33.3, 0.1, 100.0, False), model, 1e-3)
    assert isinstance(blow, ShapeLoad)
    assert blow.forces @ cubic[blow.unknowns] == pytest.approx(100.0 * 33.3**3, rel=1e-12)
    moving = load_of(MovingForce(100.0, 0.0, 10.0, 50.0, 0.2), model, 1e-3)
    assert isinstance(moving, FieldLoad)
    slices = np.empty((3, moving.unknowns.size))
    moving.fill(100, slice(0, moving.unknowns.size), slices)
    places = 10.0 + 50.0 * 1e-3 * np.arange(100, 103)
    grown = 0.5 * (1.0 - np.cos(np.pi * 1e-3 * np.arange(100, 103) / 0.2))
    np.testing.assert_allclose(
        slices @ cubic[moving.unknowns], 100.0 * grown * places**3, rtol=1e-12
    )
    # A part of the points is that part of the whole.
    part = np.empty((3, 9))
    moving.fill(100, slice(4, 13), part)
    np.testing.assert_array_equal(part, slices[:, 4:13])
    # Beyond the ends there is no wire.
    moving.fill(2000, slice(0, moving.unknowns.size), slices)
    assert not slices.any()


def test_a_hammer_has_its_impulse_and_a_pulse_its_force() -> None:
    struck = hammer(20.0, 10.0, 0.02)
    assert struck.peak == pytest.approx(10.0 * np.pi / 0.04)
    assert struck.impulse == pytest.approx(10.0)
    model = build(problem(), mesh_of(bare_wires(LENGTH), 16), np.zeros(0))
    for blow in (struck, Blow(20.0, 0.1, 100.0, False)):
        load = load_of(blow, model, 1e-3)
        assert isinstance(load, ShapeLoad)
        n = load.factor.numbers.size // 2
        times, values = load.factor.numbers[:n], load.factor.numbers[n:]
        assert values[0] == 0.0 and abs(values[-1]) < 1e-12 and values.max() == pytest.approx(1.0)
        # Lines between 641 points: (pi / 640)^2 / 12 of half a sine, less of a whole cosine.
        assert blow.peak * 0.5 * (values[1:] + values[:-1]) @ np.diff(times) == pytest.approx(
            blow.impulse, rel=3e-6
        )


def test_a_scene_gives_what_is_not_asked_for() -> None:
    found = excitation_of("force", Excited(), problem(), 1e-3)
    assert found == MovingForce(120.0, 0.0, 10.0, 50.0, 0.5)
    found = excitation_of("pulse", Excited(at=20.0), problem(), 1e-3)
    assert found == Blow(20.0, 0.1, 120.0, False)
    found = excitation_of("hammer", Excited(impulse=5.0, duration=0.05), problem(), 1e-3)
    assert found == hammer(30.0, 5.0, 0.05)


def test_a_blow_is_marched_until_its_waves_have_come_to_the_far_end() -> None:
    left = without_train(problem(), Blow(20.0, 0.1, 100.0, False))
    slowest = min(wire.wave_speed for wire in left.line.wires)
    lasts = (left.train.end - left.train.start) / left.train.speed
    assert lasts == pytest.approx(0.1 + 40.0 / slowest)
    assert left.contact.stiffness == 0.0 and left.train.placements[0].static_force == 0.0
    moving = without_train(problem(), MovingForce(1.0, 0.0, 10.0, 50.0, 0.1))
    assert (moving.train.start, moving.train.end, moving.train.speed) == (10.0, 40.0, 50.0)


@pytest.mark.parametrize(
    ("kind", "settings", "sentence"),
    [
        ("force", Excited(at=20.0), "--at-m belongs to --excite pulse or hammer, not to force"),
        ("hammer", Excited(force=20.0), "--force-N belongs to --excite force or pulse, not to"),
        (
            "pulse",
            Excited(frequency=2.0),
            "--frequency-Hz belongs to --excite force, not to pulse",
        ),
        ("pulse", Excited(at=60.0), "--at-m is 60, but must lie on the line, from 0 to 60 m"),
        ("pulse", Excited(at=np.nan), "--at-m is nan, but must be finite"),
        ("hammer", Excited(impulse=0.0), "--impulse-Ns is 0, which excites nothing"),
        ("force", Excited(force=0.0), "--force-N is 0, which excites nothing"),
        ("force", Excited(frequency=101.0), "--frequency-Hz is 101, but must be from 0 to 100"),
        ("force", Excited(frequency=-1.0), "--frequency-Hz is -1, but must be from 0 to 100"),
        ("hammer", Excited(duration=0.005), "--duration-s is 0.005, but must be from 0.01"),
        (
            "hammer",
            Excited(impulse=1e300),
            "--impulse-Ns is 1e+300, a force of up to 7.85398e+301 N",
        ),
        (
            "hammer",
            Excited(impulse=-1e308),
            "--impulse-Ns is -1e+308, a force of up to inf N, but",
        ),
        ("pulse", Excited(force=1e20), "a force of up to 1e+20 N, but forces up to 1e+09 N are"),
        (
            "force",
            Excited(force=-2e9),
            "--force-N is -2e+09, a force of up to 2e+09 N, but forces",
        ),
    ],
)
def test_what_is_impossible_is_refused_in_a_sentence(
    kind: str, settings: Excited, sentence: str
) -> None:
    with pytest.raises(InputError) as error:
        excitation_of(kind, settings, problem(), 1e-3)
    assert sentence in str(error.value)
