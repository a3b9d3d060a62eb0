"""Where heads touch the wire, and the head height of the static force."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from measuring import march
from small_lines import (
    EN_CONTACT_WIRE,
    EN_PANTOGRAPH,
    HANGING,
    WHOLE,
    ac_simple_line,
    bare_wires,
    mesh_of,
    numerics,
    problem_of,
    train,
)

from catenary.meshgen.topologies.line_data import LineData
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.contact.pantographs import nominal_height_rule
from catenary.solver.kernels import native
from catenary.solver.model.partition import distribute
from catenary.solver.problem.problem import Placement
from catenary.solver.statics.elasticity import elasticity, middle_span
from catenary.solver.statics.form_finding import find_form

# --- where heads touch the wire -------------------------------------------------------------------


LINE = ac_simple_line(4)
EPS = np.finfo(float).eps


@pytest.fixture(scope="module")
def wire() -> ContactWires:
    model, form = find_form(problem_of(LINE, HANGING), mesh_of(LINE, 3))
    return ContactWires(model, form, distribute(model, 1, 0))


def test_positions_fall_into_the_elements_that_hold_them(wire: ContactWires) -> None:
    x = np.linspace(0.0, wire.x[-1], 997)
    touches = wire.touches(x)
    assert (wire.x[touches["element"]] <= x).all()
    assert (x <= wire.x[touches["element"] + 1]).all()
    # A node belongs to the element that it ends, the first one to the first element.
    at_nodes = wire.touches(wire.x)
    assert np.array_equal(at_nodes["element"], np.maximum(np.arange(wire.x.size) - 1, 0))


def test_places_are_found_from_wherever_a_contact_was_before(wire: ContactWires) -> None:
    """A step mostly stays in its element; a start, a restart or a shorter step need not."""
    for x in (0.0, 110.0, 3.0, wire.x[7], wire.x[-1] + 1.0, wire.x[-1], wire.x[6], -1.0):
        place = np.array([x])
        moved = wire.touches(np.array([57.0]))
        native.locate(place, wire.shapes, moved)
        assert moved.tobytes() == wire.touches(place).tobytes()
        expected = np.clip(np.searchsorted(wire.x, x) - 1, 0, wire.x.size - 2)
        assert moved["element"][0] == expected


def test_slopes_are_the_derivatives_of_the_values(wire: ContactWires) -> None:
    """Central differences over 2 mm: error h^2 / 6 of a cubic's third derivative, 12 / l^3."""
    step = 1e-3
    middle = (wire.x[:-1] + wire.x[1:]) / 2 + 0.1
    before, at, after = (wire.touches(middle + shift) for shift in (-step, 0.0, step))
    difference = (after["whole_value"] - before["whole_value"]) / (2 * step)
    shortest = np.diff(wire.x).min()
    round_off = 4 * EPS * wire.x[-1] / (shortest * step)
    error = step**2 / 6 * 12 / shortest**3 + round_off
    assert np.abs(difference - at["whole_slope"]).max() < error
    assert np.array_equal(at["value"], at["whole_value"])  # one rank owns everything


def test_height_at_rest_is_continuous_and_that_of_the_nodes(wire: ContactWires) -> None:
    before, after = wire.touches(wire.x[1:-1] - 1e-9), wire.touches(wire.x[1:-1] + 1e-9)
    heights = [(t["whole_value"] * t["rest"]).sum(axis=1) for t in (before, after)]
    # 2 nm further along a slope below 1/10.
    assert np.abs(heights[1] - heights[0]).max() < 2e-10 + 16 * EPS * LINE.contact_height


def test_a_run_that_ends_at_a_node_stays_within_its_stretch(wire: ContactWires) -> None:
    """Positions are start + V t: their last bit must not lead out of the tabulated columns."""
    passed, outside = 0, 0
    for speed, dt in itertools.product((50.0, 250 / 3.6, 83.3), (1e-3, 0.7e-3)):
        for node in wire.x[20:]:
            for n_steps in range(300, 305):
                start = node - speed * n_steps * dt
                at_end = start + speed * (n_steps * dt)
                first, last = wire.nodes_between(start, node)
                element = int(wire.touches(np.array([at_end]))["element"][0])
                passed += at_end > node
                outside += not first <= element < last - 1
    print(f"{passed} positions pass the end by round-off")
    assert passed > 0
    assert outside == 0


def test_a_march_may_end_exactly_at_a_node() -> None:
    """The mast at 110 m; what comes behind the end of a run does not change the run."""
    problem = problem_of(LINE, WHOLE, train=train(50.0, 74.0, 110.0), numerics=numerics(1e-3))
    mesh = mesh_of(LINE, 3)
    history = march(problem, mesh)
    further = march(replace(problem, train=replace(problem.train, end=112.0)), mesh)
    assert len(history.time) == 721
    force = further["contact_force"][:721]
    assert np.abs(history["contact_force"] - force).max() <= 1e-9 * np.abs(force).max()


# --- head height of the static force --------------------------------------------------------------


def height_on(line: LineData, elements: int, placement: Placement) -> float:
    model, form = find_form(problem_of(line, HANGING), mesh_of(line, elements))
    lift = elasticity(model, *middle_span(model.problem.line))
    wires = ContactWires(model, form, distribute(model, 1, 0))
    return nominal_height_rule(model.problem, model.simulated, wires, lift)(placement)


def test_a_given_height_is_taken() -> None:
    placement = Placement(EN_PANTOGRAPH, 120.0, 0.0, nominal_height=5.321)
    assert height_on(ac_simple_line(3), 2, placement) == 5.321


def test_mean_of_a_single_wire_has_its_closed_form() -> None:
    """Mean sag q L^2 / (12 T), mean lift F L / (6 T), less what bending takes from both.

    Bending takes q EI / T^2 from the sag and F / (2 T lambda) from the lift in the middle part,
    lambda^2 = T / EI; over the boundary layers at the ends, 1 / lambda wide, less.
    """
    length, force, n_elements = 60.0, 120.0, 240
    wire = EN_CONTACT_WIRE
    inverse = np.sqrt(wire.tension / wire.bending_stiffness)
    q = wire.mass_per_length * 9.81
    sag = q * length**2 / (12 * wire.tension) - q * wire.bending_stiffness / wire.tension**2
    lift = force * length / (6 * wire.tension) - force / (2 * wire.tension * inverse)
    found = height_on(bare_wires(length), n_elements, Placement(EN_PANTOGRAPH, force, 0.0))
    # Elements of h = 0.25 m do not resolve a layer of 0.1 m, but can be off by no more than all
    # of it; the boundary layers at the ends take their share 2 / (lambda L) of it; the trapezoidal
    # rule adds h^2 / 12 of the second derivatives, q / T and 2 F / (T L).
    h = length / n_elements
    layer = force / (2 * wire.tension * inverse)
    rule = h**2 / 12 * (q / wire.tension + 2 * force / (wire.tension * length))
    print(f"sag {sag:.5f} m, lift {lift:.5f} m, boundary layer {layer:.5f} m")
    assert found == pytest.approx(5.5 - sag + lift, abs=layer + rule)
    without = height_on(bare_wires(length), n_elements, Placement(EN_PANTOGRAPH, 0.0, 0.0))
    assert without == pytest.approx(5.5 - sag, abs=rule + q / wire.tension / inverse**2 * h)


def test_it_rises_with_the_static_force_by_the_mean_elasticity() -> None:
    line = ac_simple_line(5)
    model, form = find_form(problem_of(line, HANGING), mesh_of(line, 4))
    lift = elasticity(model, *middle_span(model.problem.line))
    rule = nominal_height_rule(
        model.problem, model.simulated, ContactWires(model, form, distribute(model, 1, 0)), lift
    )
    low, high = (rule(Placement(EN_PANTOGRAPH, force, 0.0)) for force in (50.0, 150.0))
    parts = (lift.lift[1:] + lift.lift[:-1]) / 2 * np.diff(lift.x)
    mean = parts.sum() / (lift.x[-1] - lift.x[0])
    assert (high - low) / 100.0 == pytest.approx(mean, rel=1e-12)
    print(f"mean elasticity {1e3 * mean:.3f} mm/N")
