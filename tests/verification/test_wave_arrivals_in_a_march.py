"""The first reflected wave meets the pantograph where the way of long waves says (some 5 s each).

Two lines that differ in length alone give the same contact force until the end of the shorter one
is felt. A string has no dispersion; here bending lets short waves run faster, clamps and droppers
slow long ones down, and the force grows from nothing while the pantograph is raised.
"""

from __future__ import annotations

import numpy as np
import pytest
from scenes import load_scene, problem_of

import catenary
from catenary.cases.run.arrivals import Course, arrival_facts, wave_line

# A contact force that differs by more is another one [N]: 4e-5 of the standard deviation, far above
# round-off, which is 1e-9.
OTHER = 1e-3
# Of the waves that matter those of 47 to 63 Hz are the shortest (mesh.required_hz of the runs); by
# (T k + 2 EI k^3) / (w m) their groups run at most 8 to 15 % faster than the string's waves.
BENDING = 1.15


@pytest.mark.parametrize(
    ("case", "speed", "short", "long"),
    [
        pytest.param("en50318_2002", 250, 12, 16, marks=pytest.mark.study),
        ("en50318_2002", 300, 11, 15),
        pytest.param("ac_simple", 275, 22, 27, marks=pytest.mark.study),
    ],
)
def test_the_force_changes_where_the_wave_is_met(
    case: str, speed: int, short: int, long: int
) -> None:
    scene = load_scene(case, [f"train.speed_km_h={speed}", f"line.n_spans={short}"])
    problem = problem_of(scene)
    facts = arrival_facts(scene, problem)
    (told,) = facts["pantographs"]
    fixed = catenary.load(case).replace(
        train={"speed_km_h": speed, "end_m": problem.train.end},
        output={"field_every_s": 0, "energy_every_s": 0},
    )
    runs = [catenary.run(fixed.replace(line={"n_spans": n})) for n in (short, long)]
    near, far = (run.force.isel(pantograph=0) for run in runs)
    near_felt, far_felt = (run.filtered_force.values[:, 0] for run in runs)
    x = far.position.values
    first = float(x[np.abs(near.values - far.values) > OTHER][0])
    start = problem.train.start
    line, train = wave_line(problem), problem.train
    fast = line._replace(speed=BENDING * line.fastest)
    soonest = Course(fast, start, train.end, train.speed, problem.evaluation, start, start).far_end
    assert soonest is not None
    print(
        f"{case}, {short} spans, {speed} km/h: differs from {first:.1f} m on, long waves are met "
        f"at {told['far_end_met_at_m']:.1f} m, the fastest at {soonest.at:.1f} m at the earliest"
    )
    assert soonest.at <= first
    # The three are -2.7, -3.9 and 5.9 m off, and the force's spacing of samples is 0.1 m.
    assert abs(first - told["far_end_met_at_m"]) < 0.15 * line.span

    # Before that the runs are one; after it they differ by far more than the stated 0.1 %.
    begin, end = problem.evaluation
    sigma = far_felt[(x >= begin) & (x <= end)].std()

    def difference(low: float, high: float) -> float:
        within = (x >= low) & (x <= high)
        error = near_felt[within] - far_felt[within]
        return float(np.sqrt(np.mean(error**2)) / sigma)

    before = difference(begin, told["far_end_met_at_m"])
    whole = difference(begin, end)
    print(f"share of the standard deviation before {before:.2e}, in the stretch {whole:.2e}")
    assert before < 1e-3 < 1e-2 < whole
    assert len(facts["warnings"]) == 1
