"""Keys of lateral motion: what they become, and when they are refused."""

from __future__ import annotations

import numpy as np
import pytest

from catenary.cases.scene.convert.line import line_data_of
from catenary.cases.scene.load import load_scene
from catenary.solver.base.errors import InputError

ON = "effects.lateral_motion=true"


def test_an_inclination_is_an_angle_of_the_arm() -> None:
    scene = load_scene("ac_simple", [ON, "line.steady_arm.inclination_deg=10"])
    assert line_data_of(scene).steady_arm.inclination == pytest.approx(np.pi / 18)
    assert line_data_of(load_scene("ac_simple", [])).steady_arm.inclination is None


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (["line.steady_arm.inclination_deg=10"], "acts only with effects.lateral_motion = true"),
        (
            [ON, "line.steady_arm.inclination_deg=10", "line.steady_arm.holds_height=true"],
            "takes holds_height or inclination_deg, but both are given",
        ),
        ([ON, "line.steady_arm.inclination_deg=40"], "inclination_deg"),
        ([ON, 'line.ends.end.kind="periodic"'], "with effects.lateral_motion it must be fixed"),
    ],
)
def test_keys_that_do_not_fit_are_refused(changes: list[str], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        load_scene("ac_simple", changes)
