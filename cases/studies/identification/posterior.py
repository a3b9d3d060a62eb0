"""What data say of parameters beside what was known before: linear, with normal distributions.

Parameters are counted in standard deviations of their priors, data in those of their noise. With
the Jacobian J of data by parameters the posterior covariance is (1 + J^T J)^-1. A direction of
parameters is an eigenvector of J^T J, its information the eigenvalue: data say as much of it as the
prior where that is 1.

Source: A. Tarantola, *Inverse Problem Theory* (2005), sections 3.2 and 7.1; C. D. Rodgers, *Inverse
Methods for Atmospheric Sounding* (2000), section 2.4, for degrees of freedom for signal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Posterior:
    """Uncertainty of m parameters after a measurement.

    Attributes
    ----------
    covariance : (m, m), in standard deviations of the priors
    information : (m,) of each direction, the largest first
    directions : (m, m), a column each
    """

    covariance: np.ndarray
    information: np.ndarray
    directions: np.ndarray

    @property
    def widths(self) -> np.ndarray:
        """Standard deviations (m,), in those of the priors."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> np.ndarray:
        """Of the parameters (m, m)."""
        return self.covariance / np.outer(self.widths, self.widths)

    @property
    def n_found(self) -> float:
        """How many parameters the data determine: degrees of freedom for signal."""
        return float((self.information / (1.0 + self.information)).sum())

    @property
    def n_known(self) -> int:
        """Number of directions of which data say more than the prior."""
        return int((self.information > 1.0).sum())

    @property
    def condition(self) -> float:
        """Of J: root of the largest information over the least; infinite if data do not depend on a
        direction."""
        least = self.information[-1]
        return float(np.sqrt(self.information[0] / least)) if least > 0.0 else float("inf")


def posterior_of(jacobian: np.ndarray) -> Posterior:
    """The posterior from the Jacobian (n, m) of data by parameters, both in their deviations."""
    _, singular, turned = np.linalg.svd(jacobian, full_matrices=True)
    information = np.zeros(jacobian.shape[1])
    information[: singular.size] = singular**2
    covariance = (turned.T / (1.0 + information)) @ turned
    return Posterior(covariance, information, turned.T)
