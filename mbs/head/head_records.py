"""Heads as records, by which one compiled loop predicts and moves pantographs of several models.

What a step of a head depends on besides its state is known before: a row of numbers for each step,
``N_DRIVE`` of its model, then the lateral places of the wire on its strips [m] and their rates
[m/s].
"""

from __future__ import annotations

from typing import Any

import numpy as np

from catenary.mbs.control import control_kernels
from catenary.mbs.control.control_arrays import ACTING, N_SETTINGS, ControlArrays
from catenary.mbs.head import head_kernels
from catenary.mbs.head.flexure import ModeTables
from catenary.mbs.head.head_kernels import (
    N_DRIVE,
    Chain,
    HeadArrays,
    LinearStep,
    NewmarkFactors,
    RaisedHead,
)
from catenary.mbs.head.laws import LawArrays
from catenary.solver.base.kernels.compiled import inner
from catenary.solver.base.kernels.pointers import address_of, cube_at, numbers_at, table_at_address

# Models, as `head_kernels` steps them.
LUMPED, REDUCED, LAWFUL = 0, 1, 2

_KINDS = (ModeTables, HeadArrays, LinearStep, RaisedHead, Chain, LawArrays, ControlArrays)
_ADDRESSES = tuple(dict.fromkeys(name for kind in _KINDS for name in kind._fields))
# A head: its model, how many coordinates and strips it has, the coordinate of its roll or -1, its
# first contact; the heights that a reduced mechanism reaches [m], and how many breaks and columns
# its tables have; how many laws and points of these it has, rows of gains and numbers that a
# controller remembers; modes of its strips, points of their tables, the first mode's coordinate and
# the wires of a strip; its factors, and the addresses of its arrays, named as in `head_kernels`.
HEAD = np.dtype(
    [
        ("model", np.int64),
        ("n", np.int64),
        ("s", np.int64),
        ("roll", np.int64),
        ("first", np.int64),
        ("lowest", np.float64),
        ("highest", np.float64),
        ("n_breaks", np.int64),
        ("n_columns", np.int64),
        ("n_modes", np.int64),
        ("n_mode_breaks", np.int64),
        ("first_mode", np.int64),
        ("wires", np.int64),
        ("n_laws", np.int64),
        ("n_points", np.int64),
        ("n_gains", np.int64),
        ("n_memory", np.int64),
        *((name, np.float64) for name in NewmarkFactors._fields),
        *((name, np.int64) for name in _ADDRESSES),
    ]
)


def fill_head(record: np.void, values: dict[str, Any]) -> None:
    """Fill a record of ``HEAD``: of arrays the address, which their owner is to keep alive."""
    for name, value in values.items():
        record[name] = address_of(value) if name in _ADDRESSES else value


def drive_width(n_strips: int) -> int:
    """Numbers of a step's row for a head with so many strips."""
    return N_DRIVE + 2 * n_strips


@inner
def arrays_of(head):
    """The arrays at the addresses of a record."""
    n, s = head.n, head.s
    return HeadArrays(
        cube_at(head.touch, 2, s, n),
        numbers_at(head.state, 3 * n),
        numbers_at(head.free, 3 * n),
        table_at_address(head.by_force, 3 * n, s),
        numbers_at(head.out, 2 * s * (1 + s)),
    )


@inner
def laws_of(head):
    """The laws at the addresses of a record, which may be none."""
    m, k = head.n_laws, head.n_points
    return LawArrays(
        table_at_address(head.ways, m, head.n),
        numbers_at(head.of_rate, m),
        numbers_at(head.by_base, m),
        numbers_at(head.zero, m),
        numbers_at(head.first_point, m + 1),
        numbers_at(head.points, k),
        numbers_at(head.forces, k),
        numbers_at(head.pressed, head.s),
    )


@inner
def control_of(head):
    """The controller at the addresses of a record that has one."""
    return ControlArrays(
        numbers_at(head.settings, N_SETTINGS),
        table_at_address(head.gains, head.n_gains, 4),
        numbers_at(head.memory, head.n_memory),
    )


@inner
def cross(head, drive, across, touches, place):
    """Add to a row ``drive`` what ``across`` (3, n) says of where wires are at n contacts, and note
    in ``place`` (n,) where they are on the strips then, NaN where none is ``present``."""
    s = head.s
    for j in range(s):
        contact = head.first + j
        drive[N_DRIVE + j] += across[0, contact]
        drive[N_DRIVE + s + j] += across[1, contact]
        place[contact] = drive[N_DRIVE + j] if touches[contact].present != 0.0 else np.nan


@inner
def predict(head, drive, numbers, n_contacts):
    """Predict a head from a row ``drive`` of numbers: its strips' part of ``numbers``.

    ``numbers`` (2 n + 2 n^2,) are those of ``HeadState`` for all n contacts. Returns whether the
    head is where its model reaches.
    """
    n, s = head.n, head.s
    newmark = NewmarkFactors(
        head.dt, head.predict_position, head.predict_velocity, head.position, head.velocity
    )
    arrays = arrays_of(head)
    touch, out = arrays.touch, arrays.out
    if head.roll >= 0:
        for j in range(s):
            touch[0, j, head.roll] = drive[N_DRIVE + j]
            touch[1, j, head.roll] = drive[N_DRIVE + s + j]
    if head.n_modes > 0:
        m = head.n_mode_breaks
        breaks = numbers_at(head.mode_breaks, m)
        coefficients = cube_at(head.mode_coefficients, m - 1, head.n_modes, 4)
        place, rate = drive[N_DRIVE : N_DRIVE + s], drive[N_DRIVE + s : N_DRIVE + 2 * s]
        head_kernels.bend(touch, breaks, coefficients, head.first_mode, head.wires, place, rate)
    within, added = True, 0.0
    if head.n_gains > 0:
        added = numbers_at(head.memory, head.n_memory)[ACTING]
    if head.model == LUMPED:
        linear = LinearStep(
            table_at_address(head.matrix, 3 * n, 3 * n),
            numbers_at(head.by_drive, 3 * n),
            numbers_at(head.by_head, 3 * n),
            table_at_address(head.inverse, n, n),
        )
        head_kernels.linear_step(linear, newmark, arrays, drive[:N_DRIVE], added)
    elif head.model == LAWFUL:
        chain = Chain(
            numbers_at(head.masses, n),
            table_at_address(head.stiffness, n, n),
            table_at_address(head.damping, n, n),
            numbers_at(head.push, n),
            numbers_at(head.carrier, n),
        )
        laws = laws_of(head)
        head_kernels.chain_step(chain, laws, newmark, arrays, drive[:N_DRIVE], added)
    else:
        raised = RaisedHead(
            numbers_at(head.masses, n),
            table_at_address(head.stiffness, n, n),
            table_at_address(head.damping, n, n),
            numbers_at(head.push, n),
            numbers_at(head.breaks, head.n_breaks),
            cube_at(head.coefficients, head.n_breaks - 1, head.n_columns, 4),
        )
        laws = laws_of(head)
        height = head_kernels.raising_step(raised, laws, newmark, arrays, drive[:N_DRIVE], added)
        # What is not a number is left to those who couple.
        within = not (height < head.lowest or height > head.highest)
    begin = head.first
    for i in range(s):
        numbers[begin + i], numbers[n_contacts + begin + i] = out[i], out[s + i]
        for j in range(s):
            at = 2 * n_contacts + (begin + i) * n_contacts + begin + j
            numbers[at] = out[2 * s + i * s + j]
            numbers[at + n_contacts * n_contacts] = out[2 * s + s * s + i * s + j]
    return within


@inner
def move(head, force):
    """Move a head on under the forces (n,) at all contacts, after ``predict``."""
    arrays, contact_force = arrays_of(head), force[head.first : head.first + head.s]
    head_kernels.take(arrays, contact_force)
    if head.n_laws > 0:
        pressed = numbers_at(head.pressed, head.s)
        for j in range(head.s):
            pressed[j] = contact_force[j]
    if head.n_gains > 0:
        control_kernels.watch(control_of(head), arrays, contact_force)
