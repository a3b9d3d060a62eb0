"""The loop of the generalized-alpha method that Newmark's does not have, compiled by Numba.

Works on this rank's arrays and knows nothing of MPI or PETSc. Not collective.
"""

from __future__ import annotations

from catenary.solver.base.compiled import compiled


@compiled
def predict(displacement, velocity, balanced, known, work, coefficients):
    """Predictions in place from ``balanced`` b and ``known`` p of the step before, shape (n,) each.

    The algorithm's acceleration is a = p + r b; ``known`` becomes the p of this step, and ``work``
    -(d + share v). ``coefficients`` : dt, r, what p takes from b and from a, what the displacement
    takes from a and p, what the velocity takes from a and p, and that share.
    """
    dt, ratio = coefficients[0], coefficients[1]
    from_balanced, from_own = coefficients[2], coefficients[3]
    position_own, position_known = coefficients[4], coefficients[5]
    velocity_own, velocity_known = coefficients[6], coefficients[7]
    share = coefficients[8]
    for i in range(displacement.size):
        b = balanced[i]
        a = known[i] + ratio * b
        p = from_balanced * b + from_own * a
        d = displacement[i] + dt * velocity[i] + position_own * a + position_known * p
        v = velocity[i] + velocity_own * a + velocity_known * p
        known[i] = p
        displacement[i] = d
        velocity[i] = v
        work[i] = -(d + share * v)
