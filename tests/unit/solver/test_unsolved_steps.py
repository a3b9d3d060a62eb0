"""Iterations of a step that do not get there: each ends the run in words, and none goes unnoticed.

Those of the couplings and the fixed-point correction stand in `test_march_endings`; joints in
`tests/unit/mbs/test_unsolved_joints.py`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_lines import WHOLE, en50318_line, mesh_of, problem_of

from catenary import InputError, RunBroken
from catenary.base.errors import NotConverged
from catenary.solver.contact.forces_on_line import no_links
from catenary.solver.contact.pantographs import Heads
from catenary.solver.contact_problem.coupling import Explicit, InnerProblem
from catenary.solver.contact_problem.force_exchange import LineResponse
from catenary.solver.contact_problem.law_tangents import HertzInSteps, KinematicInSteps, LawInSteps
from catenary.solver.problem.contact_laws import HertzLaw
from catenary.solver.statics.form_finding import find_form

LINE = en50318_line(2)


def pressed(
    law: LawInSteps, depth: float, by_force: float, rate_by_force: float = 0.0
) -> tuple[InnerProblem, LineResponse, Heads]:
    """A contact ``depth`` [m] deep without force, which takes ``by_force`` [m/N] off it."""
    line, heads = LineResponse(1, 0, early=True), Heads(1)
    line.line.place[:], line.line.by_force[:] = -depth, by_force
    line.line.rate_by_force[:] = rate_by_force
    return InnerProblem(law, no_links()), line, heads


def test_contacts_without_a_common_solution_are_told() -> None:
    """The convective part of a damper outweighs all else: (1 + k b + c b') f = k d < 0 has f < 0,
    and f = 0 asks for f > 0."""
    law = LawInSteps(1, 1e4, 100.0, pulls=False)
    inner, line, heads = pressed(law, 0.01, 1e-5, rate_by_force=-0.1)
    with pytest.raises(NotConverged, match=r"no common solution; take a smaller numerics\.dt_s"):
        inner.solve(line, heads)
    assert inner.pivoted


def test_a_force_that_is_no_number_is_told_in_its_own_step() -> None:
    """1 + k b + c b' is zero exactly: contact that cannot be lost would have a force of k d / 0."""
    law = LawInSteps(1, 2.0, 1.0, pulls=True)
    inner, line, heads = pressed(law, 0.01, 0.5, rate_by_force=-2.0)
    with pytest.raises(RunBroken, match="no finite solution; try a smaller"):
        inner.solve(line, heads)


def test_a_law_whose_tangents_never_agree_is_told() -> None:
    """Tangents of a spring that softens overshoot, to one side and to the other."""
    law = HertzInSteps(HertzLaw(1e3, 0.5, 0.0, 0.1), 1)
    inner, line, heads = pressed(law, 0.01, 1e-3)
    with pytest.raises(NotConverged, match=r"no force within 50 tangents; take a smaller"):
        inner.solve(line, heads)


def test_forces_that_grow_without_bounds_end_the_explicit_coupling() -> None:
    law = LawInSteps(1, 1e9, 0.0, pulls=False)
    inner, line, heads = pressed(law, 0.0, 1e-5)
    heads.early_height[:] = 1.1
    with pytest.raises(RunBroken, match=r'beyond all bounds.*take numerics\.coupling = "implicit"'):
        Explicit(inner).solve(line, heads)


def test_a_kinematic_contact_that_would_pull_is_told() -> None:
    law, zero = KinematicInSteps(2, 1e-3, 0.55, from_time=0.5), np.zeros(2)
    law.accept(0.4, zero, zero, np.array([100.0, -50.0]))  # still being raised
    with pytest.raises(
        RunBroken, match=r"contact 2 would have to pull with 50 N.*take contact\.law"
    ):
        law.accept(0.6, zero, zero, np.array([100.0, -50.0]))


def test_a_line_whose_droppers_find_no_length_is_refused() -> None:
    """Droppers so heavy that each pass changes lengths nearly as much as the one before."""
    heavy = replace(LINE, encumbrance=3.0, dropper=replace(LINE.dropper, mass_per_length=16.0))
    problem = problem_of(heavy, WHOLE | {"dropper_mass"})
    with pytest.raises(InputError, match=r"do not settle: .*line\.dropper\.mass_kg_per_m smaller"):
        find_form(problem, mesh_of(heavy, 1))
