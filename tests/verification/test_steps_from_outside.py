"""What is set between two steps acts on every kind of pantograph as theory has it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from acting_scenes import SCENES
from measuring import check
from scenes import with_words

import catenary
from catenary.cases.scene.input.case_files import read_toml

TELESCOPE = Path(__file__).parents[1] / "support" / "telescope.toml"
DT, RAISED = 1e-3, 0.1
CHAIN = {"masses_kg": [7.2, 15.0], "stiffnesses_N_per_m": [4200.0, 0.0], "static_force_N": 120.0}
# The same two masses three times: the damper to the base as such, as a law, and in a mechanism.
DAMPER = {"type": "damper", "up_N_s_per_m": 90.0, "down_N_s_per_m": 90.0}
KINDS: dict[str, dict[str, Any]] = {
    "chain": CHAIN | {"dampings_N_s_per_m": [10.0, 90.0]},
    "laws": CHAIN | {"dampings_N_s_per_m": [10.0, 0.0], "laws": [DAMPER]},
    "mechanism": read_toml(TELESCOPE)["pantographs"]["telescope"],
}


def scene_with(kind: str, **changes: Any) -> catenary.Scene:
    """Two masses of a kind under a small line."""
    table = SCENES["ac_simple"]
    scene = with_words(table["case"], table["set"])
    pantograph = KINDS[kind] | {"nominal_height_m": 5.0}
    train = {"pantographs": [{"name": "two"}], "raise_time_s": RAISED}
    return scene.replace(
        {"pantographs": {"two": pantograph}} | changes,
        train=train,
        numerics={"dt_s": DT},
        effects={"vehicle_motion": "vehicle" in changes},
    )


def forces(scene: catenary.Scene, **added: Any) -> np.ndarray:
    """Contact forces (n_steps,) [N] with inputs that are functions of time [s]."""
    found = []
    with catenary.Simulation(scene) as sim:
        while sim.steps_left:
            for name, course in added.items():
                setattr(sim, name, course(sim.time + sim.dt))
            sim.step()
            found.append(sim.contact_force[0])
    return np.array(found)


@pytest.mark.parametrize("kind", ["laws", "mechanism"])
@pytest.mark.parametrize("name", ["lift_force", "head_force"])
def test_forces_act_on_each_kind_as_on_a_chain(kind: str, name: str) -> None:
    """From the first step on, in which nothing is raised yet: the lift acts in full at once.

    The mechanism's table of damping is one of a spline and its actuator is calibrated to 1e-9.
    """
    added = {name: lambda time: 30.0}
    plain, chain = forces(scene_with("chain")), forces(scene_with("chain"), **added)
    assert np.abs(chain - plain)[: round(RAISED / DT)].max() > 1.0
    check("contact force [N]", forces(scene_with(kind), **added), chain, within=1e-6)


def test_strips_on_springs_share_a_force_on_the_head_as_they_do_one_of_the_air() -> None:
    """An uplift of 30 N on the head, which grows with the raising; equal to round-off."""
    strips = {"number": 2, "spacing_m": 0.5, "mass_kg": 1.0, "stiffness_N_per_m": 750.0}
    scene = scene_with("chain", **{"pantographs.two.strips": strips})
    blown = scene.replace({"pantographs.two.aerodynamics": {"uplift_polynomial": [30.0]}})
    found = forces(
        scene,
        head_force=lambda time: 15.0 * (1.0 - np.cos(np.pi * min(time / RAISED, 1.0))),
    )
    change = np.abs(found - forces(scene)).max()
    assert change > 20.0
    check("contact force [N]", found, forces(blown), within=1e-9 * change)


@pytest.mark.parametrize("kind", KINDS)
def test_a_base_that_is_moved_from_outside_is_one_that_the_vehicle_moves(kind: str) -> None:
    """b = -A cos wt, 10 mm at 2 Hz.

    What a vehicle does is known at the start, so that a run begins with the accelerations under
    its height; steps from outside learn of it in the first step. The velocity that is missing, the
    force of the base over a mass times dt / 2, is below A w w dt / 2 of mechanisms, w dt / 2 of the
    base's own: 0.6 %.
    """
    amplitude, rate = 0.01, 4.0 * np.pi
    sine = {"amplitude_m": amplitude, "frequency_hz": 2.0, "phase_deg": -90.0}
    moved = scene_with(kind, vehicle={"vertical": sine})
    still, expected = scene_with(kind), forces(moved)
    found = forces(
        still,
        base=lambda time: -amplitude * np.cos(rate * time),
        base_velocity=lambda time: amplitude * rate * np.sin(rate * time),
        base_acceleration=lambda time: amplitude * rate**2 * np.cos(rate * time),
    )
    change = float(np.abs(expected - forces(still)).max())
    assert change > 5.0
    check("contact force [N]", found, expected, within=0.5 * rate * DT * change)


@pytest.mark.parametrize(
    "changes",
    [
        {"vehicle": {"vertical": {"by_place": [[x, 1e-5 * x] for x in (0, 500, 1000, 2000)]}}},
        {"vehicle": {"irregularity": {"spectrum": "fra_4"}}},
        {"line.tunnels": [{"from_m": 100.0, "to_m": 200.0, "force_factor": 2.0}]},
    ],
)
def test_what_lies_along_the_track_is_met_at_one_speed(changes: dict[str, Any]) -> None:
    """A file has what acts at each time, which another speed would move along the track."""
    if "line.tunnels" in changes:
        changes = {**changes, "pantographs.two.aerodynamics": {"uplift_polynomial": [40.0]}}
    with catenary.Simulation(scene_with("chain", **changes)) as sim:
        with pytest.raises(catenary.InputError, match="follows a track, .* tunnels"):
            sim.speed = 50.0
    swings = {"vertical": {"amplitude_m": 0.01, "frequency_hz": 2.0}}
    with catenary.Simulation(scene_with("chain", vehicle=swings)) as sim:
        sim.speed = 50.0
        assert sim.speed == 50.0
