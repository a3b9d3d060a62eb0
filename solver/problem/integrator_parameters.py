"""Parameters of the line's time integration, and what they do to a vibration.

Newmark's method, HHT and the generalized-alpha method are one family with the weights a_m and a_f
of the step's start in the balance of forces:

    M a(1 - a_m) + C v(1 - a_f) + K d(1 - a_f) = f(1 - a_f),      x(s) = s x_new + (1 - s) x_old

Sources: J. Chung, G. M. Hulbert, J. Appl. Mech. 60 (1993) 371-375; H. M. Hilber, T. J. R. Hughes,
R. L. Taylor, Earthquake Eng. Struct. Dyn. 5 (1977) 283-292 (HHT; their alpha is -a_f).
"""

from __future__ import annotations

from typing import NamedTuple

NEWMARK, HHT, GENERALIZED_ALPHA = "newmark", "hht", "generalized_alpha"
# HHT's spectral radius is (1 - a_f) / (1 + a_f) with a_f up to 1/3.
LEAST_RADIUS_OF_HHT = 0.5


class Integration(NamedTuple):
    """Newmark's beta and gamma with the weights a_m of inertia and a_f of all other forces."""

    beta: float
    gamma: float
    mass_weight: float = 0.0
    force_weight: float = 0.0

    @property
    def is_second_order(self) -> bool:
        """Whether errors are of the order dt^2, which requires gamma = 1/2 - a_m + a_f."""
        return abs(self.first_order_damping) < 1e-12

    @property
    def frequency_error(self) -> float:
        """E in the frequency omega (1 - E (omega dt)^2) that an undamped vibration gets."""
        own = 0.5 * self.beta - 1.0 / 24.0
        return own - 0.5 * (self.gamma - 0.5) * self.force_weight

    @property
    def first_order_damping(self) -> float:
        """D in the damping ratio D omega dt + O(omega dt)^2 that an undamped vibration gets.

        Zero for every method of order two.
        """
        return 0.5 * (self.gamma - 0.5 + self.mass_weight - self.force_weight)

    @property
    def third_order_damping(self) -> float:
        """D in the damping ratio D (omega dt)^3 of methods of order two."""
        mean = (1.0 - self.mass_weight) * self.force_weight
        return 0.5 * (self.gamma - 0.5) * (self.beta - mean)


AVERAGE_ACCELERATION = Integration(0.25, 0.5)


def integration_of(
    integrator: str, spectral_radius: float, beta: float = 0.25, gamma: float = 0.5
) -> Integration:
    """Parameters of second order for a spectral radius at infinite omega dt.

    Parameters
    ----------
    integrator : str
        Name of the method.
    spectral_radius : float
        0 to 1, for HHT ``LEAST_RADIUS_OF_HHT`` to 1: factor of the fastest vibrations in each step
        [-]. Vibrations of many steps a period are kept. At 1 both methods are average acceleration.
    beta, gamma : float, optional
        Newmark's parameters, for Newmark's method alone, whatever the spectral radius [-].
    """
    if integrator == NEWMARK:
        return Integration(beta, gamma)
    if integrator == HHT:
        mass_weight, force_weight = 0.0, (1.0 - spectral_radius) / (1.0 + spectral_radius)
    else:
        mass_weight = (2.0 * spectral_radius - 1.0) / (spectral_radius + 1.0)
        force_weight = spectral_radius / (spectral_radius + 1.0)
    more = force_weight - mass_weight
    return Integration(0.25 * (1.0 + more) ** 2, 0.5 + more, mass_weight, force_weight)
