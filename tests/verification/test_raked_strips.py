"""Strips at an angle to the cross-section meet the wire ahead of or behind their middle."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from measuring import check, march
from mpi4py import MPI
from scipy.optimize import brentq
from small_lines import EN_PANTOGRAPH, WHOLE, en50318_line, mesh_of, numerics, problem_of, train

from catenary.mbs.head.strips import Strips, Turning
from catenary.mbs.interface import N_DRIVE, drive_width
from catenary.meshgen.topologies.line_data import LineData
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.contact.pantographs import Pantographs, leads_of
from catenary.solver.kernels import native
from catenary.solver.model.partition import distribute
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.form_finding import find_form

RAKE = math.radians(20.0)
NAMES = WHOLE | {"raked_strips"}
SPAN = 60.0


def line(stagger: tuple[float, ...]) -> LineData:
    return replace(en50318_line(len(stagger) - 1), stagger=stagger)


def problem(stagger: tuple[float, ...], rake: float, start: float, names: set[str]) -> Problem:
    data = replace(EN_PANTOGRAPH, strips=Strips(2, 0.5, 1.6, rake=rake))
    run = train(70.0, start, start + 60.0, raise_time=0.1, nominal_height=5.05, data=data)
    return problem_of(line(stagger), frozenset(names), train=run, numerics=numerics(1e-3))


def test_under_a_wire_beside_the_track_it_is_a_strip_ahead() -> None:
    """The wire runs parallel to the track, so that each contact leads by the same way."""
    stagger = (0.3,) * 5
    lead = 0.3 * math.tan(RAKE)
    raked = problem(stagger, RAKE, 70.0, set(NAMES))
    ahead = problem(stagger, 0.0, 70.0 + lead, set(NAMES))
    mesh = mesh_of(line(stagger), 3)
    seen, expected = march(raked, mesh), march(ahead, mesh)
    plain = march(problem(stagger, 0.0, 70.0, set(NAMES)), mesh)
    # The head starts at the height of the wire above its middle, 0.1 mm lower or higher: some of
    # that is still there after half a second.
    late = np.array(seen.time) > 0.5
    force, other = expected["contact_force"][late], plain["contact_force"][late]
    check("force [N]", seen["contact_force"][late], force, within=4e-3 * np.ptp(force))
    # As much as 0.11 m of travel makes.
    assert np.abs(other - force).max() > 0.05 * np.ptp(force)


def test_an_effect_that_is_left_out_leaves_the_strips_square() -> None:
    stagger = (0.3,) * 5
    mesh = mesh_of(line(stagger), 2)
    square, left_out = (
        march(problem(stagger, rake, 70.0, set(WHOLE)), mesh)["contact_force"]
        for rake in (0.0, RAKE)
    )
    assert np.array_equal(square, left_out)


@pytest.mark.parametrize("rake", [RAKE, -math.radians(40.0)])
def test_contacts_are_where_a_straight_strip_crosses_a_zigzag(rake: float) -> None:
    stagger = (0.2, -0.3, 0.25, 0.25, -0.2)
    own = problem(stagger, rake, 70.0, set(NAMES))
    model, form = find_form(own, mesh_of(own.line, 2))
    wires = ContactWires(model, form, distribute(model, 1, 0))
    leads = leads_of(wires, np.zeros(3, dtype=int), np.array([rake, 0.0, rake]))
    assert leads.contact.tolist() == [0, 2]
    supports = SPAN * np.arange(len(stagger))
    start, places = np.array([5.0, 5.0, 6.0, 5.5]), np.zeros(4)
    for way in np.linspace(0.0, 220.0, 1201):
        native.move_contacts(native.TrainPlaces(start, places, leads), way)
        for at in (0, 2):
            middle = start[at] + way

            def misses(x: float, middle: float = middle) -> float:
                return float(x - middle - math.tan(rake) * np.interp(x, supports, stagger))

            expected = brentq(misses, middle - 1.0, middle + 1.0, xtol=1e-13)
            assert places[at] == pytest.approx(expected, abs=1e-11)
        assert places[1] == start[1] + way and places[3] == start[3] + way


@pytest.mark.parametrize("rake", [RAKE, -math.radians(40.0)])
def test_a_head_that_rolls_is_pressed_where_the_wire_crosses_its_raked_strips(rake: float) -> None:
    """The contact is ahead of the strip's middle, and so is the stagger that is its lever.

    Along the contact's way x = m + tan(r) y(x) the lever changes by y' V / (1 - tan(r) y').
    """
    stagger, speed, start = (0.2, -0.3, 0.25, 0.25, -0.2), 70.0, 70.0
    plain = problem(stagger, rake, start, NAMES | {"head_roll"})
    strips = plain.train.placements[0].data.strips
    rolling = replace(EN_PANTOGRAPH, strips=strips, roll=Turning(2.0, 470.0, 1.0))
    own = replace(plain, train=train(speed, start, start + 60.0, data=rolling))
    model, form = find_form(own, mesh_of(own.line, 2))
    wires = ContactWires(model, form, distribute(model, 1, 0))
    heads = Pantographs(MPI.COMM_SELF, own, model.simulated, wires, lambda _: 5.05)
    times = np.arange(1, 800) * 1e-3
    drives = np.zeros((times.size, 1, drive_width(2)))
    heads.fill_drives(times, drives)
    supports = SPAN * np.arange(len(stagger))
    slopes = np.diff(stagger) / SPAN
    for number, offset in enumerate(strips.offsets):
        middles = start + offset + speed * times
        places = middles + math.tan(rake) * np.interp(middles, supports, stagger)
        for _ in range(20):  # each time the error falls by tan(r) y' = 0.007
            places = middles + math.tan(rake) * np.interp(places, supports, stagger)
        slope = slopes[np.searchsorted(supports, places) - 1]
        place, rate = drives[:, 0, N_DRIVE + number], drives[:, 0, N_DRIVE + 2 + number]
        check("lever [m]", place, np.interp(places, supports, stagger), within=1e-12)
        expected = speed * slope / (1.0 - math.tan(rake) * slope)
        check("its rate [m/s]", rate, expected, within=1e-10)
    assert np.ptp(place) > 0.3
