"""The paper's pantograph in its plane, in two coordinates: another way to the same motion.

The lower arm's angle a and the head's slide s on the stabilisation arm; all else follows where
circles meet: the upper arm's elbow link and the upper link close two loops. With P(a, s) the places
and turns of the bodies, J = dP/dq by complex steps (exact to round-off),

    J^T m J q'' = J^T (forces - m dJ/dt q') - dV/dq, ...

Nothing of it is the library's: joints and multipliers do not occur, only the tables' numbers.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

G = 9.81
# Lower arm, upper arm, lower link, upper link, stabilisation arm, head: mass, inertia about y.
MASSES = np.array([32.18, 15.60, 3.10, 4.51, 4.67, 7.80])
INERTIAS = np.array([10.43, 7.76, 0.46, 1.50, 0.01, 0.23])
H = 1e-30


def _meet(x1, z1, x2, z2, r1, r2, side):
    """Where circles around two points meet, on one side of the line between them."""
    dx, dz = x2 - x1, z2 - z1
    d2 = dx * dx + dz * dz
    along = (r1 * r1 - r2 * r2 + d2) / (2.0 * d2)
    across = side * cmath.sqrt(r1 * r1 / d2 - along * along)
    return x1 + along * dx - across * dz, z1 + along * dz + across * dx


def _aim(lx, lz, x, z):
    """Cosine and sine of the turn that brings a local vector to a direction of equal length."""
    l2 = lx * lx + lz * lz
    return (lx * x + lz * z) / l2, (lx * z - lz * x) / l2


def bodies(a, s):
    """x, z, cosine and sine (counter-clockwise in x-z) of the six bodies (6, 4), complex."""
    out = np.zeros((6, 4), dtype=np.complex128)
    c, n = cmath.cos(a), cmath.sin(a)
    # The lower arm's hinge is its point (0.820, 0).
    x, z = 0.200 - 0.820 * c, 0.132 - 0.820 * n
    out[0] = np.array([x, z, c, n])
    elbow_x, elbow_z = x - 0.820 * c, z - 0.820 * n
    # Upper arm: from the elbow (-1.014, 0) to the lower link's ball (-1.187, -0.126).
    lx, lz = -1.187 + 1.014, -0.126
    length = cmath.sqrt(1.303**2 + 0.025**2)
    ball_x, ball_z = _meet(
        -0.259, 0.0, elbow_x, elbow_z, length, cmath.sqrt(lx * lx + lz * lz), 1.0
    )
    cu, nu = _aim(lx, lz, ball_x - elbow_x, ball_z - elbow_z)
    out[1] = np.array([elbow_x + 1.014 * cu, elbow_z + 1.014 * nu, cu, nu])
    top_x, top_z = elbow_x + 2.028 * cu, elbow_z + 2.028 * nu
    # Lower link: from the base's ball (0.688, 0) to (-0.615, -0.025).
    cl, nl = _aim(-1.303, -0.025, ball_x + 0.259, ball_z)
    out[2] = np.array([-0.259 - 0.688 * cl, -0.688 * nl, cl, nl])
    # Upper link: from the lower arm's (-0.780, 0) to the stabilisation arm's (0, -0.105).
    foot_x, foot_z = x - 0.780 * c, z - 0.780 * n
    end_x, end_z = _meet(foot_x, foot_z, top_x, top_z, 1.962, 0.105, -1.0)
    ct, nt = _aim(0.0, -0.105, end_x - top_x, end_z - top_z)
    out[4] = np.array([top_x, top_z, ct, nt])
    ck, nk = _aim(1.962, 0.0, end_x - foot_x, end_z - foot_z)
    out[3] = np.array([foot_x + ck, foot_z + nk, ck, nk])
    out[5] = np.array([top_x - (0.010 + s) * nt, top_z + (0.010 + s) * ct, ct, nt])
    return out


def lengths(a, s):
    """Raising spring, actuator, each of the two head springs (3,), complex."""
    out = np.zeros(3, dtype=np.complex128)
    p = bodies(a, s)
    x = p[0, 0] + 0.870 * p[0, 2] + 0.136 * p[0, 3]
    z = p[0, 1] + 0.870 * p[0, 3] - 0.136 * p[0, 2]
    out[0] = cmath.sqrt((x + 0.259) ** 2 + z**2)
    out[1] = cmath.sqrt((x - 0.483) ** 2 + (z - 0.125) ** 2)
    # From the arm's centre to 0.010 above the head's.
    out[2] = 0.020 + s
    return out


def _jacobian(a, s):
    """d (x, z, turn) / d (a, s) of all bodies, (18, 2)."""
    out = np.zeros((18, 2))
    for k in range(2):
        p = bodies(a + 1j * H * (1 - k), s + 1j * H * k).tolist()
        for b in range(6):
            out[3 * b, k] = p[b][0].imag / H
            out[3 * b + 1, k] = p[b][1].imag / H
            out[3 * b + 2, k] = (p[b][2].real * p[b][3].imag - p[b][3].real * p[b][2].imag) / H
    return out


def acceleration(a, s, da, ds, push, wire, masses, inertias):
    """a'' and s'' with an actuator of ``push`` [N] and ``wire`` [N] downward on the head."""
    jacobian = _jacobian(a, s)
    h = 1e-6
    bent = (_jacobian(a + h * da, s + h * ds) - _jacobian(a - h * da, s - h * ds)) / (2.0 * h)
    m = np.zeros((2, 2))
    right = np.zeros(2)
    for b in range(6):
        for j in range(3):
            row = 3 * b + j
            inertia = inertias[b] if j == 2 else masses[b]
            inward = bent[row, 0] * da + bent[row, 1] * ds
            force = -inertia * inward
            if j == 1:
                force -= masses[b] * 9.81
                if b == 5:
                    force -= wire
            for k in range(2):
                right[k] += jacobian[row, k] * force
                for i in range(2):
                    m[k, i] += jacobian[row, k] * inertia * jacobian[row, i]
    at = lengths(a + 0j, s + 0j)
    by_a, by_s = lengths(a + 1j * H, s + 0j), lengths(a + 0j, s + 1j * H)
    for e in range(3):
        ga, gs = by_a[e].imag / H, by_s[e].imag / H
        length, rate = at[e].real, ga * da + gs * ds
        if e == 0:
            pull = 2.0 * (length - 0.459) + 60.0 * rate
        elif e == 1:
            pull = -push
        else:
            pull = 6000.0 * (length - 0.103) + 26.0 * rate
        right[0] -= pull * ga
        right[1] -= pull * gs
    det = m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]
    return (
        (m[1, 1] * right[0] - m[0, 1] * right[1]) / det,
        (m[0, 0] * right[1] - m[1, 0] * right[0]) / det,
    )


def head_height(a: float, s: float) -> float:
    """Height of the head [m]."""
    return float(bodies(a + 0j, s + 0j)[5, 1].real)


def rest(push: float, wire: float) -> np.ndarray:
    """a and s at rest, shape (2,)."""
    start = np.array([-0.343, 0.06])
    return fsolve(
        lambda q: acceleration(q[0], q[1], 0.0, 0.0, push, wire, MASSES, INERTIAS),
        start,
        xtol=1e-13,  # some hundred roundings: less may be out of reach, which is a warning
    )


def head_heights(
    push: float, load: Callable[[float], float], times: np.ndarray, rtol: float = 1e-10
) -> np.ndarray:
    """Heights of the head (n,) [m] at times from rest under ``load`` at the first of them."""
    start = rest(push, load(times[0]))

    def rates(time: float, y: np.ndarray) -> tuple[float, ...]:
        a, s, da, ds = y
        return (da, ds, *acceleration(a, s, da, ds, push, load(time), MASSES, INERTIAS))

    way = solve_ivp(
        rates,
        (times[0], times[-1]),
        (*start, 0.0, 0.0),
        "DOP853",
        t_eval=times,
        rtol=rtol,
        atol=1e-12,
        max_step=0.02,
    )
    return np.array([head_height(a, s) for a, s in way.y[:2].T])
