"""Head height of the static force: given, or the mean height of the wire that it lifts."""

from __future__ import annotations

import numpy as np
import pytest
from small_lines import (
    EN_CONTACT_WIRE,
    EN_PANTOGRAPH,
    HANGING,
    ac_simple_line,
    bare_wires,
    mesh_of,
    problem_of,
)

from catenary.meshgen.topologies.line_data import LineData
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.contact.pantographs import nominal_height_rule
from catenary.solver.model.partition import distribute
from catenary.solver.problem.problem import Placement
from catenary.solver.statics.elasticity import elasticity, middle_span
from catenary.solver.statics.form_finding import find_form


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
