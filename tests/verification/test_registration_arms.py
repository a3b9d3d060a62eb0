"""Registration arms that give: springs between hinges and masts, in series with steady arms.

A bare wire of tension T on arms of stiffness k every L: between arms it is straight, so that

    T / L (2 u_i - u_i-1 - u_i+1) + k u_i = F_i .

A force F at one arm of a long line moves it by F / sqrt(k^2 + 4 k T / L); a uniform load p moves
every arm by p L / k.
"""

from __future__ import annotations

import numpy as np
import pytest
from measuring import check, matrix_of, solve_free
from scenes import load_scene, mesh_of, problem_of

from catenary import InputError
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.statics.form_finding import find_form

TENSION, SPAN, BENDING = 10e3, 30.0, 110.0
# By which a steady arm itself gives [m/N].
BAR = 1e-7
ARM = "line.steady_arm"
LINE = (
    "effects.lateral_motion=true",
    "line.n_spans=40",
    "mesh.elements_per_gap=20",
    f"{ARM}.length_m=1.2",
    f"{ARM}.inclination_deg=0",
)


def at_rest(*words: str) -> tuple[Model, Equilibrium]:
    scene = load_scene("tramway", [*LINE, *words])
    return find_form(problem_of(scene), mesh_of(scene))


@pytest.mark.parametrize("stiffness", [2e3, 3e4, 1e6])
def test_a_force_at_an_arm_is_shared_with_its_neighbours(stiffness: float) -> None:
    model, _ = at_rest(f"{ARM}.registration_stiffness_N_per_m={stiffness}")
    middle = model.mesh.steady_arms[len(model.mesh.steady_arms) // 2]
    load = np.zeros(model.n_dofs)
    load[model.dofs(middle, "v")] = 100.0
    moved = solve_free(matrix_of(model, stiffness=1.0), model, load)[model.dofs(middle, "v")]
    k = 1.0 / (1.0 / stiffness + BAR)
    expected = 100.0 / np.sqrt(k**2 + 4.0 * k * TENSION / SPAN)
    # Bending rounds the wire off over sqrt(EI / T) to either side of an arm.
    rounded = 2.0 * np.sqrt(BENDING / TENSION) / SPAN
    check("displacement [m]", moved, expected, within=rounded * expected)


def test_wind_moves_all_arms_by_its_load_a_span_over_their_stiffness() -> None:
    # At the height of the mean speed.
    wind = ("line.contact_wire.diameter_mm=12.3", "wind.speed_m_per_s=20", "wind.height_m=10")
    _, wanted = at_rest(f"{ARM}.registration_stiffness_N_per_m=2e4")
    model, form = at_rest(f"{ARM}.registration_stiffness_N_per_m=2e4", *wind)
    arms = model.mesh.steady_arms[5:-5]
    assert form.lateral is not None and wanted.lateral is not None
    moved = form.lateral.y[arms] - wanted.lateral.y[arms]
    # Without wind registration arms carry the zig-zag, for which hinges were set.
    stagger = np.where(np.arange(arms.size) % 2 == 0, 1.0, -1.0) * 0.3
    check("stagger [m]", np.abs(wanted.lateral.y[arms] / stagger), 1.0, within=1e-9)
    pull = 0.5 * 1.225 * 20.0**2 * 12.3e-3 * 1.2
    expected = pull * SPAN * (1.0 / 2e4 + BAR)
    # Five spans from the ends, where what they hold has fallen to (sqrt(1 + 4T/kL) - 1 ...)^5.
    check("displacement [m]", moved, expected, within=1e-5 * expected)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["effects.lateral_motion="], "acts only with effects.lateral_motion = true"),
        ([f"{ARM}.length_m=0", f"{ARM}.inclination_deg="], "needs length_m above 0"),
        ([f"{ARM}.registration_stiffness_N_per_m=0"], "registration_stiffness_N_per_m"),
    ],
)
def test_a_registration_arm_needs_a_steady_arm_that_moves(words: list[str], sentence: str) -> None:
    given = [*LINE, f"{ARM}.registration_stiffness_N_per_m=2e4", *words]
    with pytest.raises(InputError, match=sentence):
        load_scene("tramway", given)
