"""Natural frequencies of pinned wires against their closed form, and how fast they converge.

A tensioned beam of length L, pinned at both ends, vibrates in sin(k_n x), k_n = n pi / L, with

    omega_n^2 = (T k^2 + EI k^4) / rho,
    f_n = n / (2 L) sqrt(T / rho) sqrt(1 + n^2 pi^2 EI / (T L^2)).

What the finite elements add to omega^2 follows from Galerkin's principle: the eigenvalue is in
error by the energy of what the element functions cannot represent of the mode. The error of
Hermite interpolation of sin(kx) is (k h)^4 / 24 (xi (1 - xi))^2 to leading order, orthogonal in
energy to all element functions; the integrals of its squared first and second derivative over an
element are 2/105 and 4/5, so that with s = EI k^2 / T

    omega_h^2 / omega^2 - 1 = ((k h)^6 / 30240 + s (k h)^4 / 720) / (1 + s) + ...

Order 4 for a beam, 6 for a string. The next terms follow from the characteristic equation of an
endless chain of elements: they multiply the string's part by 1 - 5/14 (k h)^2 and the beam's by
1 - 1/35 (k h)^2, and the rest is of relative order (k h)^4.
"""

from __future__ import annotations

import numpy as np
import pytest
from measuring import check, free_dofs, free_matrices, print_table
from scipy.sparse import linalg as sparse_linalg
from small_lines import BARE, bare_wires, mesh_of, problem_of

from catenary.meshgen.wires import Conductor
from catenary.solver.effects.build_model import build
from catenary.solver.model.model import Model

LENGTH = 60.0
STRING = Conductor(tension=20e3, mass_per_length=1.35, bending_stiffness=0.0)
# EI k^2 / T reaches 1 in the fifth mode: neither tension nor bending can be missed.
BEAM = Conductor(
    tension=16e3, mass_per_length=1.07, bending_stiffness=16e3 * (LENGTH / (5 * np.pi)) ** 2
)

STRING_NEXT, BEAM_NEXT = 5 / 14, 1 / 35


def model_of(n_elements: int) -> Model:
    line = bare_wires(LENGTH, contact_wire=STRING, messenger_wire=BEAM)
    return build(problem_of(line, BARE), mesh_of(line, n_elements), np.zeros(0))


def eigenvalues(n_elements: int, wire: str, count: int) -> np.ndarray:
    """The lowest omega^2 of one wire [1/s2]; without droppers the wires do not know each other."""
    model = model_of(n_elements)
    mass, stiffness = free_matrices(model)
    nodes = model.mesh.wires[wire]
    own = np.concatenate([model.dofs(nodes), model.dofs(nodes, "theta_y")])
    mine = np.flatnonzero(np.isin(free_dofs(model), own))
    found = sparse_linalg.eigsh(
        stiffness[mine][:, mine], k=count, M=mass[mine][:, mine], sigma=0.0, which="LM"
    )[0]
    return np.sort(found)


def exact(wire: Conductor, mode: np.ndarray) -> np.ndarray:
    k = mode * np.pi / LENGTH
    return (wire.tension * k**2 + wire.bending_stiffness * k**4) / wire.mass_per_length


def element_error(wire: Conductor, mode: np.ndarray, n_elements: int, terms: int = 2) -> np.ndarray:
    """Relative error of omega^2 by the first one or two terms of the series."""
    kh = mode * np.pi / n_elements
    s = wire.bending_stiffness * (mode * np.pi / LENGTH) ** 2 / wire.tension
    string, beam = kh**6 / 30240, kh**4 / 720
    if terms == 2:
        string = string * (1 - STRING_NEXT * kh**2)
        beam = beam * (1 - BEAM_NEXT * kh**2)
    return (string + s * beam) / (1 + s)


@pytest.mark.parametrize(("name", "wire"), [("contact_wire", STRING), ("messenger_wire", BEAM)])
def test_frequencies_agree_with_the_closed_form_to_the_error_of_the_elements(
    name: str, wire: Conductor
) -> None:
    mode = np.arange(1, 9)
    for n_elements in (20, 40, 80):
        found = eigenvalues(n_elements, name, mode.size)
        ratio = found / exact(wire, mode) - 1
        expected = element_error(wire, mode, n_elements)
        kh = mode * np.pi / n_elements
        # What the series leaves out, and the eigensolver: it solves with K, which costs eps times
        # its condition number, of the order of (L / h)^2 for a string and (L / h)^4 for a beam.
        round_off = np.finfo(float).eps * n_elements ** (2 if wire is STRING else 4)
        check(
            f"{name}, {n_elements} elements, relative error of omega^2",
            ratio,
            expected,
            within=kh**4 * expected + round_off,
        )
        frequency = np.sqrt(found) / (2 * np.pi)
        bending = mode**2 * np.pi**2 * wire.bending_stiffness / (wire.tension * LENGTH**2)
        closed_form = mode / (2 * LENGTH) * wire.wave_speed * np.sqrt(1 + bending)
        # Half the relative error of omega^2; the series alternates, so its first term bounds it.
        allowed = closed_form * (element_error(wire, mode, n_elements, terms=1) + round_off) / 2
        check(f"{name}, {n_elements} elements, f_n [Hz]", frequency, closed_form, within=allowed)


@pytest.mark.parametrize(
    ("name", "wire", "theory"), [("contact_wire", STRING, 6), ("messenger_wire", BEAM, 4)]
)
def test_eigenvalues_converge_with_the_order_of_the_theory(
    name: str, wire: Conductor, theory: int
) -> None:
    """The tenth mode: its error stays far above round-off on all meshes."""
    mode, sizes = 10, [10, 20, 40, 80]
    errors = [
        float(eigenvalues(n, name, mode)[-1] / exact(wire, np.array(mode)) - 1) for n in sizes
    ]
    observed = print_table(
        f"{name}: eigenvalue of mode {mode}, expected order {theory}", sizes, errors
    )
    # The next term lowers the order that two meshes show by log2(1 + c (k h)^2) at most, with the
    # k h of the coarser one.
    following = STRING_NEXT if wire is STRING else BEAM_NEXT
    within = np.log2(1 + following * (np.pi * mode / sizes[-2]) ** 2)
    check(f"{name}: order", observed[-1], theory, within=within)
