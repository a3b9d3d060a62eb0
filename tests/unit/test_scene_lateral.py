"""Keys of lateral motion: what they become, and when they are refused."""

from __future__ import annotations

import numpy as np
import pytest
from free_tables import as_free
from scenes import line_data_of, load_scene, problem_of, scene_from

from catenary import InputError
from catenary.cases.run.at_rest import static_table
from catenary.cases.run.plan import effect_rows
from catenary.cases.scene.input.faults import Origin
from catenary.solver.effects.all_effects import active

ON = "effects.lateral_motion=true"


def test_an_inclination_is_an_angle_of_the_arm() -> None:
    scene = load_scene("ac_simple", [ON, "line.steady_arm.inclination_deg=10"])
    assert line_data_of(scene).steady_arm.inclination == pytest.approx(np.pi / 18)
    assert line_data_of(load_scene("ac_simple", [])).steady_arm.inclination is None


def test_a_curve_is_a_curvature_a_tilt_and_a_stretch() -> None:
    given = "{radius_m=2000, side='right', cant_mm=150, from_m=200, to_m=900, transition_m=100}"
    line = line_data_of(load_scene("ac_simple", [ON, f"line.curve={given}"]))
    assert line.curve is not None
    x = np.array([100.0, 250.0, 500.0])
    assert np.allclose(line.curve.curvature_at(x), [0.0, -1 / 4000, -1 / 2000], atol=1e-18)
    assert np.allclose(line.curve.tilt, np.arcsin(0.1))
    assert line.curve.sideways_pull_at(x)[-1] == pytest.approx(-np.tan(np.arcsin(0.1)))


def test_a_messenger_wire_has_a_stagger_of_its_own() -> None:
    line = line_data_of(load_scene("ac_simple", [ON, "line.messenger_stagger_m=0.1"]))
    assert line.messenger_stagger is not None
    assert line.messenger_stagger[:3] == (0.1, -0.1, 0.1) and line.stagger[0] == 0.2


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (["line.steady_arm.inclination_deg=10"], "acts only with effects.lateral_motion = true"),
        (
            [ON, "line.steady_arm.inclination_deg=10", "line.steady_arm.holds_height=true"],
            "takes holds_height or inclination_deg, but both are given",
        ),
        ([ON, "line.steady_arm.inclination_deg=40"], "inclination_deg"),
        (
            [ON, "line.steady_arm.inclination_deg=10", "line.steady_arm.length_m=0"],
            "line.steady_arm .* needs length_m above 0 for inclination_deg",
        ),
        (
            ["line.steady_arm.stiffness_by_radial_force=true", "line.steady_arm.length_m=0"],
            "needs length_m above 0 for stiffness_by_radial_force",
        ),
        (
            [
                "line.steady_arm.stiffness_by_radial_force=true",
                "line.steady_arm.stiffness_N_per_m=9",
            ],
            "takes stiffness_N_per_m or stiffness_by_radial_force, but both are given",
        ),
        (["line.messenger_stagger_m=0.2"], "line.messenger_stagger_m .* acts only with"),
        (
            ["line.curve.radius_m=3000"],
            "line.curve.radius_m is 3000 m .* acts only with effects.lat",
        ),
        ([ON, "line.curve.radius_m=50"], "line.curve.radius_m"),
        ([ON, "line.curve={radius_m=3000, side='up'}"], "left.* or .*right"),
        ([ON, "line.curve={radius_m=3000, from_m=100}"], "needs from_m and to_m together"),
        ([ON, "line.curve={radius_m=3000, transition_m=100}"], "takes transition_m with from_m"),
        (
            [ON, "line.curve={radius_m=3000, from_m=100, to_m=200, transition_m=60}"],
            r"to_m \(200\) must be greater than 220 m",
        ),
        (
            [ON, "line.curve={radius_m=3000, cant_mm=100, from_m=100, to_m=200, transition_m=9}"],
            r"line.curve .*takes cant_mm \(100\) with a transition_m of 10 m or more",
        ),
        ([ON, "line.messenger_stagger_m=[0.1, 0.2]"], "must give messenger_stagger_m as one"),
    ],
)
def test_keys_that_do_not_fit_are_refused(changes: list[str], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        load_scene("ac_simple", changes)


def test_lateral_motion_goes_with_ends_that_go_on() -> None:
    problem = problem_of(load_scene("ac_simple", [ON, 'line.ends.end.kind="periodic"']))
    assert {"lateral_motion", "periodic_ends"} <= {effect.name for effect in active(problem)}


def test_lateral_motion_goes_with_another_temperature() -> None:
    """And finds its rest: arms slew, the line is warmer than at its installation."""
    wires = [f"line.{wire}.axial_stiffness_N=1.5e7" for wire in ("contact_wire", "messenger_wire")]
    changes = [ON, "effects.axial_motion=true", "line.temperature.difference_K=30", *wires]
    problem = problem_of(load_scene("ac_simple", [*changes, "line.ends.end.along=tensioner"]))
    assert {"lateral_motion", "temperature"} <= {effect.name for effect in active(problem)}


def test_arms_of_a_vertical_scene_have_the_stiffness_of_their_radial_force() -> None:
    """4 F a / (L l) of a zig-zag, and no effect without a stagger."""
    changes = ["line.steady_arm.stiffness_by_radial_force=true", "line.n_spans=4"]
    changes += ["train.start_m=60", "evaluation.from_m=120", "evaluation.to_m=160"]
    problem = problem_of(load_scene("ac_simple", changes))
    (arms,) = problem.line.steady_arms
    found = arms.vertical_stiffness(problem.line.wire(arms.wire))
    assert found == pytest.approx(4 * 22e3 * 0.2 / (55 * 1.22), rel=1e-12)
    assert "arm_stiffness" in {effect.name for effect in active(problem)}
    straight = problem_of(load_scene("ac_simple", [*changes, "line.stagger_m=0"]))
    assert "arm_stiffness" not in {effect.name for effect in active(straight)}


def test_a_stiffness_that_bars_do_not_take_stands_among_what_is_left_out() -> None:
    def reason(*changes: str) -> str:
        scene = load_scene("re330_stitched", list(changes))
        on, off = effect_rows(scene, problem_of(scene))
        return next(row.reason for row in [*on, *off] if row.name == "arm_stiffness")

    assert reason() == "default"
    assert reason(ON, "line.steady_arm.stiffness_N_per_m=300").startswith(
        "of steady_arms 300 N/m are not used: with lateral motion they are bars"
    )
    arm = "line.steady_arm"
    springs = [f"{arm}.length_m=0", f"{arm}.inclination_deg=", f"{arm}.mass_kg_per_m="]
    assert reason(ON, *springs) == "default"
    radial = f"{arm}.stiffness_by_radial_force=true"
    assert reason(ON, f"{arm}.stiffness_N_per_m=0", radial).startswith(
        "steady_arms have it as bars"
    )
    assert reason(ON, "line.steady_arm.stiffness_N_per_m=0").startswith(
        "the scene has no data for it: "
    )


def test_arms_of_a_free_line_are_checked_too() -> None:
    raw = as_free(load_scene("ac_simple", []))
    number, arms = next(
        (i, link) for i, link in enumerate(raw["line"]["links"]) if link["type"] == "steady_arms"
    )
    arms.pop("holds_height", None)
    arms["inclination_deg"] = 9
    raw["effects"].pop("lateral_motion")
    with pytest.raises(InputError, match=rf"links.{number}.inclination_deg is 9 .*acts only with"):
        scene_from(raw, Origin("case.toml", recorded=True))


def test_a_tight_curve_names_the_arms_that_lift_the_wire() -> None:
    """Arms of 10 degrees lift by 22 kN 55 m / 300 m tan 10 deg, 711 N: more than droppers carry."""
    scene = load_scene("ac_simple_3d", ["line.curve.radius_m=300"], shortened=True)
    with pytest.raises(InputError, match="slack at rest .* inclination of the steady arms, which"):
        static_table(scene)
