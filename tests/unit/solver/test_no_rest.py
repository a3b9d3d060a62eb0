"""Lines that find no rest: one sentence, and no number that is none on the way."""

from __future__ import annotations

import pytest
from scenes import load_scene, mesh_of, problem_of

from catenary import InputError
from catenary.solver.statics.line_at_rest import line_at_rest

FIXED = (
    "line.n_spans=3",
    "train.end_m=130",
    "evaluation.from_m=115",
    "evaluation.to_m=120",
    "train.raise_time_s=0",
    "mesh.elements_per_gap=1",
    "effects.axial_motion=true",
    "line.contact_wire.axial_stiffness_N=1.7e7",
    "line.messenger_wire.axial_stiffness_N=2.1e7",
)


@pytest.mark.parametrize(
    ("warmer", "more"), [(100, []), (80, ["effects.lateral_motion=true"])], ids=["two", "three"]
)
def test_wires_between_fixed_ends_that_grow_slack_are_refused(warmer: int, more: list[str]) -> None:
    """EA alpha dT takes more than the tension, and Newton's method runs away."""
    scene = load_scene("ac_simple", [*FIXED, *more, f"line.temperature.difference_K={warmer}"])
    with pytest.raises(InputError, match=f"no static equilibrium at {warmer} K above .* diverges"):
        line_at_rest(problem_of(scene), mesh_of(scene))
