"""A link, an effect with laws, a verb and a study, each added in one place, as CONTRIBUTING says.

A channel is added in `test_one_more_channel`, unknowns and a load in `test_lateral_effect`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pytest
from measuring import march, registered
from scenes import load_scene
from small_lines import HANGING, en50318_line, mesh_of, problem_of, train
from verb_runner import invoke

from catenary import InputError
from catenary.cases.cli.app import app, serial_verb, verb
from catenary.cases.cli.command_words import Force, RunWords, SceneWords
from catenary.cases.terminal import console
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.wires import Profile
from catenary.postproc.report.study_table import Column, StudyTable
from catenary.solver.effects.build_model import build
from catenary.solver.effects.effect import Effect, Limit, register, unregister
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.link_directions import between_nodes
from catenary.solver.model.links import law
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.problem.problem import Problem, Simulated
from catenary.solver.statics.form_finding import find_form

STIFFNESS = 1.5e4  # [N/m]
NAME = "spare_link"
RISE = 0.03  # [m]


def _link(builder: ModelBuilder) -> None:
    wires = builder.mesh.wires
    pair = np.array([[wires[MESSENGER_WIRE][3], wires[CONTACT_WIRE][3]]])
    place = builder.mesh.x(pair[:, 1])
    builder.add_links("droppers", between_nodes(builder.model, pair), law(place, STIFFNESS))


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


def test_an_effect_sets_laws_of_the_time_loop() -> None:
    """Slack droppers that keep half of their stiffness, as two shipped effects have it."""

    def law(laws: Simulated, problem: Problem) -> Simulated:
        return replace(laws, slackening=True, kept_ratio=0.5)

    line = en50318_line(2)
    mesh = mesh_of(line, 2)
    heavy = train(70.0, 50.0, 56.0, static_force=500.0, raise_time=0.01)
    problem = problem_of(line, HANGING, train=heavy, residual_stiffness_ratio=0.5)
    shipped = HANGING | {"dropper_slackening", "residual_dropper_stiffness"}
    expected = march(replace(problem, effects=shipped), mesh)["dropper_force"]
    assert expected.min() < -1.0  # [N], so that something is slack
    with registered(Effect("elastic_slack", "slack droppers", "a law", "test", False, law=law)):
        new = replace(problem, effects=HANGING | {"elastic_slack"})
        assert np.array_equal(march(new, mesh)["dropper_force"], expected)


def test_an_effect_sets_target_heights_and_lifts_limits() -> None:
    """A contact wire that rises by RISE towards the middle of the line, for fast trains."""

    def rise(wanted: Profile, x: np.ndarray) -> np.ndarray:
        return np.asarray(RISE * np.sin(np.pi * x / wanted.sections[-1].ends[1]))

    def law(laws: Simulated, problem: Problem) -> Simulated:
        return replace(laws, target_heights=(*laws.target_heights, rise))

    line = en50318_line(2)
    mesh = mesh_of(line, 2)
    lower = mesh.droppers[:, 1]
    flat = find_form(problem_of(line, HANGING), mesh)[1].height[lower]
    fast = ["train.speed_km_h=450"]
    with pytest.raises(InputError, match="wave speed"):
        load_scene("en50318_2002", fast)
    lifts = (Limit.WAVE_SPEED,)
    with registered(Effect("hump", "a hump", "heights", "test", False, law=law, lifts=lifts)):
        model, form = find_form(problem_of(line, HANGING | {"hump"}), mesh)
        assert model.terms_of["hump"] == 2
        risen = rise(make_line(line).wire("contact_wire").profile, mesh.x(lower))
        # Rounding of heights of 5.5 m.
        assert form.height[lower] - flat == pytest.approx(risen, abs=1e-14)
        load_scene("en50318_2002", [*fast, "effects.hump=true"])


def test_an_effect_that_contributes_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="no unknowns, build, law or lifted limit"):
        register(Effect("idle", "nothing", "nothing", "test", False))


def test_a_verb_is_a_command_of_the_application() -> None:
    """Its docstring is its help, which names no parameter that is not there."""

    @verb("hello")
    def hello(name: str, loud: bool = False, most_N: float = 1.0) -> None:
        """A verb of a test.

        Example: catenary hello you

        Parameters
        ----------
        name WHO : Name of the one
            who is greeted.
        loud : Whether all hear it.
        most_N : Most of something.
        """
        console.say(f"hello {name} {loud} {most_N}")

    try:
        assert "hello A verb of a test." in " ".join(invoke("--help").stdout.split())
        assert invoke("hello", "you", "--loud", "--most-N", "2").stdout == "hello you True 2.0\n"
        told = " ".join(invoke("hello", "--help").stdout.split())
        assert "Name of the one who is greeted." in told and "hello [OPTIONS] {WHO}" in told
        assert "--loud Whether all hear it." in told and "Example: catenary hello you" in told
    finally:
        app.registered_commands.pop()
    assert "hello" not in invoke("--help").stdout
    hello.__doc__ = f"{hello.__doc__}quiet_one : Not there."
    with pytest.raises(ValueError, match="hello has no parameter quiet_one"):
        verb("hello")(hello)

    def unexplained(loud: bool = False, most_N: float = 1.0) -> None:
        """A verb with half of its help.

        Parameters
        ----------
        loud : Whether all hear it.
        """

    with pytest.raises(ValueError, match="unexplained has no help for most_N"):
        verb("unexplained")(unexplained)

    def bye(words: Misdescribed) -> None:
        """Another one."""

    with pytest.raises(ValueError, match="Misdescribed has no field loud"):
        verb("bye")(bye)


@dataclass
class Misdescribed:
    """Words of a verb.

    Parameters
    ----------
    name : Name of the one who is greeted.
    loud : Whether all hear it.
    """

    name: str


CASE, SPEED = "en50318_2002", "train.speed_km_h"


def test_a_study_is_a_verb_with_a_scene_and_a_table() -> None:
    """As CONTRIBUTING has it: options of the scene from one parameter, rows shown by a table."""

    @serial_verb("speeds")
    def speeds(words: SceneWords, force: Force = False) -> None:
        """Speeds of trains."""
        scene = words.load("numerics.dt_s=0.002")
        rows = [{"speed": scene.train.speed_km_h, "dt_s": scene.numerics.dt_s, "force": force}]
        columns = [Column("speed", "v [km/h]", ".1f"), Column("dt_s", "dt", "g"), Column("force")]
        console.say(StudyTable(columns, rows).text())

    @verb("split")
    def split(words: RunWords) -> None:
        """Options for PETSc."""
        console.say(f"{words.case} {words.split()} {words.shortened}")

    def said(*words: str) -> list[str]:
        return [line.split() for line in invoke(*words).stdout.splitlines()]

    try:
        told = said("speeds", CASE, f"{SPEED}=210", "--set", f"{SPEED}=200", "--force")
        assert told == [["v", "[km/h]", "dt"], ["210.0", "0.002"]]
        petsc = invoke("speeds", CASE, "--", "-log_view")
        assert petsc.exit_code == 2 and "this verb takes none" in petsc.stderr
        without = invoke("speeds")
        assert without.exit_code == 2 and "Missing argument" in without.stderr
        (both,) = invoke(
            "split", "x", "--short", "--set", "a.b=1", "c=2", "--", "-log_view"
        ).stdout.splitlines()
        assert both == "x (['a.b=1', 'c=2'], ['-log_view']) True"
    finally:
        del app.registered_commands[-2:]
