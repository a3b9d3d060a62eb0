"""Arrays of the contacts of a rank, as kernels take them; see ``kernels/contact``."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.contact.contact_wire import WireShapes
from catenary.solver.contact.followed_links import Followed
from catenary.solver.integrators.line_state import Motion
from catenary.solver.linear.unit_responses import ShortColumns


class Sideways(NamedTuple):
    """Unknowns (v, theta_z) of the contact wires' nodes on a rank: their numbers ``local``
    (n_nodes, 2), 0 where another rank owns them; whether this one does, ``owned``; what they are at
    ``rest``, lateral positions [m] and slopes [-]. Without rows where no lateral motion is
    simulated."""

    local: np.ndarray
    owned: np.ndarray
    rest: np.ndarray


class Across(NamedTuple):
    """Lateral motion of wires at n contacts: ``place`` [m], its total ``rate`` [m/s], and
    displacement ``moved`` [m]; empty where no lateral motion is simulated."""

    place: np.ndarray
    rate: np.ndarray
    moved: np.ndarray


def no_sideways() -> Sideways:
    """Lateral data of a line without lateral motion, empty."""
    nothing = np.zeros((0, 2))
    return Sideways(nothing.astype(np.int64), nothing.astype(bool), nothing)


class Answers(NamedTuple):
    """The line's accelerations by a unit force at each of n contacts.

    ``by_force`` (n, n_local); their derivatives along the track, ``slope`` of the same shape, or
    without columns where no law needs rates.
    """

    by_force: np.ndarray
    slope: np.ndarray


class Gains(NamedTuple):
    """Gains of answers within a step: of an acceleration ``position`` [s2] and ``velocity``
    [s]; the ``train_speed`` [m/s] of the convective part of rates; how far off links answer to a
    force, ``reach`` [m]."""

    train_speed: float
    position: float
    velocity: float
    reach: float


class ContactWork(NamedTuple):
    """Work of n contact forces on the line, summed step by step; see ``contacts.hpp``.

    Attributes
    ----------
    total : (1,) work since the start on the unknowns that this rank owns [J]
    force : (n,) contact forces at the end of the previous step [N]
    local, value : (n, 4) local unknowns and shape functions of the contacts at that time
    before, ahead : (n,) velocity of the wire at the end of the previous step [m/s], at the contacts
        of that time and at the new ones
    share_before, share_after : weights of the forces at the start and at the end of a step [-]
    dt : time step [s]
    """

    total: np.ndarray
    force: np.ndarray
    local: np.ndarray
    value: np.ndarray
    before: np.ndarray
    ahead: np.ndarray
    share_before: float
    share_after: float
    dt: float


def no_work(n_contacts: int, share_after: float, dt: float) -> ContactWork:
    """Work of ``n_contacts`` contact forces before the first step of ``dt`` [s].

    ``share_after`` is the weight of the force at the end of a step [-], 1 less that at its start.
    """
    local, value = np.zeros((n_contacts, 4), dtype=np.int64), np.zeros((n_contacts, 4))
    force, before, ahead = np.zeros((3, n_contacts))
    shares = 1.0 - share_after, share_after
    return ContactWork(np.zeros(1), force, local, value, before, ahead, *shares, dt)


class Contacts(NamedTuple):
    """Arrays of n contacts.

    Attributes
    ----------
    x : (n,) places along the track [m]
    touches : (n,) records of ``TOUCH``
    wires : WireShapes of the contact wires
    columns : columns of A^-1 for the nodes of the ``wires``
    answers, gains : accelerations of the line by a unit force at each contact, and their gains in a
        step
    motion, motion_gains : of the line, see ``LineState``
    followed : links that may switch, as steps follow them
    link_columns : of A^-1 for compensations of all links of the line
    work : work of the contact forces on the line
    sideways, across : the wires' lateral unknowns at the contacts, and their lateral motion there
    """

    x: np.ndarray
    touches: np.ndarray
    wires: WireShapes
    columns: np.ndarray
    answers: Answers
    gains: Gains
    motion: Motion
    motion_gains: np.ndarray
    followed: Followed
    link_columns: ShortColumns
    work: ContactWork
    sideways: Sideways
    across: Across
