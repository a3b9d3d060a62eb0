"""Why a staggered line answers a fast train more calmly than the vertical one.

Its wires carry energy off sideways.
The README of ac_simple_3d explains the difference by the lateral inertia and damping of the wires,
which no key of a scene has. An effect of the test's own changes them.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
import pytest
from measuring import march, registered
from scenes import load_scene, mesh_of, problem_of, shipped

from catenary.postproc.evaluate.statistics import contact_statistics
from catenary.solver.effects.effect import Effect
from catenary.solver.effects.shipped import motion_effects
from catenary.solver.model import switching_links
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.link_directions import sideways_of_droppers
from catenary.solver.model.links import Direction
from catenary.solver.model.model import Block, Model

README = (shipped()["ac_simple_3d"].parent / "README.md").read_text(encoding="utf-8")
NAME = "changed_lateral_wires"
SCENE = ("train.speed_km_h=320", "mesh.elements_per_gap=3")


class Row(NamedTuple):
    """A row of the README's table, or a line of its text.

    Attributes
    ----------
    title : how it begins
    words : of the scene
    inertia : factor of the wires' lateral mass
    damping : of the lateral motion of the wires, beside the line's [1/s]
    dampers : at the steady arms, against vertical motion [N s/m]
    pendulums : whether droppers hold the wires by N / l, their force at rest over their length
    """

    title: str
    words: tuple[str, ...] = ()
    inertia: float = 1.0
    damping: float = 0.0
    dampers: float = 0.0
    pendulums: bool = True


VERTICAL = ("effects.lateral_motion=false",)
LEVEL = ("line.steady_arm.inclination_deg=0",)
ABOVE = ("line.messenger_stagger_m=0.2",)
ROWS = (
    Row("vertical", VERTICAL),
    Row("vertical, arms of 470 N/m", (*VERTICAL, "line.steady_arm.stiffness_N_per_m=470")),
    Row("3-D, level arms, messenger wire above the contact wire", (*LEVEL, *ABOVE)),
    Row("... wires without lateral inertia", ABOVE, inertia=1e-9),
    Row("... lateral damping of the wires 30 1/s", ABOVE, damping=30.0),
    Row("... 10 1/s", ABOVE, damping=10.0),
    Row("... 3 1/s", ABOVE, damping=3.0),
    Row("... that of the line, 0.0125 1/s", ABOVE),
    Row("... and arms without mass", (*ABOVE, "line.steady_arm.mass_kg_per_m=0")),
    Row("level arms, leaning droppers", LEVEL),
    Row("... lateral damping of the wires 10 1/s", LEVEL, damping=10.0),
    Row("inclined arms, leaning droppers: this case"),
    Row("... lateral damping of the wires 10 1/s", damping=10.0),
    Row("... wires without lateral inertia", inertia=1e-9),
    Row("... droppers without N / l across them", pendulums=False),
    Row("... six elements a gap", ("mesh.elements_per_gap=6",)),
)


# Figures of the text below the table: standard deviations [N].
IN_WORDS = (
    (Row("a hundredth", ABOVE, inertia=0.01), "62.3"),
    (Row("a tenth", ABOVE, inertia=0.1), "62.5"),
    (
        Row("dampers", (*VERTICAL, "line.steady_arm.stiffness_N_per_m=322"), dampers=10.7),
        "56.4",
    ),
)


def change(builder: ModelBuilder, row: Row) -> None:
    """Give wires the lateral mass and damping, and arms the dampers, of a row."""
    model = builder.model
    wires = model.mesh.wires
    if row.dampers:
        dofs = model.dofs(model.mesh.steady_arms)[:, None].astype(np.int32)
        kind = np.zeros(len(dofs), dtype=np.int32)
        builder.add_block(
            Block("steady_arms", dofs, kind, None, None, np.full((1, 1, 1), row.dampers))
        )
    if (row.inertia, row.damping) == (1.0, 0.0):
        return
    sideways = np.zeros(model.n_dofs, dtype=bool)
    for nodes in wires.values():
        sideways[model.dofs(nodes, "v")] = True
    changed = 0
    for number, block in enumerate(model.blocks):
        is_wire = block.component in wires and block.dofs.shape[1] == 4
        if is_wire and sideways[block.dofs[0, 0]]:
            changed += 1
            # Blocks of wires are taken over from the model before, in which they are changed.
            if block.damping is None:
                assert block.mass is not None
                mass, damping = row.inertia * block.mass, row.damping * block.mass
                model.blocks[number] = replace(block, mass=mass, damping=damping)
    assert changed == len(wires)


def without_pull(model: Model) -> tuple[Direction, np.ndarray]:
    """Directions across droppers, and nothing that they do there."""
    direction, pull = sideways_of_droppers(model)
    return direction, np.zeros_like(pull)


def measured(row: Row) -> tuple[float, float, float, float]:
    """Standard deviation, its parts below and above 5 Hz [N] and largest uplift [mm]."""
    scene = load_scene("ac_simple_3d", [*SCENE, *row.words])
    problem, mesh = problem_of(scene), mesh_of(scene)
    effect = Effect(
        NAME,
        "what no key of a scene has",
        "other masses and dampers",
        "test",
        default=False,
        build=partial(change, row=row),
    )
    with registered(effect), pytest.MonkeyPatch.context() as patch:
        if not row.pendulums:
            patch.setattr(motion_effects, "sideways_of_droppers", without_pull)
            patch.setattr(switching_links, "swings_of_droppers", lambda model: [])
        if row._replace(title="", words=()) != Row(""):
            problem = replace(problem, effects=problem.effects | {NAME})
        history = march(problem, mesh)
    of_force = contact_statistics(
        "pantograph",
        history["contact_position"][:, 0],
        history["contact_force"][:, 0],
        history["wire_height"][:, 0],
        problem.numerics.dt,
        problem.evaluation,
    )
    arms = mesh.x(mesh.steady_arms)
    evaluated = (arms >= problem.evaluation[0]) & (arms <= problem.evaluation[1])
    uplift = 1e3 * float(history["arm_uplift"][:, evaluated].max())
    return of_force.std, of_force.std_0_5, of_force.std_5_20, uplift


def check_printed(found: float, printed: str) -> None:
    """That a number is one that was printed: half a unit of its last digit, and a tenth of that
    for the switches of droppers on another machine, whose round-off is another."""
    half = 0.5 * 10.0 ** -len(printed.partition(".")[2])
    assert abs(found - float(printed)) <= 1.1 * half, (found, printed)


@pytest.mark.study
def test_the_table_of_what_lateral_motion_takes_is_what_marches_give() -> None:
    table = README[README.index("| line | sigma [N] |") :].partition("\n\n")[0]
    lines = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()[2:]
    ]
    rows = [line for line in lines if line[1]]
    assert [line[0] for line in rows] == [row.title for row in ROWS]
    for (_, *printed), row in zip(rows, ROWS, strict=True):
        found = measured(row)
        print(f"{row.title:60}", *(f"{value:6.2f}" for value in found))
        for value, cell in zip(found, printed, strict=True):
            check_printed(value, cell)


@pytest.mark.study
@pytest.mark.parametrize(("row", "printed"), IN_WORDS, ids=["hundredth", "tenth", "dampers"])
def test_parts_of_the_difference_are_what_the_text_says(row: Row, printed: str) -> None:
    assert re.search(rf"\b{re.escape(printed)}\b", README)
    check_printed(measured(row)[0], printed)
