"""Where contacts are along the track: a compiled loop of contacts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.base.kernels.compiled import in_line
from catenary.solver.integrators.state_kernels import shift


class Leads(NamedTuple):
    """How far contacts are ahead of the middle of their raked strips, for a compiled loop.

    Attributes
    ----------
    contact : (m,) int, numbers of the contacts of raked strips, none for a train without them
    first : (m + 1,) int, where the points of each begin
    middle : (k,) places of the strip's middle along the track [m], ascending for each contact
    lead : (k,) how far the contact is ahead of it [m], straight in between
    """

    contact: np.ndarray
    first: np.ndarray
    middle: np.ndarray
    lead: np.ndarray


@in_line
def move_contacts(start, places, leads, way):
    """Places (n,) of contacts and pantographs a way [m] ahead of where they started."""
    shift(start, places, way)
    for i in range(leads.contact.size):
        at, last = leads.first[i], leads.first[i + 1] - 1
        here = places[leads.contact[i]]
        if here >= leads.middle[last]:
            places[leads.contact[i]] += leads.lead[last]
            continue
        # The first point beyond, by halves.
        low, high = at, last
        while low < high:
            half = (low + high) // 2
            if leads.middle[half] > here:
                high = half
            else:
                low = half + 1
        ahead = leads.lead[low]
        if low > at:
            before, beyond = leads.middle[low - 1], leads.middle[low]
            share = (here - before) / (beyond - before)
            ahead = leads.lead[low - 1] + share * (ahead - leads.lead[low - 1])
        places[leads.contact[i]] += ahead
