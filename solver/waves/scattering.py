"""Reflection and transmission by single obstacles on tensioned wires: closed forms.

A wire is a beam of bending stiffness EI under the tension T, of mass m a length. Waves are
exp(i (w t - k x)), with EI k^4 + T k^2 = m w^2; beside them there is what falls off as exp(-q |x|),
q^2 = k^2 + T / EI. A unit force at x = 0 makes

    w(x) = g exp(-i k |x|) - n exp(-q |x|),     g = 1 / (2 i k s),  n = 1 / (2 q s),
    s = EI (k^2 + q^2) .

An obstacle that answers a deflection with the force D, as a spring, a mass or a damper does, makes
of a wave a share R of it that comes back and 1 + R that goes on,

    R = -g D / (1 + (g - n) D),     a string: R = -D / (D + 2 i w Z),  Z = sqrt(T m) .

Obstacles that join several wires, such as droppers, have matrices in place of D and R.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.meshgen.wires import Conductor


class Answer(NamedTuple):
    """Waves that a unit force at one place of a wire makes, at f frequencies.

    Attributes
    ----------
    wavenumber, decay : k and q (f,) [rad/m], [1/m]
    wave, near : g and n (f,) [m/N]
    """

    wavenumber: np.ndarray
    decay: np.ndarray
    wave: np.ndarray
    near: np.ndarray


def answer(wire: Conductor, omega: np.ndarray) -> Answer:
    """The answer of an endless wire at angular frequencies (f,), positive [1/s].

    Without bending stiffness nothing falls off but at once.
    """
    tension, bending = wire.tension, wire.bending_stiffness
    inertia = wire.mass_per_length * omega**2
    # The smaller root in a form that has a limit for no bending.
    square = 2.0 * inertia / (tension + np.sqrt(tension**2 + 4.0 * bending * inertia))
    k = np.sqrt(square)
    slope = tension + 2.0 * bending * square
    if bending == 0.0:
        none = np.zeros_like(k)
        return Answer(k, np.full_like(k, np.inf), 1.0 / (2j * k * slope), none)
    q = np.sqrt(square + tension / bending)
    return Answer(k, q, 1.0 / (2j * k * slope), 1.0 / (2.0 * q * slope))


def scattered(
    wires: tuple[Conductor, ...], omega: np.ndarray, resistance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Shares of waves that come back from an obstacle, and that go on beyond it.

    Parameters
    ----------
    wires : tuple of Conductor
        Wires that the obstacle joins.
    omega : ndarray, shape (f,)
        Angular frequencies [1/s].
    resistance : ndarray, shape (f, n, n)
        Matrices D, forces of the obstacle against unit deflections of the wires [N/m].

    Returns
    -------
    back, onward : (f, n, n) complex, amplitude on the wire of the row of a unit wave on that of the
        column
    """
    answers = [answer(wire, omega) for wire in wires]
    one = np.eye(len(wires))
    wave = np.stack([a.wave for a in answers], axis=1)[:, :, None] * one
    whole = np.stack([a.wave - a.near for a in answers], axis=1)[:, :, None] * one
    # Forces f = -D u on the wires, u = e + (g - n) f for the deflection e that comes in.
    force = -np.linalg.solve(one + resistance @ whole, resistance)
    back = wave @ force
    return back, one + back


def change_of_wire(
    first: Conductor, second: Conductor, omega: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Shares of a wave on ``first`` that come back from where it becomes ``second``, and go on.

    Amplitudes (f,) complex at the angular frequencies ``omega`` (f,) [1/s]. Both wires have bending
    stiffness; deflection, slope, moment and vertical force are continuous. For strings the
    amplitudes are (Z1 - Z2) / (Z1 + Z2) and 2 Z1 / (Z1 + Z2).
    """
    one, two = answer(first, omega), answer(second, omega)
    # exp(-i k x) on the left, R exp(i k x) + N exp(q x) there, T exp(-i k x) + M exp(-q x) beyond.
    exponents = [1j * one.wavenumber, one.decay + 0j, -1j * two.wavenumber, -two.decay + 0j]
    kinds = [first, first, second, second]
    signs = [1.0, 1.0, -1.0, -1.0]
    columns = [sign * _at_joint(a, w) for a, w, sign in zip(exponents, kinds, signs, strict=True)]
    incoming = _at_joint(-1j * one.wavenumber, first)
    found = np.linalg.solve(np.stack(columns, axis=2), -incoming[:, :, None])[:, :, 0]
    return found[:, 0], found[:, 2]


def _at_joint(exponent: np.ndarray, wire: Conductor) -> np.ndarray:
    """Deflection, slope, moment and vertical force of exp(a x) at x = 0, (f, 4)."""
    a, bending = exponent, wire.bending_stiffness
    return np.stack([np.ones_like(a), a, bending * a**2, wire.tension * a - bending * a**3], axis=1)
