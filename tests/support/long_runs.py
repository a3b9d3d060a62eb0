"""What long runs under a given contact force share: the force, boundedness, balance of energy.

Energy is counted as the trapezoidal rule does: mean forces times ways, which leaves nothing over
for what is linear; masses and levers that change with height leave errors of order dt^2.
"""

from __future__ import annotations

import numpy as np
from measuring import check

STATIC, HEIGHT, DT = 150.0, 5.08, 1e-3


def contact_forces(n_steps: int) -> np.ndarray:
    """At the start and at the ends of n steps (n + 1,) [N].

    150 N with 25 N of 1.2 Hz (spans of 69 m at 300 km/h) and 10 N of 7 Hz.
    """
    at = DT * np.arange(n_steps + 1)
    return STATIC + 25.0 * np.sin(2 * np.pi * 1.2 * at) + 10.0 * np.sin(2 * np.pi * 7.0 * at)


def mean(values: np.ndarray) -> np.ndarray:
    """Means over steps, along the first axis."""
    return 0.5 * (values[1:] + values[:-1])


def check_no_drift(heights: np.ndarray) -> None:
    """The last quarter of a run swings as the one before: not wider, around the same mean.

    The raising, 0.43 Hz with a damping ratio of 0.0013, forgets its start like exp(-t / 290 s): its
    swing may die out, but not grow; a mean over part of its period is off by a part of its swing.
    """
    quarter = len(heights) // 4
    third, last = heights[2 * quarter : 3 * quarter], heights[3 * quarter :]
    for name, part in (("third", third), ("last", last)):
        print(f"{name} quarter: {part.min():.6f} to {part.max():.6f} m, mean {part.mean():.6f} m")
    swing = float(np.ptp(third))
    check("swing [m], not above", max(float(np.ptp(last)), swing), swing, within=0.01 * swing)
    check("mean height [m]", last.mean(), third.mean(), within=0.05 * swing)


def check_balance(
    gained: float, by_contact: np.ndarray, by_lift: float, lost: np.ndarray, within: float
) -> None:
    """What is stored is what was done less what was lost [J], to a part of all that went through.

    ``by_contact`` and ``lost`` step by step (n,); ``within`` relative to the sum of |by_contact|.
    """
    through = float(np.abs(by_contact).sum())
    done, dissipated = float(by_contact.sum()) + by_lift, float(lost.sum())
    residual = gained - (done - dissipated)
    print(
        f"contact {by_contact.sum():.6g} J net of {through:.6g} J to and fro, lift {by_lift:.6g} J,"
        f" lost {dissipated:.6g} J, stored {gained:.6g} J; residual {residual:.2e} J, "
        f"{residual / dissipated:.1e} of what was lost"
    )
    check("balance / work to and fro", residual / through, 0.0, within=within)
