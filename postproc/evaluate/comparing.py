"""Figures beside their limits, with the digits that show which one is larger."""

from __future__ import annotations

import math

# Further digits after which two numbers are printed in full.
_MOST_MORE = 9


def decimals_that_tell(value: float | None, limit: float | None, fewest: int) -> int:
    """Decimals of a value and its limit with which different numbers print differently.

    Parameters
    ----------
    value, limit : numbers in one unit; NaN and None are printed with ``fewest``
    fewest : decimals where the two differ by enough [-]
    """
    if value is None or limit is None or not math.isfinite(value) or not math.isfinite(limit):
        return fewest
    if value == limit:
        return fewest
    for decimals in range(fewest, fewest + _MOST_MORE):
        if f"{value:.{decimals}f}" != f"{limit:.{decimals}f}":
            return decimals
    return fewest + _MOST_MORE
