"""The paper's seven bodies run as a user runs them, beside two lumped masses."""

from __future__ import annotations

import numpy as np
import pytest
from measuring import check
from paper_pantograph import data

import catenary
from catenary.mbs.mechanism.multibody_pantograph import reduced, stand


@pytest.mark.study
def test_seven_bodies_run_as_two_masses_whose_lift_falls_as_theirs_does() -> None:
    """Mean, deviation and extremes to what the mass changes by over the heights of the run.

    The case's lumped pantograph has the same lift at all heights; that of the mechanism falls by
    some 240 N/m, which is a spring of the chain's last mass. With it the two differ by the
    equivalent mass over the heights of the run and by the curvature of the lift, which is less.
    """
    standing, tables = stand(data()), reduced(data())
    (mass, _, _), (_, slope, _) = tables.at(standing.working_height)
    scene = catenary.load("ambrosio2012", short=True)
    springs = {"pantographs.lumped.stiffnesses_N_per_m": [6000.0, round(-slope, 1)]}
    lumped = scene.replace({"train.pantographs.0.name": "lumped", **springs})
    assert catenary.check(scene) == catenary.check(lumped) == []
    run = catenary.run(scene)
    ours, theirs = (one.summary["pantographs"][0] for one in (run, catenary.run(lumped)))

    assert (ours["kind"], ours["model"]) == ("seven_body", "multibody")
    assert (theirs["kind"], theirs["model"]) == ("lumped", "lumped")
    assert theirs["actuator_force_N"] is None
    check("actuator [N]", ours["actuator_force_N"], 9890.0, within=98.9)  # design: within 1 %
    assert ours["static_force_N"] == theirs["static_force_N"] == 150.0

    heights = run.channel("head_height").values[:, 0]
    # The run starts where the wire is at rest, and ends with the head some centimetres higher.
    arms = standing.working_height + np.array([-1.0, 1.0]) * np.ptp(heights)
    change = max(abs(tables.at(float(arm))[0][0] / mass - 1.0) for arm in arms)
    print(f"heads over {1e3 * np.ptp(heights):.0f} mm, mass changes by {100 * change:.1f} %")
    assert change < 0.06
    deviation = theirs["std_N"]
    for name in ("mean_N", "std_N", "max_N", "min_N"):
        check(name, ours[name], theirs[name], within=change * deviation)
