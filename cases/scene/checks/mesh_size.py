"""Size of a scene's mesh, counted from its tables, and time and memory of a run of that size.

The size is counted before anything is made of the tables. The cost model takes time and memory of
the start and of a run from numbers of nodes, unknowns and steps.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from catenary.cases.scene.checks.effects import RELATIVE_MOTION
from catenary.cases.scene.input.faults import Fault
from catenary.cases.scene.line.line import LineTable
from catenary.cases.scene.line.wires import FreeDroppersTable
from catenary.cases.scene.scene import Scene
from catenary.meshgen.geometry import divisions_of
from catenary.meshgen.topologies.all_topologies import listed
from catenary.meshgen.topologies.free import cuts_of
from catenary.meshgen.topologies.line_data import FreeDroppers
from catenary.solver.effects import all_effects as effects

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
    """The size of the mesh that a scene's line will have; None if it brings its own.

    Its wires and links must fit together; they are cut, and not divided.
    """
    if scene.mesh.file is not None:
        return None
    line = listed(scene.line_data)
    assert line.wires is not None
    cuts = cuts_of(line)
    gaps = divisions_of(cuts, scene.mesh.elements_per_gap, scene.mesh.support_refinement)
    before = np.concatenate([[0], np.cumsum(gaps)])
    stretches = {wire.name: cuts.of(np.array(wire.stretches)) for wire in line.wires}
    nodes = {name: int((np.diff(before[at]) + 1).sum()) for name, at in stretches.items()}
    switches = scene.switches()
    together = () if switches[RELATIVE_MOTION] else {one for one, _ in line.twins}
    moving = [wire for wire in line.wires if wire.name not in together]
    chosen = (effect for name, effect in effects.registry().items() if switches[name])
    groups = effects.unknown_groups(chosen, moving)
    unknowns = sum(nodes[wire] * len(own) for group in groups for wire, own in group.items())
    n_spans, irregular = scene.line.n_spans, scene.irregularities
    kinds = max(len(set(line.span_lengths)), kinds_by_number(scene.line))
    if irregular.contact_wire_height is not None or irregular.dropper_lengths is not None:
        kinds = n_spans
    by_pieces = scene.window.mode == "bounded" and scene.window.tolerance is None
    droppers = sum(len(link.lower_x) for link in line.links or () if isinstance(link, FreeDroppers))
    return Size(n_spans, droppers, sum(nodes.values()), unknowns, kinds, by_pieces)


def kinds_by_number(table: LineTable) -> int:
    """Number of kinds of spans by the numbers of a line's spans, 0 if lengths tell them."""
    hung = [table.dropper, table.auxiliary_wire and table.auxiliary_wire.dropper]
    hung += [link for link in table.links or () if isinstance(link, FreeDroppersTable)]
    patterns = [pattern for own in hung if own for pattern in own.patterns or ()]
    return len(patterns) if any(pattern.spans for pattern in patterns) else 0


def size_faults(scene: Scene) -> Iterator[Fault]:
    """A fault if there are more than ``MOST_DROPPERS``, or if the mesh has more than
    ``MOST_NODES``."""
    data = scene.line_data
    above = () if data.auxiliary_wire is None else data.auxiliary_wire.dropper_positions
    n = sum(map(len, (*data.dropper_positions, *above)))
    if n > MOST_DROPPERS:
        why = f"its spans have {n} droppers, and at most {MOST_DROPPERS} are allowed"
        yield scene.refused("line.n_spans", why)
        return
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


# Cost model of the march on one rank, records included: overhead of a step, and time per unknown.
# Marches of the case ambrosio2012 on 25, 100 and 1000 spans, 4.5e3 to 1.8e5 unknowns, on a two-core
# machine of 2026 (Debian 12, PETSc 3.18) lie within 40 % of it, and machines differ by a factor of
# two; the plan calls it an estimate.
STEP_OVERHEAD = 1.4e-5  # [s]
STEP_PER_UNKNOWN = 2.6e-9  # [s]
# Time of a station by its unknowns, in terms of four; as in the benchmark of widths. Effects that
# add planes join them to the others, as arms and the slope of wires at rest do. Those of ten are
# wires that stretch, in three planes: no two of their stations are alike, and answers are long.
STATION_COST = {2: 0.6, 4: 1.0, 6: 1.8, 8: 2.2, 10: 13.0, 12: 5.6, 16: 8.0}
# Factor on the time of stations of several types over that of as many of one.
SEVERAL_TYPES = 1.25
# Gusts on wires [s an unknown], measured with the case windy_viaduct.
GUSTS_PER_UNKNOWN = 4e-9
# The fixed-point scheme repeats the solve: 240 us were measured with the same case.
SCHEME_FACTOR = {"one_solve": 1.0, "fixed_point": 9.0}
# A substep of a pantograph with all its bodies: 0.21 to 0.38 ms were measured with the paper's
# seven, by the way of keeping joints.
ALL_BODIES_SUBSTEP = 3.0e-4  # [s]
# Processor time from the scene to the first step, measured with 9e5 nodes of like spans and 9e4 of
# 1000 spans of which no two are alike: matrices and factors are made once for each kind of span.
START_PER_NODE = 6.0e-6  # [s]
START_PER_OWN_NODE = 5.0e-5  # [s]
# Resident memory of runs of ambrosio2012 on 25, 1000 and 2000 like spans and on 500 of which no two
# are alike, report included, within 11 %: program and libraries, then per unknown.
MEMORY_BASE = 3.6e8  # [B]
MEMORY_PER_UNKNOWN = 800.0  # [B]
# The same where a window of spans moves with the train, of 10 000 spans: matrices and factors are
# made near the train alone, and the line makes room for the report.
MEMORY_PER_UNKNOWN_AT_REST = 340.0  # [B]
# Each further rank holds mesh and model of the whole line: ranks 1 to 3 of four on 1000 and 5000
# spans of ambrosio2012, beyond the 141 MB that they take on a short line, had 244 and 232 B.
MEMORY_OF_RANK_PER_UNKNOWN = 250.0  # [B]
# Memory of a step, as the report takes the history of one pantograph after the other.
MEMORY_PER_STEP = 40.0  # [B]


def estimate_start(n_nodes: int, own: float = 0.0) -> float:
    """Processor time of mesh, line at rest, matrices and factors [s].

    ``own`` is the share of spans that are unlike all spans before them [-].
    """
    return (START_PER_NODE + START_PER_OWN_NODE * own) * n_nodes


def estimate_march(
    n_dofs: int,
    n_steps: int,
    scheme: str,
    n_substeps: int = 0,
    stations: Mapping[int, int] | None = None,
    gusts: bool = False,
) -> float:
    """Wall time of the time loop on one rank [s].

    Parameters
    ----------
    n_dofs, n_steps : number of unknowns of the line, and of steps
    scheme : name of the scheme
    n_substeps : substeps of all pantographs with all bodies, in a step
    stations : number of stations by their number of unknowns; all have four if not given
    gusts : whether wind changes with time
    """
    step = STEP_OVERHEAD + STEP_PER_UNKNOWN * n_dofs * cost_of_stations(stations or {4: 1})
    step = SCHEME_FACTOR[scheme] * step + gusts * GUSTS_PER_UNKNOWN * n_dofs
    return n_steps * (step + ALL_BODIES_SUBSTEP * n_substeps)


def cost_of_stations(stations: Mapping[int, int]) -> float:
    """Time per unknown over that of a line whose stations have four unknowns [-].

    ``stations`` has the number of stations by their number of unknowns.
    """
    sizes, counts = np.array(list(stations)), np.array(list(stations.values()))
    costs = np.interp(sizes, list(STATION_COST), list(STATION_COST.values()))
    several = SEVERAL_TYPES if sizes.size > 1 else 1.0
    return float(several * 4.0 * (counts @ costs) / (counts @ sizes))


def estimate_memory(n_dofs: int, n_steps: int = 0, by_pieces: bool = False) -> float:
    """Resident memory of a run on one rank, its report included [B].

    ``n_dofs`` and ``n_steps`` are numbers of unknowns and of steps, ``by_pieces`` whether matrices
    are made for the spans near a window alone.
    """
    each = MEMORY_PER_UNKNOWN_AT_REST if by_pieces else MEMORY_PER_UNKNOWN
    return MEMORY_BASE + each * n_dofs + MEMORY_PER_STEP * n_steps
