"""Size of a scene's mesh, counted from its tables before anything is made of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.scene.checks.effects import RELATIVE_MOTION
from catenary.cases.scene.checks.free import free_counts
from catenary.cases.scene.cost_model import estimate_memory, estimate_start
from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.line.free import FreeDroppersTable
from catenary.cases.scene.line.line import LineTable
from catenary.cases.scene.line.line_data import free_wires, overlaps_of, span_lengths
from catenary.cases.scene.problem import line_of
from catenary.cases.scene.scene import Scene
from catenary.meshgen.geometry import divisions_of, find_cuts
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.effect import NamedWire

# 20 000 spans of ten gaps with ten elements each; their run takes some 7 GB.
MOST_NODES = 4_000_000
# Each has two nodes at least.
MOST_DROPPERS = MOST_NODES // 2
# From here on a mesh takes longer than one waits without a word.
MANY_NODES = 50_000


class Size(NamedTuple):
    """Size of a line: numbers of spans, droppers, nodes of wires, unknowns, and different spans.

    ``by_pieces`` is whether matrices are made for the spans near a window alone.
    """

    spans: int
    droppers: int
    nodes: int
    unknowns: int
    kinds: int
    by_pieces: bool = False

    def sentence(self) -> str:
        """Size, time of the start and memory in one sentence."""
        memory = estimate_memory(self.unknowns, by_pieces=self.by_pieces)
        start = estimate_start(self.nodes, 0.0 if self.by_pieces else self.kinds / self.spans)
        return (
            f"{self.spans} spans and {self.droppers} droppers make {self.nodes} nodes and "
            f"{self.unknowns} unknowns: its start takes about {start:.0f} s and a "
            f"run about {memory / 1e9:.1f} GB of memory on one rank"
        )


def size_of(scene: Scene) -> Size | None:
    """The size of the mesh that a scene's line will have; None if it brings its own, or if its line
    cannot be made, which other checks report. Its wires are cut, and not divided."""
    if scene.mesh.file is not None:
        return None
    if scene.line.wires is not None:
        return _of_free_line(scene)
    overlaps = overlaps_of(scene.line)
    if overlaps is not None and max(overlaps.first) + overlaps.n_spans >= scene.line.n_spans:
        return None
    try:
        if droppers_of(scene) > MOST_DROPPERS:
            return None
        line = line_of(scene)
        cuts = find_cuts(line)
    except InputError:
        return None
    gaps = divisions_of(cuts, scene.mesh.elements_per_gap, scene.mesh.support_refinement)
    before = np.concatenate([[0], np.cumsum(gaps)])
    nodes = dict.fromkeys((wire.name for wire in line.wires), 0)
    for piece in cuts.pieces:
        last = piece.first + len(piece.points) - 1
        nodes[piece.wire] += int(before[last] - before[piece.first]) + 1
    together = () if scene.switches()[RELATIVE_MOTION] else {one for one, _ in line.twins}
    own = [wire for wire in line.wires if wire.name not in together]
    return _size(scene, line.dropper_x.size, nodes, own)


def _of_free_line(scene: Scene) -> Size | None:
    """The size of a line whose wires are listed, counted without making it."""
    try:
        n_droppers, nodes = free_counts(scene)
        listed = free_wires(scene.line, span_lengths(scene.line)) or ()
    except InputError:
        return None
    return _size(scene, n_droppers, nodes, listed)


def _size(scene: Scene, n_droppers: int, nodes: dict[str, int], wires: Sequence[NamedWire]) -> Size:
    """The size of a line with nodes of wires by name, of which ``wires`` have unknowns."""
    switches = scene.switches()
    chosen = (effect for name, effect in effects.registry().items() if switches[name])
    groups = effects.unknown_groups(chosen, wires)
    unknowns = sum(nodes[wire] * len(own) for group in groups for wire, own in group.items())
    n_spans, irregular = scene.line.n_spans, scene.irregularities
    kinds = max(len(set(span_lengths(scene.line))), kinds_by_number(scene.line))
    if irregular.contact_wire_height is not None or irregular.dropper_lengths is not None:
        kinds = n_spans
    by_pieces = scene.window.mode == "bounded" and scene.window.tolerance is None
    return Size(n_spans, n_droppers, sum(nodes.values()), unknowns, kinds, by_pieces)


def kinds_by_number(table: LineTable) -> int:
    """Number of kinds of spans by the numbers of a line's spans, 0 if lengths tell them."""
    hung = [table.dropper, table.auxiliary_wire and table.auxiliary_wire.dropper]
    hung += [link for link in table.links or () if isinstance(link, FreeDroppersTable)]
    patterns = [pattern for own in hung if own for pattern in own.patterns or ()]
    return len(patterns) if any(pattern.spans for pattern in patterns) else 0


def droppers_of(scene: Scene) -> int:
    """Number of droppers of a scene's line, whose wires are not made.

    Raises
    ------
    InputError
        If they are not declared for one of the span lengths.
    """
    data = scene.line_data
    auxiliary = () if data.auxiliary_wire is None else data.auxiliary_wire.dropper_positions
    return sum(map(len, (*data.dropper_positions, *auxiliary)))


def size_faults(scene: Scene) -> Iterator[Fault]:
    """A fault if there are more than ``MOST_DROPPERS``, or if the mesh has more than
    ``MOST_NODES``."""
    size = size_of(scene)
    with suppress(InputError):  # which other checks report
        if size is None and (n := droppers_of(scene)) > MOST_DROPPERS:
            why = f"its spans have {n} droppers, and at most {MOST_DROPPERS} are allowed"
            yield scene.refused("line.n_spans", why)
    if size is not None and size.nodes > MOST_NODES:
        key = "line.n_spans"
        yield Fault(
            key,
            f"{key} is {size.spans} {scene.origin.of(key)}; {size.sentence()}; at most "
            f"{MOST_NODES} nodes are allowed: take fewer spans, or a smaller mesh.elements_per_gap "
            f"({scene.mesh.elements_per_gap}) or mesh.support_refinement "
            f"({scene.mesh.support_refinement})",
        )
