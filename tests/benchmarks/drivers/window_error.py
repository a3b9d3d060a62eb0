"""Prints and draws the error of the contact force over the size of a window.

python -m mpi4py window_error.py PICTURE.png

Against all of the line in motion, below 20 Hz, in terms of the standard deviation there.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from mpi4py import MPI

from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.convert.problem import problem_of
from catenary.cases.scene.load import load_scene
from catenary.postproc.evaluate.filters import low_pass
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.observers import Stage, StepView

mpl.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

SPANS = 90
# Spans ahead of each line, and of so many as many behind.
AHEAD = {
    "ambrosio2012": (2, 3, 4, 5, 6, 8, 10),
    "en50318_2002": (4, 6, 8, 10, 15, 20, 25, 30),
}
BEHIND = 0.8
# Where the force is compared, from the start of the line [spans].
FROM, TO, CUT_OFF = 40, 55, 20.0


class Force:
    """Keeps the position and the force of the leading pantograph."""

    def __init__(self) -> None:
        self.kept: list[np.ndarray] = []

    def start(self, stage: Stage) -> None:
        """Nothing is needed of the stage."""

    def next_state(self, step: int) -> int:
        return step - step % 500 + 500

    def observe_rows(self, first_step: int, times: np.ndarray, rows: np.ndarray) -> None:
        self.kept.append(rows[:, self.columns].copy())

    def observe(self, view: StepView) -> None:
        parts = [view.columns[name].start for name in ("contact_position", "contact_force")]
        self.columns = parts
        self.kept.append(view.row[None, parts].copy())

    def finish(self, outcome: str) -> None:
        assert outcome == "done", outcome


def history(case: str, *window: str) -> np.ndarray:
    """The filtered force between the places that are compared [N]."""
    scene = load_scene(case, [f"line.n_spans={SPANS}", *window])
    problem = problem_of(scene)
    masts, seen = problem.line.support_positions, Force()
    with March(MPI.COMM_SELF, *line_at_rest(problem, mesh_of(scene))) as march:
        march.run([seen])
    position, force = np.concatenate(seen.kept).T
    filtered = low_pass(force, problem.numerics.dt, CUT_OFF)
    return np.asarray(filtered[(position >= masts[FROM]) & (position <= masts[TO])])


def main(picture: Path) -> None:
    figure, axis = plt.subplots(figsize=(7, 4.5), layout="constrained")
    for number, (case, ahead) in enumerate(AHEAD.items()):
        end = f"evaluation.to_m={3400 if case == 'ambrosio2012' else 3800}"
        whole = history(case, end)
        sigma = whole.std()
        found = []
        print(f"{case}: sigma {sigma:.3f} N")
        print(f"{'ahead':>6}{'behind':>8}{'history %':>12}{'sigma %':>12}")
        for spans in ahead:
            behind = round(BEHIND * spans, 1)
            sizes = f"window.spans_ahead={spans}", f"window.spans_behind={behind}"
            force = history(case, end, "window.mode=bounded", *sizes)
            errors = np.sqrt(np.mean((force - whole) ** 2)), abs(force.std() - sigma)
            found.append([100.0 * error / sigma for error in errors])
            print(f"{spans:6}{behind:8}{found[-1][0]:12.2g}{found[-1][1]:12.2g}", flush=True)
        size = (1.0 + BEHIND) * np.array(ahead)
        for column, (style, what) in enumerate((("o-", "history"), ("s--", "sigma"))):
            label = f"{case}, {what}"
            axis.semilogy(size, np.array(found)[:, column], style, color=f"C{number}", label=label)
    axis.set_xlabel("spans that move")
    axis.set_ylabel("error of the contact force below 20 Hz\n[% of its standard deviation]")
    axis.grid(visible=True, which="major", alpha=0.4)
    axis.legend()
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
