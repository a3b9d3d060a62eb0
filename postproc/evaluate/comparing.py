"""Figures beside their limits, with as many digits as it takes to see which one is larger."""

from __future__ import annotations

import math

# Digits beyond those asked for after which two numbers are told as they are.
_MOST_MORE = 9


def decimals_that_tell(value: float | None, limit: float | None, fewest: int) -> int:
    """Decimals with which a value and its limit are printed, so that different numbers look so.

    Parameters
    ----------
    value, limit : numbers in one unit; NaN and None ask for no more than ``fewest``
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
