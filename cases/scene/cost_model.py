"""Cost model: time and memory of the start and of a run, from numbers of nodes, unknowns, steps."""

from __future__ import annotations

import numpy as np

# Cost model of the march on one rank, records included: overhead of a step, and time per unknown.
# Marches of the case ambrosio2012 on 25, 100 and 1000 spans, 4.5e3 to 1.8e5 unknowns, on a two-core
# machine of 2026 (Debian 12, PETSc 3.18) lie within 40 % of it, and machines differ by a factor of
# two; the plan calls it an estimate.
STEP_OVERHEAD = 1.4e-5  # [s]
STEP_PER_UNKNOWN = 2.6e-9  # [s]
# Time of a station by its unknowns in a plane, in terms of four; as in the benchmark of widths.
STATION_COST = {2: 0.6, 4: 1.0, 6: 1.8, 8: 2.2, 10: 4.8, 12: 5.6, 16: 8.0}
# The fixed-point scheme repeats the solve, and PETSc's TSALPHA2 factors anew in every iteration:
# 240 and 1800 us were measured with the same case.
SCHEME_FACTOR = {"one_solve": 1.0, "fixed_point": 9.0, "ts_alpha2": 70.0}
# A substep of a pantograph with all its bodies: 0.21 to 0.38 ms were measured with the paper's
# seven, by the way of keeping joints.
ALL_BODIES_SUBSTEP = 3.0e-4  # [s]
# Processor time from the scene to the first step, measured with 9e5 nodes on a two-core machine.
START_PER_NODE = 2.8e-5  # [s]
# Resident memory of runs of ambrosio2012 on 25, 300, 1000 and 2000 spans, report included, within
# 10 %: program and libraries, then per unknown.
MEMORY_BASE = 3.85e8  # [B]
MEMORY_PER_UNKNOWN = 2200.0  # [B]
# What a step adds, as the report takes the history of one pantograph after the other.
MEMORY_PER_STEP = 40.0  # [B]


def estimate_start(n_nodes: int) -> float:
    """Processor time of mesh, line at rest and what steps it [s]."""
    return START_PER_NODE * n_nodes


def estimate_march(
    n_dofs: int,
    n_steps: int,
    scheme: str,
    n_substeps: int = 0,
    widths: tuple[int, ...] = (4,),
) -> float:
    """Wall time of the time loop on one rank [s].

    ``n_substeps`` are those of a step that pantographs with all their bodies take, all together;
    ``widths`` the unknowns of a station in each plane.
    """
    step = STEP_OVERHEAD + STEP_PER_UNKNOWN * n_dofs * cost_of_widths(widths)
    step *= SCHEME_FACTOR[scheme]
    return n_steps * (step + ALL_BODIES_SUBSTEP * n_substeps)


def cost_of_widths(widths: tuple[int, ...]) -> float:
    """Time per unknown of stations with planes of these widths, in terms of one plane of four."""
    station = sum(
        np.interp(width, list(STATION_COST), list(STATION_COST.values())) for width in widths
    )
    return float(station / sum(widths) * 4.0)


def estimate_memory(n_dofs: int, n_steps: int = 0) -> float:
    """Resident memory of a run on one rank, its report included [B]."""
    return MEMORY_BASE + MEMORY_PER_UNKNOWN * n_dofs + MEMORY_PER_STEP * n_steps
