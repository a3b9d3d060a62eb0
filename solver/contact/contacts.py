"""Arrays of the contacts of a rank, as kernels take them; see ``kernels/contact``."""

from __future__ import annotations

import numpy as np

from catenary.solver.kernels.native import ContactWork, Sideways


def no_sideways() -> Sideways:
    """Lateral data of a line without lateral motion, empty."""
    nothing = np.zeros((0, 2))
    return Sideways(nothing.astype(np.int64), nothing.astype(bool), nothing)


def no_work(n_contacts: int, share_after: float, dt: float) -> ContactWork:
    """Work of ``n_contacts`` contact forces before the first step of ``dt`` [s].

    ``share_after`` is the weight of the force at the end of a step [-], 1 less that at its start.
    """
    local, value = np.zeros((n_contacts, 4), dtype=np.int64), np.zeros((n_contacts, 4))
    force, before, ahead = np.zeros((3, n_contacts))
    shares = 1.0 - share_after, share_after
    return ContactWork(np.zeros(1), force, local, value, before, ahead, *shares, dt)
