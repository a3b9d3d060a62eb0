"""Prints processor time and memory of the start of a long line, part by part.

python -m mpi4py start_cost.py SPANS [window] [unlike]

With ``window`` some spans move with the train only; ``unlike`` spans are 50 to 58 m long, no two of
one length.
"""

from __future__ import annotations

import resource
import sys
from dataclasses import replace

import numpy as np
from mpi4py import MPI
from step_cost import peak_memory, room

from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.load import load_scene
from catenary.cases.scene.scene import problem_of
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop.march import March

STEPS = 20


def words_of(n_spans: int, *kinds: str) -> list[str]:
    """Settings of the scene."""
    words = [f"line.n_spans={n_spans}", *room(n_spans)]
    if "window" in kinds:
        words += ["window.mode=bounded", "line.damping.alpha_s=0.00275"]
    if "unlike" in kinds:
        drawn = np.random.default_rng(1).permutation(n_spans) / n_spans
        lengths = (50.0 + 8.0 * drawn[: n_spans - 5]).round(5).tolist()
        words += [f"line.span_m={lengths}", "line.dropper.spacing_m=6"]
    return words


def main(n_spans: int, *kinds: str) -> None:
    spent = 0.0

    def told(part: str) -> None:
        nonlocal spent
        used = resource.getrusage(resource.RUSAGE_SELF)
        now = used.ru_utime + used.ru_stime
        print(f"{part:28}{now - spent:8.2f} s{peak_memory() / 1e6:8.0f} MB at most")
        spent = now

    told("imports")
    scene = load_scene("ambrosio2012", words_of(n_spans, *kinds))
    problem = problem_of(scene)
    train = problem.train
    end = train.start + STEPS * problem.numerics.dt * train.speed
    problem = replace(problem, train=replace(train, end=end))
    told("scene read and checked")
    mesh = mesh_of(scene)
    told("mesh")
    rest = line_at_rest(problem, mesh)
    told("line at rest")
    with March(MPI.COMM_SELF, *rest) as march:
        told("ready to march")
        march.run([])
        told(f"{STEPS} steps")


if __name__ == "__main__":
    main(int(sys.argv[1]), *sys.argv[2:])
