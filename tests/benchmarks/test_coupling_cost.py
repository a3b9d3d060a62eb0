"""What each coupling costs and gives: error below 20 Hz against time per simulated second."""

from __future__ import annotations

import numpy as np
from measuring import History, start_march
from scipy import signal
from small_lines import EN_PANTOGRAPH, WHOLE, en50318_line, mesh_of, numerics, problem_of, train

from catenary.mbs.lumped import LumpedData
from catenary.meshgen.mesh import LineMesh
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.problem import Problem

N_SPANS, REPEATS = 8, 3
STEPS = (4e-3, 2e-3, 1e-3, 0.5e-3)
LIGHT = LumpedData((1.0, 15.0), (4200.0, 50.0), (10.0, 90.0))
SCENES = {
    "head 7.2 kg, contact 5e4 N/m": (EN_PANTOGRAPH, 5e4),
    "head 1 kg, contact 1e6 N/m": (LIGHT, 1e6),
}


def problem(data: LumpedData, stiffness: float, coupling: str, dt: float) -> Problem:
    return problem_of(
        en50318_line(N_SPANS),
        WHOLE,
        contact=LinearLaw(stiffness, 0.0),
        train=train(300 / 3.6, 80.0, 400.0, data=data, raise_time=0.4),
        numerics=numerics(dt, coupling=coupling),
    )


def run(scene: Problem, mesh: LineMesh) -> tuple[History, str, float]:
    """What was seen, how it ended, and the wall time per simulated second."""
    march, _ = start_march(scene, mesh)
    history = History()
    with march:
        outcome = march.run([history])
    return history, outcome.outcome, outcome.wall / max(outcome.n_steps * scene.numerics.dt, 1e-9)


def filtered(history: History, dt: float) -> np.ndarray:
    """Contact force below 20 Hz every 4 ms, after the pantograph was raised."""
    sections = signal.butter(6, 20.0, fs=1 / dt, output="sos")
    force = signal.sosfiltfilt(sections, history["contact_force"][:, 0])
    return np.asarray(force[round(0.8 / dt) : -round(0.1 / dt) : round(4e-3 / dt)])


def test_error_against_cost_of_the_couplings() -> None:
    mesh = mesh_of(en50318_line(N_SPANS), 5)
    for title, (data, stiffness) in SCENES.items():
        fine = run(problem(data, stiffness, "implicit", 0.125e-3), mesh)[0]
        reference = filtered(fine, 0.125e-3)
        print(f"\n{title}: deviation {reference.std():.1f} N")
        print("coupling   dt [ms]   rms error [N]   error of deviation [%]   s per simulated s")
        for coupling in ("implicit", "iterated", "explicit"):
            for dt in STEPS:
                scene = problem(data, stiffness, coupling, dt)
                # Interleaving would compare no better: each figure is a median of its own.
                runs = [run(scene, mesh) for _ in range(REPEATS)]
                history, outcome, _ = runs[0]
                cost = float(np.median([wall for _, _, wall in runs]))
                if outcome != "done":
                    print(f"{coupling:9} {1e3 * dt:8g}   no agreement: {outcome[:60]}...")
                    assert coupling != "implicit"
                    continue
                force = filtered(history, dt)
                n = min(force.size, reference.size)
                error = float(np.sqrt(((force[:n] - reference[:n]) ** 2).mean()))
                off = 100 * (force[:n].std() / reference[:n].std() - 1)
                print(f"{coupling:9} {1e3 * dt:8g} {error:15.2f} {off:22.2f} {cost:20.3f}")
