"""Cost model: time and memory of the start and of a run, from numbers of nodes, unknowns, steps."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

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
