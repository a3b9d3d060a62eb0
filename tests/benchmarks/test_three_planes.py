"""What lateral and axial motion cost: whole marches of the paper's line beside the vertical one, in
turns, and two pantographs of seven bodies on the line in three planes. Run by ``make bench``.
"""

from __future__ import annotations

import pytest
from mpi4py import MPI
from scenes import load_scene, mesh_of, problem_of

from catenary.cases.studies.effect_cost import RepeatedMarch, in_turns
from catenary.solver.statics.line_at_rest import line_at_rest

LUMPED = 'train.pantographs=[{name="lumped"}]'
TWO = 'train.pantographs=[{name="seven_body"}, {name="seven_body", behind_m=100}]'
# Arms as bars; copper of 150 mm2 and bronze of 66 mm2.
LATERAL = (
    "effects.lateral_motion=true",
    "line.steady_arm.stiffness_N_per_m=",
    "line.steady_arm.inclination_deg=10",
)
AXIAL = (
    "effects.axial_motion=true",
    "line.contact_wire.axial_stiffness_N=1.8e7",
    "line.messenger_wire.axial_stiffness_N=6.6e6",
)
VERTICAL, PLANES, FULL = "vertical", "three planes", "three planes, two of seven bodies"
MARCHES = {
    VERTICAL: (LUMPED,),
    "and lateral": (LUMPED, *LATERAL),
    "and axial": (LUMPED, *AXIAL),
    PLANES: (LUMPED, *LATERAL, *AXIAL),
    "two of seven bodies": (TWO,),
    FULL: (TWO, *LATERAL, *AXIAL),
}
# Times the vertical march that motion in all planes may take, and times real time at least. Three
# planes take 35 or 42 us beside vertical steps of 6.2, 5.6 or 6.8 times, as their factors of 2 MB
# happen to stand in a second-level cache of 1 MB; on another processor 82 beside 15.5, 5.3 times.
MOST, LEAST = 7.5, 10.0
STEPS, ROUNDS = 300, 12


def march_of(*settings: str) -> RepeatedMarch:
    scene = load_scene("ambrosio2012", ["train.start_m=310", *settings])
    at_rest = line_at_rest(problem_of(scene), mesh_of(scene))
    return RepeatedMarch(MPI.COMM_SELF, at_rest, n_steps=STEPS)


@pytest.fixture(scope="module")
def times(processor_time: None) -> dict[str, float]:
    """Least processor time of a step of each [us]."""
    marches = {name: march_of(*settings) for name, settings in MARCHES.items()}
    widths = {name: march.size.planes for name, march in marches.items()}
    least = in_turns(marches, ROUNDS)
    for march in marches.values():
        march.destroy()
    dt = load_scene("ambrosio2012").numerics.dt_s
    heads = f"{'unknowns':>10}{'us a step':>11}{'x vertical':>12}{'x real time':>13}"
    print(f"\nambrosio2012{'':28}{heads}")
    for name, value in least.items():
        wide = " + ".join(map(str, widths[name]))
        ratio, factor = value / least[VERTICAL], 1e6 * dt / value
        print(f"{name:40}{wide:>10}{value:11.1f}{ratio:12.2f}{factor:13.1f}")
    return least


def test_three_planes_beside_one(times: dict[str, float]) -> None:
    assert times[PLANES] < MOST * times[VERTICAL]


def test_two_multibody_pantographs_in_three_planes(times: dict[str, float]) -> None:
    dt = load_scene("ambrosio2012").numerics.dt_s
    assert LEAST * times[FULL] < 1e6 * dt
