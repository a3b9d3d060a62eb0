"""Heads as records, by which one compiled loop predicts and moves pantographs of several models.

What a step of a head depends on besides its state is known before: a row of numbers for each step,
``N_DRIVE`` of its model, then the lateral places of the wire on its strips [m] and their rates
[m/s].
"""

from __future__ import annotations

from typing import Any

import numpy as np

from catenary.mbs.head import head_kernels
from catenary.solver.base.compiled import compiled
from catenary.solver.base.pointers import address_of, cube_at, numbers_at, table_at_address

# Models, as `head_kernels` steps them.
LUMPED, REDUCED = 0, 1
N_DRIVE = 6

_ADDRESSES = (
    "newmark", "touch", "state", "free", "by_force", "out",
    "step", "by_drive", "inverse",
    "masses", "stiffness", "damping", "breaks", "coefficients",
)  # fmt: skip
# A head: its model, how many coordinates and strips it has, the coordinate of its roll or -1, its
# first contact; the heights that a reduced mechanism reaches [m], and how many breaks its tables
# have; the addresses of its arrays, named as in `head_kernels`.
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


@compiled
def predict(head, drive, numbers, n_contacts):
    """Predict a head from a row ``drive`` of numbers: its strips' part of ``numbers``.

    ``numbers`` (2 n + 2 n^2,) are those of ``HeadState`` for all n contacts. Returns whether the
    head is where its model reaches.
    """
    n, s = head.n, head.s
    touch = cube_at(head.touch, 2, s, n)
    state, free = numbers_at(head.state, 3 * n), numbers_at(head.free, 3 * n)
    by_force, out = table_at_address(head.by_force, 3 * n, s), numbers_at(head.out, 2 * s * (1 + s))
    newmark = numbers_at(head.newmark, 5)
    if head.roll >= 0:
        for j in range(s):
            touch[0, j, head.roll] = drive[N_DRIVE + j]
            touch[1, j, head.roll] = drive[N_DRIVE + s + j]
    within = True
    if head.model == LUMPED:
        head_kernels.linear_step(
            table_at_address(head.step, 3 * n, 3 * n), numbers_at(head.by_drive, 3 * n),
            table_at_address(head.inverse, n, n), newmark[3], newmark[4],
            touch, state, free, by_force, out, drive[0],
        )  # fmt: skip
    else:
        height = head_kernels.raising_step(
            newmark, drive[:N_DRIVE], numbers_at(head.masses, n),
            table_at_address(head.stiffness, n, n), table_at_address(head.damping, n, n),
            numbers_at(head.breaks, head.n_breaks),
            cube_at(head.coefficients, head.n_breaks - 1, 4, 4),
            touch, state, free, by_force, out,
        )  # fmt: skip
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


@compiled
def move(head, force):
    """Move a head on under the forces (n,) at all contacts, after ``predict``."""
    n, s = head.n, head.s
    head_kernels.take(
        numbers_at(head.free, 3 * n),
        table_at_address(head.by_force, 3 * n, s),
        force[head.first : head.first + s],
        numbers_at(head.state, 3 * n),
    )
