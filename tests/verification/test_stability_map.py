"""Stability of the couplings: matrices of a step, closed forms and marches of the program agree."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from measuring import check
from mpi4py import MPI
from scenes import read_draft
from scipy import linalg
from small_lines import EN_PANTOGRAPH, HANGING, en50318_line, mesh_of, problem_of

from catenary.cases.studies.records import KeptRows
from catenary.cases.studies.stability import coupling_schemes as theory
from catenary.cases.studies.stability import map as map_of_stability
from catenary.cases.studies.stability.coupling_schemes import COUPLINGS, Bench
from catenary.cases.studies.stability.map import RESOLUTION, Grid, as_rows, draw, find, make_map
from catenary.mbs.lumped import LumpedData
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.model.partition import distribute
from catenary.solver.problem.integrator_parameters import AVERAGE_ACCELERATION, integration_of
from catenary.solver.statics.line_at_rest import line_at_rest

pytestmark = pytest.mark.study

GRID = ((1e5, 0.5), (1e5, 8.0), (1e7, 2.0))
NEWMARK = theory.Methods(AVERAGE_ACCELERATION, AVERAGE_ACCELERATION)


@pytest.fixture(scope="module")
def bench() -> Bench:
    """Three spans with damping, droppers that stay taut, contact that lasts."""
    problem = problem_of(en50318_line(3), HANGING | {"structural_damping"})
    rest = line_at_rest(problem, mesh_of(en50318_line(3), 3))
    wire = ContactWires(rest.model, rest.form, distribute(rest.model, 1, 0))
    place = theory.lightest_place(rest.model, wire, 60.0, 120.0)
    assert place is not None
    return Bench(rest, EN_PANTOGRAPH, place, MPI.COMM_SELF)


def line_at(bench: Bench, n_vectors: int = theory.N_VECTORS) -> theory.PointModel:
    model = bench.rest.model
    wire = ContactWires(model, bench.rest.form, distribute(model, 1, 0))
    return theory.point_model(model, theory.loads_at(wire, bench.x, model.n_dofs), n_vectors)


def head(mass: float) -> LumpedData:
    return LumpedData((mass, *EN_PANTOGRAPH.masses[1:]), EN_PANTOGRAPH.stiffnesses,
                      EN_PANTOGRAPH.dampings)  # fmt: skip


@pytest.mark.parametrize("coupling", COUPLINGS)
def test_theory_and_marches_find_the_same_limits(coupling: str, bench: Bench) -> None:
    """A march of 400 steps shows growth from where a step multiplies by 1000^(1/400), and 1000
    exchanges agree to 1e-10 of the first up to a ratio of 1e-10^(1/1000), at a step 1.2 % below
    the limit; both follow from theory. What is left is the width of the bracket."""
    line = line_at(bench)
    for stiffness, mass in GRID:
        found = find(bench, line, coupling, stiffness, mass)
        print(
            f"{coupling} {stiffness:g} N/m {mass:g} kg: theory {found.theory:.4g}, to be seen from "
            f"{found.visible:.4g} on, marched {found.stable:.4g} to {found.unstable:.4g} s"
        )
        assert found.agrees
        if coupling == "implicit":
            assert found.stable == 0.025 and np.isinf(found.theory)
            continue
        # Both are limits within the range, so that the brackets are ones.
        assert 1e-5 < found.stable < found.unstable <= (1 + RESOLUTION) * found.stable < 0.025
        assert found.theory < found.unstable * 1.03
        # Springs within the step only add to what the masses resist.
        assert found.closed_form < found.theory * (1 + 1e-4)
        if coupling == "explicit":
            check("omega dt = 2", found.theory, found.closed_form, within=1e-3 * found.closed_form)


@pytest.mark.parametrize(
    ("integrator", "spectral_radius"), [("generalized_alpha", 0.5), ("hht", 0.6)]
)
def test_other_integrators_have_limits_of_their_own(
    integrator: str, spectral_radius: float, bench: Bench
) -> None:
    """At the limit of the explicit coupling all changes its sign from step to step. With b =
    M^-1 f, a = b (1 - 2 a_f) / (1 - 2 a_m), d = (2 beta - gamma) dt^2 a / 2 and d* = -d + q beta
    dt^2 b that is 1 = k dt^2 (g_line / m_wire + g_head / m_head) for masses alone, where

        g = q beta - (beta - gamma / 2) (1 - 2 a_f) / (1 - 2 a_m),     q = (1 - a_f) / (1 - a_m)

    and 1/4 for the head, which steps by average acceleration. Springs of the line, which act at d,
    are some 1e5 N/m of 1e7 N/m in a contact.
    """
    problem = bench.rest.problem
    numerics = replace(problem.numerics, integrator=integrator, spectral_radius=spectral_radius)
    rest = bench.rest._replace(problem=replace(problem, numerics=numerics))
    other, line = replace(bench, rest=rest), line_at(bench)
    limits = {c: find(other, line, c, 1e7, 2.0) for c in ("implicit", "explicit", "iterated")}
    assert all(one.agrees for one in limits.values())
    assert np.isinf(limits["implicit"].theory) and np.isinf(limits["explicit"].closed_form)
    beta, gamma, a_m, a_f = integration_of(integrator, spectral_radius)
    q = (1.0 - a_f) / (1.0 - a_m)
    of_line = q * beta - (beta - 0.5 * gamma) * (1.0 - 2.0 * a_f) / (1.0 - 2.0 * a_m)
    expected = (1e7 * (of_line / line.mass + 0.25 / 2.0)) ** -0.5
    found = limits["explicit"].theory
    check("explicit [s]", found, expected, within=0.01 * expected)
    usual = find(bench, line, "explicit", 1e7, 2.0).theory
    assert found < 0.97 * usual, "it has another limit than average acceleration"
    # Exchanges: masses alone resist within a step.
    expected = (1e7 * (q * beta / line.mass + 0.25 / 2.0)) ** -0.5
    check("iterated [s]", limits["iterated"].theory, expected, within=0.01 * expected)


def test_a_tenth_more_than_the_limit_breaks_and_a_tenth_less_does_not(bench: Bench) -> None:
    """The other way round: a limit that is wrong by a tenth would be noticed."""
    line = line_at(bench)
    stiffness, mass = 1e6, 2.0
    both = theory.couple(line, head(mass), NEWMARK)
    for coupling in COUPLINGS[1:]:
        limit = both.largest_step(stiffness, coupling, (1e-5, 0.025))
        assert bench.is_stable(coupling, stiffness, mass, 0.9 * limit)
        assert not bench.is_stable(coupling, stiffness, mass, 1.1 * limit)


def test_a_line_as_a_point_sees_it_is_the_line(bench: Bench) -> None:
    """The reduced line has the answer of all unknowns within a step, and the same step matrix's
    radius beyond the limit, where one eigenvalue of the contact stands out."""
    model = bench.rest.model
    wire = ContactWires(model, bench.rest.form, distribute(model, 1, 0))
    load = theory.loads_at(wire, bench.x, model.n_dofs)
    mass, stiffness, damping = (part.toarray() for part in theory.matrices(model))
    line = line_at(bench)
    dt = 2e-3
    whole = theory.Coupled(
        linalg.block_diag(mass, np.diag(EN_PANTOGRAPH.masses)),
        linalg.block_diag(stiffness, EN_PANTOGRAPH.chain(EN_PANTOGRAPH.stiffnesses)),
        linalg.block_diag(damping, EN_PANTOGRAPH.chain(EN_PANTOGRAPH.dampings)),
        np.concatenate([-load, [[1.0], [0.0]]]),
        len(load),
        NEWMARK,
    )
    reduced = theory.couple(line, EN_PANTOGRAPH, NEWMARK)
    check(
        "effective mass [kg]",
        line.mass,
        1.0 / float((load.T @ np.linalg.solve(mass, load))[0, 0]),
        within=1e-12,
    )
    # Round-off of Lanczos's method, orthogonalised twice.
    ratios = [both.exchange_ratio(dt, 1e6) for both in (reduced, whole)]
    check("ratio of an exchange", ratios[0], ratios[1], within=1e-10)
    radii = [both.radius(dt, 1e6, "explicit") for both in (reduced, whole)]
    assert radii[1] > 1.1
    check("radius of an explicit step", radii[0], radii[1], within=1e-8)
    # And too few vectors are too few: what is compared is not the same by itself.
    few = theory.couple(line_at(bench, 2), EN_PANTOGRAPH, NEWMARK)
    assert abs(few.exchange_ratio(dt, 1e6) - ratios[1]) > 1e-6


def test_a_light_wire_limits_the_step_under_a_heavy_head(bench: Bench) -> None:
    """Not dt = 2 sqrt(m_head / k): the wire meets a force with less than a kilogram."""
    line = line_at(bench)
    heavy = theory.couple(line, head(30.0), NEWMARK)
    limit = heavy.largest_step(1e6, "explicit", (1e-5, 0.025))
    print(f"m_wire {line.mass:.3f} kg, limit {1e3 * limit:.3f} ms")
    # Less than the wire of the longest element, 6.5 m / 3: a force moves its neighbourhood alone.
    assert line.mass < 6.5 / 3 * 1.35
    assert limit < 0.2 * 2 * np.sqrt(30.0 / 1e6)


def test_the_map_of_a_case_is_found_drawn_and_written() -> None:
    """One point of the reference case, with a limit for all couplings but the implicit one."""
    grid = Grid((1e6,), (2.0,), (1e6,), (2.0,))
    said: list[str] = []
    found = make_map(read_draft("en50318_2002", (), True), MPI.COMM_SELF, grid, said.append)
    assert [one.coupling for one in found.limits] == list(COUPLINGS)
    assert all(one.agrees for one in found.limits)
    assert len(said) == 1 and "1e+06 N/m, 2 kg" in said[0]
    rows = {row["coupling"]: row for row in as_rows(found)}
    assert rows["implicit"]["theory_s"] is None and rows["implicit"]["marched_stable_s"] == 0.025
    # The rule with the wire: docs/contact.md.
    rule = 2 / np.sqrt(1e6 * (1 / 2.0 + 1 / found.wire_mass))
    check("explicit [s]", rows["explicit"]["theory_s"], rule, within=1e-3 * rule)
    assert found.own == (5e4, 7.2, 1e-3)
    left, right = draw(found).axes[:2]
    drawn = {
        marker: line.get_ydata()
        for line in left.lines
        if (marker := line.get_marker()) in ("o", "s", "^")
    }
    assert set(drawn) == {"o", "s", "^"}
    check("drawn [ms]", drawn["o"], 1e3 * rule, within=0.02 * 1e3 * rule)
    assert right.get_xlabel() == "head mass [kg]"
    assert "contact 10⁶ N/m" in [text.get_text() for text in right.texts]
    # A march that contradicts theory is told, not hidden.
    wrong = replace(found.limits[1], stable=2 * rule, unstable=2.1 * rule)
    assert not wrong.agrees


def test_what_is_not_of_the_linear_system_is_left_out() -> None:
    """Steps that adapt, windows, stops, incidents and tolerances of a scene neither change the map
    nor have it refused."""
    grid = Grid((1e6,), (2.0,), (1e6,), (2.0,))
    words = (
        "numerics.adaptive_tolerance_N=0.1",
        "line.steady_arm.uplift_stop_m=0.0005",
        "incidents=[{type='lowering',at_s=0.5},{type='dropper_break',at_s=1,span=6,dropper=2}]",
    )
    own = "numerics.coupling=iterated", "numerics.eps_force_N=1e-3", "numerics.max_iterations=20"
    plain, changed, exchanged, moving = (
        make_map(read_draft("en50318_2002", these, True), MPI.COMM_SELF, grid)
        for these in ((), words, own, ("window.mode=exact",))
    )
    assert plain.limits == changed.limits == exchanged.limits == moving.limits


@pytest.mark.parametrize(
    ("case", "n_wires"),
    [
        ("re330_stitched", 1),
        ("shinkansen_compound", 1),
        ("dc_twin", 2),
        ("overlap", 2),
        ("ac_simple_3d", 1),
    ],
)
def test_lines_of_other_topologies_have_maps(
    case: str, n_wires: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The head touches all wires above it: two of a twin line and of an overlap, which the rule for
    one wire would give steps that are too long by a sixth and more."""
    grid = Grid((1e6,), (2.0,), (1e6,), (2.0,))
    found = make_map(read_draft(case, (), True), MPI.COMM_SELF, grid, kept=KeptRows(tmp_path))
    for one in found.limits:
        print(f"{case} {one.coupling}: theory {one.theory:.4g}, marched {one.marched:.4g} s")
    assert found.n_wires == n_wires
    assert all(one.agrees for one in found.limits)
    explicit = found.of("explicit")[0]
    check("omega dt = 2", explicit.theory, explicit.closed_form, within=2e-3 * explicit.theory)
    assert ("2 contact wires meet" in draw(found).get_suptitle()) == (n_wires == 2)
    if case == "re330_stitched":  # a map that was stopped takes what is there
        monkeypatch.setattr(map_of_stability, "find", None)
        again = make_map(read_draft(case, (), True), MPI.COMM_SELF, grid, kept=KeptRows(tmp_path))
        assert again.limits == found.limits
