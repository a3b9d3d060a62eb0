"""Strips that bend: frequencies and receptances of beams, in closed form and by finite elements."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from measuring import check
from scipy import linalg
from scipy.integrate import simpson

from catenary.mbs.head.stepping import LateralPath, Stepping
from catenary.mbs.head.strips import (
    Flexure,
    HeadParts,
    Strips,
    Suspension,
    head_parts,
    mode_tables,
    shapes,
)
from catenary.mbs.lumped import LumpedData, LumpedPantograph, chain_matrix
from catenary.mbs.response import head_response

# A carbon strip on its aluminium holder: 1.1 m, 3 kg, EI of some hundreds.
LENGTH, MASS, EI, SPRING, APART = 1.1, 3.0, 600.0, 8000.0, 0.7
SUSPENSION = Suspension(MASS, SPRING, 10.0)


def strips(n_modes: int, stiffness: float = EI, number: int = 1) -> Strips:
    flexure = Flexure(stiffness, APART, n_modes)
    return Strips(number, 0.5, LENGTH, SUSPENSION, flexure=flexure)


def test_frequencies_and_masses_are_those_of_a_free_beam() -> None:
    """b L = 4.7300407, 7.8532046, 10.9956078, .. (any table); shapes are orthogonal to each other,
    to a rigid beam's height and roll, and of the strip's mass."""
    rates = Flexure(EI, APART, 6).rates(MASS, LENGTH)
    roots = np.array([4.7300407449, 7.8532046241, 10.9956078380, 14.1371654913, 17.2787596574])
    expected = roots**2 * math.sqrt(EI * LENGTH / MASS) / LENGTH**2
    check("w / w", rates[:5] / expected, 1.0, within=1e-9)
    y = np.linspace(-0.5 * LENGTH, 0.5 * LENGTH, 20001)
    all_of_them = np.vstack([np.ones_like(y), y, shapes(6, LENGTH, y)])
    products = simpson(all_of_them[:, None] * all_of_them[None], x=y) / LENGTH
    wanted = np.diag([1.0, LENGTH**2 / 12.0, *np.ones(6)])
    check("products", products, wanted, within=1e-8)
    check("at the ends", np.abs(shapes(6, LENGTH, y[[0, -1]])), 2.0, within=1e-7)


def test_tables_hold_the_shapes_between_their_points() -> None:
    """Cubic splines: (pi / 100)^4 5 / 384 of the highest wave, some more at the ends."""
    tables = mode_tables(4, LENGTH)
    y = np.linspace(-0.5 * LENGTH, 0.5 * LENGTH, 977)
    i = np.clip(np.searchsorted(tables.breaks, y, side="right") - 1, 0, None)
    i = np.minimum(i, tables.breaks.size - 2)
    d = y - tables.breaks[i]
    c = tables.coefficients[i]
    found = ((c[..., 0].T * d + c[..., 1].T) * d + c[..., 2].T) * d + c[..., 3].T
    check("shapes", found, shapes(4, LENGTH, y), within=2e-7)


def test_the_response_of_a_pantograph_has_its_strips_that_bend() -> None:
    """Two strips alike: as one of twice the mass, springs and EI, under the matrices of a run."""
    at = np.geomspace(0.5, 60.0, 40)
    chain = (9.0, 15.0), (4200.0, 50.0), (10.0, 90.0)
    found = head_response(LumpedData(*chain, strips(3, number=2)), 120.0).model.receptance(at)
    twice = Suspension(2.0 * MASS, 2.0 * SPRING, 20.0)
    one = Strips(1, 0.0, LENGTH, twice, flexure=Flexure(2.0 * EI, APART, 3))
    head = LumpedData(*chain, one).head(rolls=False)
    mass = np.diag([*head.masses, 15.0])
    springs, dampers = (
        chain_matrix(matrix, values)[:-1, :-1]
        for matrix, values in ((head.stiffness, (50.0,)), (head.damping, (90.0,)))
    )
    push, omega = np.append(head.touch[0], 0.0), 2.0 * np.pi * at[:, None, None]
    dynamic = springs - omega**2 * mass + 1j * omega * dampers
    expected = np.linalg.solve(dynamic, np.tile(push[:, None], (at.size, 1, 1)))[..., 0] @ push
    check("H / H", np.abs(found / expected - 1.0), 0.0, within=1e-9)
    rigid = replace(strips(3, number=2), flexure=None)
    stiff = head_response(LumpedData(*chain, rigid), 120.0).model.receptance(at)
    assert np.abs(found / stiff - 1.0).max() > 0.1


def elements(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A beam of n Euler-Bernoulli elements on two springs: mass, stiffness, places of nodes."""
    h, places = LENGTH / n, np.linspace(-0.5 * LENGTH, 0.5 * LENGTH, n + 1)
    k = EI / h**3 * np.array(
        [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
         [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]])  # fmt: skip
    m = MASS / LENGTH * h / 420 * np.array(
        [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
         [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]])  # fmt: skip
    mass, stiffness = np.zeros((2, 2 * n + 2, 2 * n + 2))
    for e in range(n):
        own = slice(2 * e, 2 * e + 4)
        mass[own, own] += m
        stiffness[own, own] += k
    for place in (-0.5 * APART, 0.5 * APART):
        node = int(np.argmin(np.abs(places - place)))
        assert abs(places[node] - place) < 1e-9
        stiffness[2 * node, 2 * node] += 0.5 * SPRING
    return mass, stiffness, places


def on_a_heavy_head(n_modes: int) -> HeadParts:
    return head_parts(1e9, 1.0, 0.0, strips(n_modes))


def matrices(parts: HeadParts) -> tuple[np.ndarray, np.ndarray]:
    """Mass and stiffness without the head, which is too heavy to move."""
    own = [i for i in range(parts.n) if i != 1]
    return np.diag(parts.masses)[np.ix_(own, own)], parts.stiffness[np.ix_(own, own)]


def test_a_strip_on_its_springs_swings_as_finite_elements_do() -> None:
    """Symmetric and antisymmetric motions. The strip's roll is the head's, which is held here, so
    that antisymmetric bending is compared with a beam that cannot roll: its first mode is left.
    Ritz: frequencies come down to the exact ones; with six modes within 1e-3."""
    mass, stiffness, places = elements(110)
    # No roll: the constraint int y w dy = 0 of the rigid part, by mass-orthogonality to y.
    roll = np.zeros(mass.shape[0])
    roll[::2], roll[1::2] = places, 1.0
    constraint = mass @ roll
    basis = linalg.null_space(constraint[None, :])
    exact = np.sqrt(linalg.eigh(basis.T @ stiffness @ basis, basis.T @ mass @ basis,
                                eigvals_only=True)[:4])  # fmt: skip
    previous = np.full(4, np.inf)
    for n in (3, 4, 6):
        found = np.sqrt(linalg.eigh(*matrices(on_a_heavy_head(n))[::-1], eigvals_only=True)[:4])
        print(n, found / exact - 1.0)
        assert (found >= exact * (1.0 - 1e-7)).all() and (found <= previous * (1.0 + 1e-12)).all()
        previous = found
    check("frequencies [rad/s]", previous / exact, 1.0, within=1e-3)


@pytest.mark.parametrize("place", [0.0, 0.2, 0.4])
@pytest.mark.parametrize("hertz", [0.0, 10.0, 40.0])
def test_the_receptance_where_the_wire_is_is_that_of_finite_elements(
    place: float, hertz: float
) -> None:
    """Of a pair of forces at +-place, which do not roll the strip. What modes beyond the eighth
    add is below 1e-3: 1 / (m w_k^2) falls with the fourth power of the mode's number."""
    mass, stiffness, places = elements(110)
    square = (2.0 * math.pi * hertz) ** 2
    nodes = [2 * int(np.argmin(np.abs(places - at))) for at in (place, -place)]
    load = np.zeros(mass.shape[0])
    np.add.at(load, nodes, 0.5)
    exact = load @ np.linalg.solve(stiffness - square * mass, load)
    m, k = matrices(on_a_heavy_head(6))
    touch = np.concatenate([[1.0], shapes(6, LENGTH, np.array([place, -place])).mean(axis=1)])
    found = touch @ np.linalg.solve(k - square * m, touch)
    check("receptance ratio", found / exact, 1.0, within=3e-3)


def stepped(data: LumpedData, stagger: float, n: int = 400) -> np.ndarray:
    """Heights of the strips after each step under a force that swings, on a zigzag."""
    x = np.arange(0.0, 200.0, 20.0)
    path = LateralPath([(x, tuple(stagger * (-1) ** i for i in range(x.size)))], 10.0,
                       data.strips.offsets, 70.0)  # fmt: skip
    one = LumpedPantograph(data, 120.0, 5.0, Stepping(0.0, 1e-3, lateral=path))
    one.place(5.0)
    found = []
    for number in range(1, n + 1):
        head = one.predict(1e-3 * number)
        force = np.full(len(data.strips.offsets), 60.0 + 30.0 * math.sin(0.2 * number))
        found.append(head.height - head.height_compliance @ force)
        one.advance(force)
    return np.array(found)


def test_a_strip_that_is_very_stiff_is_rigid() -> None:
    """The static bending of EI = 1e7 N m2 is 6e-5 of that of 600 N m2, some 0.4 mm."""
    rigid = LumpedData((9.0, 15.0), (4200.0, 50.0), (10.0, 90.0),
                       Strips(2, 0.5, LENGTH, SUSPENSION))  # fmt: skip
    stiff = replace(rigid, strips=strips(3, 1e7, number=2))
    soft = replace(rigid, strips=strips(3, number=2))
    reference = stepped(rigid, 0.3)
    check("largest difference [m]", stepped(stiff, 0.3), reference, within=2e-7)
    assert np.abs(stepped(soft, 0.3) - reference).max() > 1e-4


def test_a_still_wire_at_the_end_of_a_strip_rests_where_statics_say() -> None:
    """At 0.45 m from the middle: compliance of springs and beam, from the modes themselves."""
    data = LumpedData((9.0, 15.0), (4200.0, 1e7), (300.0, 1e5), strips(6))
    damped = replace(data.strips, suspension=replace(SUSPENSION, damping=300.0))
    path = LateralPath([(np.array([0.0, 1e3]), (0.45, 0.45))], 10.0, (0.0,), 70.0)
    stepping = Stepping(0.0, 2e-3, lateral=path)
    one = LumpedPantograph(replace(data, strips=damped), 0.0, 5.0, stepping)
    one.place(5.0)
    for number in range(1, 3001):
        head = one.predict(2e-3 * number)
        one.advance(np.array([50.0]))
    m, k = matrices(on_a_heavy_head(6))
    touch = np.concatenate([[1.0], shapes(6, LENGTH, np.array([0.45]))[:, 0]])
    down = 50.0 * (touch @ np.linalg.solve(k, touch) + 1.0 / 4200.0 + 1e-7)
    found = head.height - head.height_compliance @ np.array([50.0])
    check("height [m]", found, 5.0 - down, within=1e-6)
