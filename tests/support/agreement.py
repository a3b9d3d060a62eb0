"""The seven-body pantograph under one lively load by all methods there are, side by side."""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np
import paper_pantograph as ambrosio
import plane_pantograph
from constraint_handling import (
    AugmentedLagrangian,
    Baumgarte,
    ConstraintHandling,
    CoordinatePartitioning,
)
from seven_bodies import HEAD, UPRIGHT, at_rest, calibrated, lively_load, pressed
from variable_steps import integrate

from catenary.mbs.rigid.forces import Actuator
from catenary.mbs.rigid.implicit_steps import METHODS, Stepper

# Heights are kept at these intervals [s].
EVERY = 0.25


class Way(NamedTuple):
    """Heights of the head (n,) [m], the joints' largest error [m], wall time [s]."""

    heights: np.ndarray
    opened: float
    wall: float


def ways(end: float, dt: float, methods: tuple[str, ...] = tuple(METHODS)) -> dict[str, Way]:
    """The head's way from rest to ``end`` [s] by each method; fixed steps of ``dt`` [s].

    The lower link is kept upright (see `seven_bodies.UPRIGHT`): the plane has no other place.
    """
    system = calibrated().with_joints(UPRIGHT)
    rest = at_rest(pressed(system))
    loaded, number = pressed(system, lively_load), rest.numbers[HEAD]
    times = np.linspace(0.0, end, round(end / EVERY) + 1)
    found = {}
    handlings: tuple[ConstraintHandling, ...] = (
        Baumgarte(),
        AugmentedLagrangian(),
        CoordinatePartitioning(),
    )
    for handling in handlings:
        begin = time.perf_counter()
        # Per step; some 1500 of them, of a motion that forgets errors slowly.
        way = integrate(loaded, handling, rest, times, rtol=1e-9, atol=1e-10)
        heights = np.array([motion.position[number, 2] for motion in way.motions])
        name = f"{type(handling).__name__}, variable steps"
        opened = float(way.position_error.max())
        found[name] = Way(heights, opened, time.perf_counter() - begin)
    for method in methods:
        begin = time.perf_counter()
        stepper = Stepper(loaded, dt, method)
        stepper.begin(rest, 0.0)
        seen, opened = [rest.position[number, 2]], 0.0
        for count in range(1, round(end / dt) + 1):
            stepper.step()
            opened = max(opened, stepper.violation())
            if count % round(EVERY / dt) == 0:
                seen.append(stepper.motion.position[number, 2])
        name = f"{method}, steps of {1e3 * dt:g} ms"
        found[name] = Way(np.array(seen), opened, time.perf_counter() - begin)
    begin = time.perf_counter()
    actuator = system.force(ambrosio.ACTUATOR)
    assert isinstance(actuator, Actuator)
    heights = plane_pantograph.head_heights(actuator.force, lively_load, times)
    found["two coordinates in the plane"] = Way(heights, 0.0, time.perf_counter() - begin)
    return found


def print_agreement(found: dict[str, Way], reference: str) -> dict[str, float]:
    """Print and return how far each way is from the reference at most [m]."""
    expected = found[reference].heights
    print(f"head moves over {1e3 * np.ptp(expected):.2f} mm; differences from {reference}:")
    far = {}
    for name, way in found.items():
        far[name] = float(np.abs(way.heights - expected).max())
        print(f"  {name:44} {far[name]:.2e} m, joints {way.opened:.1e} m, {way.wall:5.1f} s")
    return far
