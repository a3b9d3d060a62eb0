"""The tension of snapshots where wires move along the track, against the bar's own strain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from axial_lines import ALONG, elastic_line
from measuring import check
from small_lines import mesh_of, problem_of

from catenary.meshgen.line import Curve
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.meshgen.topologies.line_data import LineData
from catenary.postproc.record.snapshots.contents import (
    ALONG as U,
)
from catenary.postproc.record.snapshots.contents import (
    ASIDE,
    KINDS,
    SLOPE,
    TURN,
    UP,
    FieldRecord,
    RecordedLine,
    blocks_of,
    layout_of,
)
from catenary.postproc.record.snapshots.field_values import FieldValues, Gathered
from catenary.solver.effects.all_effects import with_defects
from catenary.solver.model.axial_motion import strain_rows, unknowns_along
from catenary.solver.problem.defects import WornWire
from catenary.solver.statics.form_finding import find_form


def staggered() -> LineData:
    """A line with arms in a curve of 500 m, whose cant grows and ends within spans."""
    line = elastic_line(2)
    return replace(
        line,
        steady_arm=replace(line.steady_arm, length=1.2),
        stagger=(0.2, -0.2, 0.2),
        curve=Curve(1 / 500, 0.05, (20.0, 100.0), 30.0),
    )


# A stretch that begins and ends within elements, and what it has lost.
WORN, LOST = (21.7, 50.9), 0.3


def shares_within(stretch: tuple[float, float], ends: np.ndarray) -> np.ndarray:
    """Share of each element, ``ends`` (n, 2) [m], that lies within a stretch."""
    inside = np.clip(ends, *stretch)
    return np.asarray(np.diff(inside, axis=1)[:, 0] / np.diff(ends, axis=1)[:, 0])


@pytest.mark.parametrize(
    ("line", "names", "effects"),
    [
        (elastic_line(2), (UP, SLOPE, U), ALONG),
        (staggered(), (UP, SLOPE, ASIDE, TURN, U), ALONG | {"lateral_motion"}),
        (elastic_line(2), (UP, SLOPE, U), ALONG | {"worn_wire"}),
    ],
    ids=["upright", "three planes", "worn"],
)
def test_a_snapshot_shows_what_the_stretch_adds(
    line: LineData, names: tuple[str, ...], effects: frozenset[str]
) -> None:
    mesh = mesh_of(line, 2)
    worn = WornWire(CONTACT_WIRE, *WORN, LOST)
    defects = (worn,) if "worn_wire" in effects else ()
    problem = with_defects(problem_of(line, effects, defects=defects))
    model, form = find_form(problem, mesh)
    rng = np.random.default_rng(4)
    motion = {(name, False): 1e-3 * rng.normal(size=(1, mesh.n_nodes)) for name in names}
    state = np.zeros(model.n_dofs)
    for (name, _), values in motion.items():
        state[model.dofs(np.arange(mesh.n_nodes), name)] = values[0]
    recorded = RecordedLine(problem.line, mesh, form.slope, form.lateral)
    points = mesh.points.copy()
    points[:, 2] = form.height
    values = FieldValues(recorded, points)
    tension = np.zeros(mesh.n_nodes)
    known = Gathered(motion, np.zeros((1, 0)), [tension], np.zeros((1, 0)))
    layout = layout_of(FieldRecord(), blocks_of(recorded, points), np.zeros(1))
    for slots in layout:
        block = slots.block
        if block.name not in (CONTACT_WIRE, MESSENGER_WIRE):
            continue
        wire = problem.line.wire(block.name)
        strain = (strain_rows(model, block.name) * state[unknowns_along(model, block.name)]).sum(1)
        assert wire.axial_stiffness is not None
        expected = wire.axial_stiffness * strain
        if defects and block.name == CONTACT_WIRE:
            expected *= 1.0 - LOST * shares_within(WORN, mesh.x(mesh.elements(block.name)))
        found = values.of(KINDS["tension"], slots, 0, known)
        # Numbers of 4 bytes, and slopes rounded to 1e-10.
        scale = np.abs(expected).max()
        check(block.name, found, np.append(expected, expected[-1]), within=1e-6 * scale)


def test_a_line_without_that_motion_sends_none_for_its_tension() -> None:
    kind = KINDS["tension"]
    assert kind.motions_of(("w", "theta_y")) == []
    assert len(kind.motions_of(("w", "theta_y", "u"))) == 3
    assert len(kind.motions_of(("w", "theta_y", "v", "theta_z", "u"))) == 5
