"""How large a scene's mesh will be, counted from its tables before anything is made of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

from catenary.cases.scene.convert.line import span_lengths
from catenary.cases.scene.cost_model import estimate_memory, estimate_start
from catenary.cases.scene.input.faults import Fault
from catenary.meshgen.line import Role
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.solver.effects import all_effects as effects

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene
    from catenary.cases.scene.tables.line import DropperTable

# 20 000 spans of ten gaps with ten elements each; their run takes 27 GB.
MOST_NODES = 4_000_000
# From here on a mesh takes longer than one waits without a word.
MANY_NODES = 50_000


class _Wire(NamedTuple):
    name: str
    role: Role


_WIRES = (_Wire(CONTACT_WIRE, Role.CONTACT), _Wire(MESSENGER_WIRE, Role.MESSENGER))


class Size(NamedTuple):
    """Number of spans, droppers, nodes of both wires, and unknowns of a line."""

    spans: int
    droppers: int
    nodes: int
    unknowns: int

    def sentence(self) -> str:
        """What it is and what it takes, in one sentence."""
        memory, start = estimate_memory(self.unknowns), estimate_start(self.nodes)
        return (
            f"{self.spans} spans and {self.droppers} droppers make {self.nodes} nodes and "
            f"{self.unknowns} unknowns: its start takes about {start:.0f} s and a "
            f"run about {memory / 1e9:.1f} GB of memory on one rank"
        )


def size_of(scene: Scene) -> Size | None:
    """The size of the mesh that a scene's line will have; None if it brings its own."""
    if scene.mesh.file is not None:
        return None
    per_gap, refined = scene.mesh.elements_per_gap, scene.mesh.support_refinement
    nodes_of_a_wire, droppers = 1, 0
    for length, spans in Counter(span_lengths(scene.line)).items():
        hanging = _droppers_in(scene.line.dropper, length)
        # The gaps at both masts are refined; without droppers they are one.
        gaps = 2 * refined + hanging - 1 if hanging else refined
        nodes_of_a_wire += spans * per_gap * gaps
        droppers += spans * hanging
    switches = scene.switches()
    chosen = (effect for name, effect in effects.registry().items() if switches[name])
    nodes = 2 * nodes_of_a_wire
    groups = effects.unknown_groups(chosen, _WIRES)
    unknowns = nodes_of_a_wire * sum(len(own) for group in groups for own in group.values())
    return Size(scene.line.n_spans, droppers, nodes, unknowns)


def _droppers_in(table: DropperTable | None, span: float) -> int:
    """Droppers of a span of that length [m]; none if the table has no such pattern."""
    if table is None:
        return 0
    if table.positions_m is not None:
        return len(table.positions_m)
    for pattern in table.patterns or []:
        if abs(pattern.span_m - span) < 1e-6:
            return len(pattern.positions_m)
    return table.count or 0


def size_faults(scene: Scene) -> Iterator[Fault]:
    """A fault if the mesh has more than ``MOST_NODES``."""
    size = size_of(scene)
    if size is not None and size.nodes > MOST_NODES:
        key = "line.n_spans"
        yield Fault(
            key,
            f"{key} is {size.spans} {scene.origin.of(key)}; {size.sentence()}; at most "
            f"{MOST_NODES} nodes are allowed: take fewer spans, or a smaller mesh.elements_per_gap "
            f"({scene.mesh.elements_per_gap}) or mesh.support_refinement "
            f"({scene.mesh.support_refinement})",
        )
