"""Contact laws, schemes and steps that cannot be: each ends in one sentence."""

from __future__ import annotations

from pathlib import Path

import pytest
from refusals import SOUND, assert_refused

# Assignments on the sound scene, and what the sentence must hold.
ASSIGNMENTS = {
    "no contact stiffness": (["contact.stiffness_N_per_m=0"], "greater than 0 [N/m]"),
    "step above 20 Hz": (["numerics.dt_s=0.03"], "20 Hz"),
    "step of nothing": (["numerics.dt_s=0"], "at least 1e-06 [s]"),
    "unknown scheme": (["numerics.scheme=newton"], "one_solve or fixed_point"),
    "unstable Newmark": (["numerics.newmark_gamma=0.7"], "2 newmark_beta >= newmark_gamma"),
    "unknown integrator": (["numerics.integrator=rk4"], "newmark, hht or generalized_alpha"),
    "spectral radius of Newmark": (
        ["numerics.spectral_radius=0.8"],
        "must not have spectral_radius with integrator newmark",
    ),
    "no spectral radius": (
        ["numerics.integrator=generalized_alpha"],
        "must give spectral_radius with integrator generalized_alpha",
    ),
    "spectral radius above 1": (
        ["numerics.integrator=generalized_alpha", "numerics.spectral_radius=1.1"],
        "at most 1",
    ),
    "spectral radius below HHT's": (
        ["numerics.integrator=hht", "numerics.spectral_radius=0.4"],
        "from 0.5 to 1 with integrator hht",
    ),
    "two ways to damp": (
        [
            "numerics.integrator=hht",
            "numerics.spectral_radius=0.8",
            "numerics.newmark_gamma=0.55",
            "numerics.newmark_beta=0.28",
        ],
        "must not have newmark_beta and newmark_gamma with integrator",
    ),
    "kinematic contact by another method": (
        [
            "contact.law=kinematic",
            "contact.stiffness_N_per_m=",
            "numerics.integrator=generalized_alpha",
            "numerics.spectral_radius=0.5",
        ],
        "only if one method steps both: take newmark",
    ),
    "negative Newmark damping": (["numerics.newmark_gamma=0.4"], "at least 0.5"),
    "no iterations": (["numerics.max_iterations=0"], "at least 1"),
}


@pytest.mark.parametrize("name", ASSIGNMENTS)
def test_numerics_that_cannot_be_are_refused(name: str, tmp_path: Path) -> None:
    assert_refused(SOUND, *ASSIGNMENTS[name], tmp_path)
