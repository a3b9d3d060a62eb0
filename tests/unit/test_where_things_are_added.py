"""A link and a verb, each added in one place, as CONTRIBUTING says.

A channel is added in `test_one_more_channel`, unknowns and a load in `test_lateral_effect`.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from small_lines import HANGING, en50318_line, mesh_of, problem_of
from typer.testing import CliRunner

from catenary.cases.cli.app import app
from catenary.cases.terminal import console
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.solver.effects.build_model import build
from catenary.solver.effects.effect import Effect, register, unregister
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.matrices import whole_matrix

STIFFNESS = 1.5e4  # [N/m]
NAME = "spare_link"


def _link(builder: ModelBuilder) -> None:
    wires = builder.mesh.wires
    pair = np.array([[wires[MESSENGER_WIRE][3], wires[CONTACT_WIRE][3]]])
    builder.add_links("droppers", pair, "w", np.array([STIFFNESS]))


@pytest.fixture
def link() -> Iterator[None]:
    register(Effect(NAME, "a link between the wires", "one spring", "test", False, build=_link))
    yield
    unregister(NAME)


@pytest.mark.usefixtures("link")
def test_a_link_is_an_effect() -> None:
    line = en50318_line(2)
    mesh = mesh_of(line, 2)
    lengths = np.ones(mesh.droppers.shape[0])
    without = build(problem_of(line, HANGING), mesh, lengths)
    linked = build(problem_of(line, HANGING | {NAME}), mesh, lengths)
    assert linked.terms_of[NAME] == 1
    added = whole_matrix(linked, stiffness=1.0) - whole_matrix(without, stiffness=1.0)
    pair = linked.dofs(np.array([mesh.wires[w][3] for w in (MESSENGER_WIRE, CONTACT_WIRE)]))
    spring = STIFFNESS * np.array([[1.0, -1.0], [-1.0, 1.0]])
    # One rounding of a sum with what the wires have there, of 1e4 to 1e7 N/m.
    assert added[np.ix_(pair, pair)].toarray() == pytest.approx(spring, abs=1e-8)
    assert abs(added).sum() == pytest.approx(4 * STIFFNESS, abs=1e-8)


def test_a_verb_is_a_command_of_the_application() -> None:
    @app.command("hello", help="A verb of a test.")
    def hello() -> None:
        console.say("a verb")

    try:
        assert "hello" in CliRunner().invoke(app, ["--help"]).stdout
        assert CliRunner().invoke(app, ["hello"]).stdout == "a verb\n"
    finally:
        app.registered_commands.pop()
    assert "hello" not in CliRunner().invoke(app, ["--help"]).stdout
