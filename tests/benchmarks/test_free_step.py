"""A free step of lines and methods that ask for more, beside the plain one. Run by ``make bench``.

All are measured in turns in one process, and the least of many short rounds counts, so that ratios
hold on a machine that others use, too. A turn takes many steps, as a march does: what a line keeps
in the caches it finds there.
"""

from __future__ import annotations

import time

import numpy as np
import pytest
from mpi4py import MPI
from scenes import load_scene, mesh_of, problem_of

from catenary.solver.integrators.line_integrator import make_line
from catenary.solver.model.partition import distribute
from catenary.solver.statics.form_finding import find_form

ROUNDS, CALLS = 60, 60
# Spans of 50 to 58 m, no two alike, but for the five of the transition.
LENGTHS = 50.0 + 8.0 * np.random.default_rng(3).permutation(95) / 94.0
DAMPED = "line.damping.per_component.contact_wire={alpha_s=0.02,beta_per_s=0.02}"
HHT = 'numerics.integrator="hht"', "numerics.spectral_radius=0.8"
LONG = "line.n_spans=100"
LINES = {
    "25 spans": (),
    "25 spans, damping by component": (DAMPED,),
    "25 spans, HHT": HHT,
    "25 spans, HHT, damping by component": (*HHT, DAMPED),
    "100 spans, alike": (LONG, "line.span_m=54"),
    "100 spans, no two alike": (LONG, f"line.span_m={LENGTHS.round(3).tolist()}"),
}
# Lines, what they are measured by, and the most that they may take in terms of that.
MOST = {
    "25 spans, damping by component": ("25 spans", 1.5),
    "25 spans, HHT": ("25 spans", 1.5),
    "25 spans, HHT, damping by component": ("25 spans", 1.7),
    "100 spans, no two alike": ("100 spans, alike", 1.4),
}


@pytest.fixture(scope="module")
def times() -> dict[str, float]:
    """Least time of a free step of each [us]."""
    made = {}
    for name, settings in LINES.items():
        scene = load_scene("ambrosio2012", list(settings))
        problem = problem_of(scene)
        model, _ = find_form(problem, mesh_of(scene))
        made[name] = make_line(MPI.COMM_SELF, model, distribute(model, 1, 0), problem.numerics)
        assert made[name].passes is not None
    least = dict.fromkeys(made, np.inf)
    for _ in range(ROUNDS):
        for name, line in made.items():
            begin = time.perf_counter()
            for _ in range(CALLS):
                line.free_step()
            least[name] = min(least[name], 1e6 * (time.perf_counter() - begin) / CALLS)
    for line in made.values():
        line.destroy()
    print(f"\nfree step of ambrosio2012\n{'':44}{'us':>8}{'x plain':>9}")
    for name, value in least.items():
        plain = least[MOST[name][0]] if name in MOST else least["25 spans"]
        print(f"{name:44}{value:8.1f}{value / plain:9.2f}")
    return least


@pytest.mark.parametrize("name", MOST)
def test_what_asks_for_more_takes_little_longer(times: dict[str, float], name: str) -> None:
    plain, most = MOST[name]
    assert times[name] < most * times[plain]
