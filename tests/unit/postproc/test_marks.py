"""Marks of a line in pictures of a run."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest

from catenary.postproc.report.pictures.along_track import mark_line


class Told:
    """Masts every 50 m, a dropper in the middle of each span."""

    def __init__(self, n_spans: int) -> None:
        self._support = 50.0 * np.arange(n_spans + 1)
        self.evaluation = (0.0, self._support[-1])

    def line(self, name: str) -> np.ndarray:
        return {"support_x": self._support, "dropper_x": self._support[:-1] + 25.0}[name]


@pytest.mark.parametrize(
    ("n_spans", "marks"),
    [(20, {"support", "dropper"}), (300, {"dropper"}), (2000, set())],
)
def test_marks_that_would_make_a_grey_ground_are_left_out(n_spans: int, marks: set[str]) -> None:
    figure, axes = plt.subplots()
    mark_line(axes, Told(n_spans), 0.0, 50.0 * n_spans)  # type: ignore[arg-type]
    assert set(axes.get_legend_handles_labels()[1]) - {"evaluation stretch"} == marks
    plt.close(figure)
