"""All that steps a line and its train with steps of one size, made from a problem.

Schemes are entries of ``SCHEMES``; all but the usual one are imported where they are wanted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.contact.forces_on_line import (
    FollowedLinks,
    ForceColumns,
    ForcesOnLine,
    no_links,
)
from catenary.solver.contact.pantographs import Pantographs
from catenary.solver.contact_problem.coupling import make_coupling
from catenary.solver.contact_problem.law_tangents import law_in_steps
from catenary.solver.integrators.line_integrator import LineIntegrator, make_line
from catenary.solver.model.model import Model
from catenary.solver.model.partition import Ownership
from catenary.solver.model.switching_links import switching_links
from catenary.solver.problem.contact_laws import uses_rate
from catenary.solver.problem.problem import Problem
from catenary.solver.schemes.scheme import OneSolve, Scheme
from catenary.solver.statics.after_incidents import ChangedLine
from catenary.solver.window.choice import opens_window
from catenary.solver.window.moving_window import MovingWindow, wanted_pieces


@dataclass(frozen=True)
class Parts:
    """Line, what acts on it, train, and the scheme that steps them. ``destroy`` is collective."""

    line: LineIntegrator
    interaction: ForcesOnLine
    pantographs: Pantographs
    scheme: Scheme

    def destroy(self) -> None:
        """Free all PETSc objects. Collective."""
        self.scheme.destroy()
        self.line.destroy()


def make_parts(
    comm: Any,
    ownership: Ownership,
    problem: Problem,
    changed: ChangedLine,
    pantographs: Pantographs,
    wires: ContactWires | None = None,
) -> Parts:
    """The parts for the problem's numerics, of a line at rest. Collective.

    ``pantographs`` are those of the problem, made for the same numerics; ``wires`` those of the
    line that no other parts have, made here if None.
    """
    model, form = changed.model, changed.form
    numerics, train = problem.numerics, problem.train
    in_parts = numerics.scheme != "one_solve" or numerics.coupling == "explicit"
    wanted = wanted_pieces(problem, model, pantographs.candidates.place)
    if comm.size > 1 or pantographs.across.size:
        wanted = None
    line = make_line(comm, model, ownership, numerics, not in_parts, wanted)
    laws = model.simulated
    trailing = max(placement.behind for placement in train.placements)
    range_of_run = (
        train.start - trailing - pantographs.reach[0],
        train.end + pantographs.reach[1],
    )
    wires = wires or ContactWires(model, form, ownership)
    # Droppers may have another tension in the first rest than they had then.
    links = FollowedLinks(switching_links(model, form.dropper_force), line)
    columns = ForceColumns(comm, model, wires, line, links, range_of_run)
    interaction = ForcesOnLine(
        comm,
        model,
        form,
        wires,
        line,
        links,
        columns,
        pantographs.candidates,
        train.speed,
        uses_rate(laws.contact),
        pantographs.across,
        pantographs.work,
    )
    if opens_window(problem, comm.size, line.passes is not None):
        assert line.passes is not None
        window = MovingWindow(
            problem.window,
            numerics.dt,
            model,
            line.passes.factors,
            pantographs.candidates.place,
            interaction.reach,
            links.links.unknowns,
            links.moving,
            line.passes.known,
            line.operators.in_pieces,
        )
        line.open_window(window)
    scheme = SCHEMES[numerics.scheme](comm, problem, changed, interaction, pantographs)
    return Parts(line, interaction, pantographs, scheme)


def one_solve(
    comm: Any,
    problem: Problem,
    model: Model,
    interaction: ForcesOnLine,
    pantographs: Pantographs,
) -> OneSolve:
    """The scheme ``one_solve``, with the coupling that the problem's numerics ask for. Collective.

    Parameters are those of ``make_parts`` and what it makes.
    """
    links = interaction.link_coupling
    coupled = no_links() if links is None else links.coupled
    law = law_in_steps(problem, model.simulated, pantographs.n_contacts)
    return OneSolve(comm, interaction, pantographs, make_coupling(law, coupled, problem.numerics))


def _fixed_point(
    comm: Any,
    problem: Problem,
    changed: ChangedLine,
    interaction: ForcesOnLine,
    pantographs: Pantographs,
) -> Scheme:
    from catenary.solver.schemes.fixed_point import FixedPoint

    law = law_in_steps(problem, changed.model.simulated, pantographs.n_contacts)
    return FixedPoint(comm, interaction, pantographs, problem.numerics, law)


# Makers of schemes by ``Numerics.scheme``.
SCHEMES: dict[str, Callable[[Any, Problem, ChangedLine, ForcesOnLine, Pantographs], Scheme]] = {
    "one_solve": lambda comm, problem, changed, *acting: one_solve(
        comm, problem, changed.model, *acting
    ),
    "fixed_point": _fixed_point,
}
