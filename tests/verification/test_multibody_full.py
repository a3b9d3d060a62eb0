"""All bodies in the time loop: static force, head and mechanism reduced, restart, roll, base."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import paper_pantograph as paper
import pytest
from measuring import check
from seven_bodies import at_rest, calibrated, pressed

from catenary import CatenaryError, InputError, RunBroken
from catenary.mbs.build import raising_data
from catenary.mbs.head.pantograph import Pantograph
from catenary.mbs.head.stepping import LateralPath, Stepping
from catenary.mbs.head.strips import Strips, Suspension
from catenary.mbs.mechanism.full_pantograph import FullPantograph
from catenary.mbs.mechanism.multibody_pantograph import stand
from catenary.mbs.mechanism.reduction import RaisingPantograph
from catenary.mbs.response import linearise
from catenary.mbs.rigid.implicit_steps import METHODS
from catenary.mbs.rigid.joints import PrescribedAngle
from catenary.mbs.rigid.system import without_spins
from catenary.mbs.vehicle import BaseMotion, Spline, VehicleMotion

STATIC, HEIGHT, DT = 150.0, 5.08, 1e-3
WIRE = 5e4  # [N/m] contact, on a wire that does not give way


def full(
    raise_time: float = 0.5,
    handling: str = "coordinate_partitioning",
    substeps: int = 1,
    **moved: Any,
) -> FullPantograph:
    stepping = Stepping(raise_time, DT, **moved)
    return FullPantograph(
        paper.data(), STATIC, HEIGHT, stepping, handling=handling, substeps=substeps
    )


def reduced(base: BaseMotion | None = None) -> RaisingPantograph:
    return RaisingPantograph(
        raising_data(paper.data(), STATIC, HEIGHT), Stepping(2.0, DT, base=base)
    )


def growing(times: np.ndarray) -> np.ndarray:
    """From 0 to 1 over 2 s, without kinks."""
    return 0.5 * (1.0 - np.cos(np.pi * np.minimum(times / 2.0, 1.0)))


def run_below(
    pantograph: Pantograph, wire: np.ndarray, damping: float = 0.0, first: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Contact forces and heights of the head below a wire at heights (n,), one a step.

    f = WIRE (z - z_wire) + ``damping`` dz/dt while that pushes, with the forces that the step's
    affine answer gives: implicit, as in the line.
    """
    forces, heights = np.zeros((2, len(wire)))
    for number, at in enumerate(wire):
        head = pantograph.predict((first + number + 1) * DT)
        free = WIRE * (head.height[0] - at) + damping * head.velocity[0]
        soft = WIRE * head.height_compliance[0, 0] + damping * head.velocity_compliance[0, 0]
        force = np.array([max(free / (1.0 + soft), 0.0)])
        pantograph.advance(force)
        forces[number] = force[0]
        heights[number] = head.height[0] - head.height_compliance[0, 0] * force[0]
    return forces, heights


@pytest.mark.study
def test_raised_below_a_still_wire_it_presses_with_its_static_force() -> None:
    """Raised from 1 mm below; a damper at the head calms the rest within some seconds.

    The frame swings on the head's springs and the wire with a decay of 26 / (2 25.7) 1/s: e^-2 of
    what began as 150 N after 4 s, with a mean over its periods of 0.2 s of a tenth of it: 2 N.
    """
    pantograph = full()
    pantograph.place(HEIGHT - 1e-3)
    forces, heights = run_below(pantograph, np.full(5000, HEIGHT - STATIC / WIRE), damping=500.0)
    check("static force [N]", forces[-1000:].mean(), STATIC, within=2.0)
    check("head [m]", heights[-1000:].mean(), HEIGHT, within=2.0 / WIRE)
    assert pantograph.violation[0] < 1e-9


@pytest.mark.study
def test_reduced_pantograph_follows_the_bodies_below_a_lively_wire() -> None:
    """A wire that moves by 20 mm at 1 Hz and 1 mm at 8 Hz: forces of 30 N and more around 150 N.

    Reduced, the arm carries the head's mass along the track: without it the forces differ by
    0.07 N rms at 1 Hz. Touching from the start and raised slowly, so that little else swings: what
    swings freely differs by 0.36 N rms in the third second and calms with 0.4 1/s, which leaves
    0.033 N in the ninth.
    """
    times = DT * np.arange(1, 9001)
    wire = 0.02 * np.sin(2 * np.pi * times) + 1e-3 * np.sin(16 * np.pi * times)
    wire = HEIGHT - STATIC / WIRE + growing(times) * wire
    found = {}
    for name, pantograph in (("all bodies", full(raise_time=2.0)), ("reduced", reduced())):
        pantograph.place(HEIGHT - STATIC / WIRE)
        found[name] = run_below(pantograph, wire)
    late = slice(8000, None)
    force, other = (found[name][0][late] for name in ("all bodies", "reduced"))
    print(f"all bodies: {force.mean():.2f} N, sigma {force.std():.2f} N")
    assert force.std() > 20.0
    off = np.sqrt(np.mean((force - other) ** 2))
    check("force, rms of the difference [N]", off, 0.0, within=0.05)


@pytest.mark.parametrize("method", METHODS)
def test_ways_of_keeping_joints_give_the_same_force(method: str) -> None:
    """What they differ by in a step, of order h^4, stays below 1e-3 N; joints 1e-9 m."""
    times = DT * np.arange(1, 401)
    wire = HEIGHT - STATIC / WIRE + 2e-3 * np.sin(6 * np.pi * times)
    pantograph, other = full(handling=method), full(handling="coordinate_partitioning")
    for each in (pantograph, other):
        each.place(HEIGHT - 1e-3)
    (mine, _), (theirs, _) = run_below(pantograph, wire), run_below(other, wire)
    check("force [N]", mine, theirs, within=1e-3)
    assert pantograph.violation[0] < 1e-9


def test_substeps_converge_on_shorter_steps() -> None:
    """Substeps of 0.25 ms, contact every 1 ms: they differ by the rule's error of the longer."""
    times = DT * np.arange(1, 401)
    wire = HEIGHT - STATIC / WIRE + 2e-3 * np.sin(6 * np.pi * times)
    found = []
    for substeps in (1, 4):
        pantograph = full(substeps=substeps)
        pantograph.place(HEIGHT - 1e-3)
        found.append(run_below(pantograph, wire)[0])
    # The trapezoidal rule's (w h)^2 / 12 of the head on the wire, w = 80 1/s: a phase of
    # 5e-4 w t = 0.017 rad after 0.4 s, of a swing of 150 N.
    check("force [N]", found[0], found[1], within=3.0)
    assert np.abs(found[0] - found[1]).max() > 0.0


def test_state_is_all_that_is_needed_to_continue() -> None:
    one, other = full(raise_time=0.1), full(raise_time=0.1)
    wire = np.full(80, HEIGHT - STATIC / WIRE)
    one.place(HEIGHT - 1e-3)
    run_below(one, wire[:50])
    other.restore(one.state())
    for pantograph in (one, other):
        run_below(pantograph, wire[50:], first=50)
    assert (one.state() == other.state()).all()
    assert one.motion.velocities.any()


def test_placed_head_rests_or_moves_as_it_was_told() -> None:
    pantograph = full()
    pantograph.place(4.9)
    height, velocity = pantograph.extrapolate(DT)
    check("height [m]", height, 4.9, within=1e-9)
    check("velocity [m/s]", velocity, 0.0, within=1e-9)
    head = pantograph.predict(DT)
    check("after a step [m]", head.height, 4.9, within=1e-8)
    # Newmark's beta h^2 over the head's mass with its spring's and damper's parts, arm at rest.
    expected = 0.25 * DT**2 / (7.8 + 0.5 * DT * 26.0 + 0.25 * DT**2 * 6000.0)
    check("compliance [m/N]", head.height_compliance, expected, within=1e-4 * expected)
    pantograph.place(4.9, 0.3)
    height, velocity = pantograph.extrapolate(DT)
    check("velocity [m/s]", velocity, 0.3, within=1e-3)
    with pytest.raises(CatenaryError):
        pantograph.place(9.0)


def test_wire_beside_the_middle_rolls_the_head() -> None:
    """0.2 m to the side: 1 / m + l^2 / I of the head, 7.8 kg and 6.62 kg m^2.

    With Newmark's parts of springs and dampers, 6000 N/m and 26 N s/m, 0.335 m to both sides.
    """
    beside = LateralPath([(np.array([0.0, 100.0]), (0.2, 0.2))], 0.0, (0.0,), 50.0)
    pantograph = full(lateral=beside)
    pantograph.place(HEIGHT)
    found = pantograph.predict(DT).height_compliance
    part = 0.5 * DT * 26.0 + 0.25 * DT**2 * 6000.0
    expected = 0.25 * DT**2 * (1 / (7.8 + part) + 0.2**2 / (6.62 + 0.335**2 * part))
    check("compliance [m/N]", found, expected, within=1e-3 * expected)
    force = np.array([100.0])
    pantograph.advance(force)
    for number in range(1, 50):
        pantograph.predict(DT * (number + 1))
        pantograph.advance(force)
    # Pushed down on its left the head turns about the track.
    assert pantograph.motion.rotation[pantograph.motion.numbers[paper.HEAD]][2, 1] < -1e-4


@pytest.mark.study
def test_vehicle_that_heaves_moves_it_as_the_reduced_one() -> None:
    """10 mm at 2 Hz, wire at rest: what the head feels of it, within what reduction leaves out.

    That is 1 % as in the test above, near the frame's own 2.3 Hz on the head's springs: there
    0.2 % of frequency are 0.4 % / |1 - (2 / 2.3)^2| more, 2 %.
    """
    times = np.linspace(0.0, 6.0, 601)
    heave = Spline(tuple(times), tuple(0.01 * np.sin(4 * np.pi * times) * growing(times)))
    vehicle = VehicleMotion(vertical=(heave,))
    bases = [BaseMotion(vehicle, 0.0, 80.0) for _ in range(2)]
    found = []
    for pantograph in (full(base=bases[0], raise_time=2.0), reduced(base=bases[1])):
        pantograph.place(HEIGHT - STATIC / WIRE)
        found.append(run_below(pantograph, np.full(5000, HEIGHT - STATIC / WIRE))[0])
    force, other = (each[3000:] for each in found)
    print(f"all bodies: {force.mean():.2f} N, sigma {force.std():.2f} N")
    assert force.std() > 20.0
    off = np.sqrt(np.mean((force - other) ** 2))
    check("force, rms of the difference [N]", off, 0.0, within=0.03 * force.std())


def test_lower_link_of_the_paper_tips_over_unless_it_is_kept_from_spinning() -> None:
    """Its mass lies above the line between its balls: a motion that grows with 2.7 1/s."""
    system = calibrated()
    rest = at_rest(pressed(system))
    growing = [
        m for m in linearise(pressed(system), rest, paper.HEAD).modes() if m.root.real > 1e-6
    ]
    check("growth [1/s]", [mode.root.real for mode in growing], [2.70], within=0.01)
    held = without_spins(pressed(system), rest)
    added = [joint for joint in held.joints if isinstance(joint, PrescribedAngle)]
    assert [joint.name for joint in added] == ["no spin of lower_link", "no spin of upper_link"]
    check("rows [m]", held.constraints(rest, 0.0).value, 0.0, within=1e-9)
    model = linearise(held, rest, paper.HEAD)
    assert all(mode.root.real < 1e-6 for mode in model.modes()) and model.n_left_out == 0
    assert held.redundant(rest) == ()


def test_strips_with_springs_of_their_own_are_refused() -> None:
    strips = Strips(2, 0.4, suspension=Suspension(1.0, 5000.0, 10.0))
    with pytest.raises(InputError, match="'seven_body': strips with a suspension of their own"):
        FullPantograph(replace(paper.data(), strips=strips), STATIC, HEIGHT, Stepping(0.5, DT))
    assert stand(paper.data()).n_freedoms == 5


def test_breaking_is_told_with_the_pantograph_s_name() -> None:
    """A contact force beyond all measure throws the head too far for its joints to follow."""
    pantograph = full()
    pantograph.place(HEIGHT)
    with pytest.raises(RunBroken, match="Pantograph 'seven_body': "):
        for number in range(20):
            pantograph.predict((number + 1) * DT)
            pantograph.advance(np.array([1e9]))
