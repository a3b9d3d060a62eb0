"""The loop of the generalized-alpha method that Newmark's does not have, compiled by Numba.

Works on this rank's arrays and knows nothing of MPI or PETSc. Not collective.
"""

from __future__ import annotations

from typing import NamedTuple

from catenary.solver.base.kernels.compiled import compiled


class AlphaFactors(NamedTuple):
    """Factors of a step's predictions by the algorithm's accelerations.

    With b the acceleration that balances the forces at the end of a step, the algorithm's is
    a = p + r b, where p is known when the step begins.

    Attributes
    ----------
    dt : step [s]
    ratio : r
    known_of_balanced, known_of_own : shares of b and a of the step before in p
    position_of_own, position_of_known : what the displacement takes from a before and from p [s2]
    velocity_of_own, velocity_of_known : what the velocity takes from both [s]
    damping_on_stiffness : c, so that a product with K of d + c v gives elastic and damping forces
    """

    dt: float
    ratio: float
    known_of_balanced: float
    known_of_own: float
    position_of_own: float
    position_of_known: float
    velocity_of_own: float
    velocity_of_known: float
    damping_on_stiffness: float


@compiled
def predict(displacement, velocity, balanced, known, work, by):
    """Predictions in place from ``balanced`` b and ``known`` p of the step before, shape (n,) each.

    ``known`` becomes the p of this step, and ``work`` -(d + c v); ``by`` are `AlphaFactors`.
    """
    for i in range(displacement.size):
        b = balanced[i]
        a = known[i] + by.ratio * b
        p = by.known_of_balanced * b + by.known_of_own * a
        d = displacement[i] + by.dt * velocity[i] + by.position_of_own * a
        d += by.position_of_known * p
        v = velocity[i] + by.velocity_of_own * a + by.velocity_of_known * p
        known[i] = p
        displacement[i] = d
        velocity[i] = v
        work[i] = -(d + by.damping_on_stiffness * v)
