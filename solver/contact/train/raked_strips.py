"""Raked strips: where a strip that is not square to the track meets the contact wires."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from catenary.solver.contact.contact_wire import ContactWires


class Leads(NamedTuple):
    """How far contacts are ahead of the middle of their raked strips, as kernels take it.

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


def leads_of(wires: ContactWires, wire: np.ndarray, rake: np.ndarray) -> Leads:
    """The leads of contacts with wires at rest. Not collective.

    A strip at the angle r to the cross-section meets the wire y(x) where x = middle + tan(r) y, the
    place along the track of which is straight between the points of the wire's course. Sway of the
    vehicle and lateral motion, which move the contact by tan(r) of theirs, are left out.

    Parameters
    ----------
    wire : (n,) contact wire of each contact
    rake : (n,) angle of its strip [rad], > 0 if the left end is ahead
    """
    contact = np.flatnonzero(rake)
    middles, leads, first = [np.zeros(0)], [np.zeros(0)], [0]
    for number in contact.tolist():
        x, y = wires.course(int(wire[number]))
        lead = math.tan(rake[number]) * y
        middle = x - lead
        ascends = np.append(True, np.diff(np.maximum.accumulate(middle)) > 0.0)
        middles.append(middle[ascends])
        leads.append(lead[ascends])
        first.append(first[-1] + int(ascends.sum()))
    return Leads(contact, np.array(first), np.concatenate(middles), np.concatenate(leads))
