"""Links with a force of their own at rest: form finding carries them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from measuring import check, registered
from small_lines import HANGING, en50318_line, mesh_of, problem_of

from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.solver.effects.effect import Effect
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.link_directions import at_nodes
from catenary.solver.model.links import law
from catenary.solver.statics.form_finding import find_form

PULL, PLACE = 80.0, 86.75


def pulled(builder: ModelBuilder) -> None:
    """A spring under the contact wire, midway between two droppers, which is strained at rest."""
    nodes = builder.mesh.wires[CONTACT_WIRE]
    node = nodes[np.abs(builder.mesh.x(nodes) - PLACE) < 1e-6]
    assert node.size == 1
    laws = law(builder.mesh.x(node), 500.0, rest=PULL)
    builder.add_links("springs", at_nodes(builder.model, node), laws)


SPRING = Effect("strained_spring", "spring", "spring", "test", False, build=pulled)


def test_a_strained_spring_hangs_on_the_droppers_beside_it() -> None:
    """Of a string whose droppers hold their heights each carries half of P more, and the wire
    between them sags by P a / 4 T more."""
    line = en50318_line(3)
    line = replace(line, contact_wire=replace(line.contact_wire, bending_stiffness=0.0))
    mesh, tension = mesh_of(line, 4), line.contact_wire.tension
    _, without = find_form(problem_of(line, HANGING), mesh)
    with registered(SPRING):
        _, form = find_form(problem_of(line, HANGING | {SPRING.name}), mesh)
    x = mesh.x(mesh.droppers[:, 1])
    beside = np.abs(x - PLACE) < 4.0
    assert np.count_nonzero(beside) == 2
    more = form.dropper_force - without.dropper_force
    # Elements have continuous slopes, which round the kinks at the spring and at the droppers.
    check("dropper forces [N]", more, 0.5 * PULL * beside, within=0.1 * PULL)
    check("their sum [N]", more.sum(), PULL, within=1e-6 * PULL)
    nodes = mesh.wires[CONTACT_WIRE]
    node = nodes[np.abs(mesh.x(nodes) - PLACE) < 1e-6][0]
    gap = float(np.ptp(x[beside]))
    sag = without.height[node] - form.height[node]
    check("sag [m]", sag, PULL * gap / (4 * tension), within=0.2 * PULL * gap / (4 * tension))
    lower = mesh.droppers[:, 1]
    check("wanted heights [m]", form.height[lower], without.height[lower], within=1e-12)
