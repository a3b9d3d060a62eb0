"""How long each dropper was slack."""

from __future__ import annotations

import numpy as np

from catenary.postproc.evaluate.statistics import slackens_at_all
from catenary.postproc.read.results import Results


def slack_times(results: Results) -> np.ndarray:
    """Time for which the force of each dropper was zero, (n_droppers,) [s]. Not collective.

    From the records of the line, each of which stands for the time up to the next one: a dropper
    that is recorded at no time has NaN, and one that cannot slacken zero.
    """
    n_droppers = results.line("dropper_x").size
    if not slackens_at_all(results):
        return np.zeros(n_droppers)
    times = np.full(n_droppers, np.nan)
    times[results.recorded_columns("dropper_force")] = 0.0
    interval = results.line_record.every * results.dt
    for _, force in results.blocks("dropper_force"):
        times += interval * np.count_nonzero(force <= 0.0, axis=0)
    return times
