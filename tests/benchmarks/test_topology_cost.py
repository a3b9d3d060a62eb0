"""What lines of other topologies cost: whole marches beside those of like lines without, in turns.

Run by ``make bench``.
"""

from __future__ import annotations

import pytest
from mpi4py import MPI
from scenes import load_scene, mesh_of, problem_of

from catenary.cases.studies.effect_cost import RepeatedMarch, beside
from catenary.solver.statics.line_at_rest import line_at_rest

# Case, changes, what makes the line without it, and how much dearer it may be. A third wire all
# along makes stations of six unknowns of those of four: a pass reads 2.25 times the numbers of a
# block, and such stations take 2.5 times as long (``test_station_widths``). So do twin wires that
# move relative to each other: as planes of their sum and difference they would take twice as long.
# Twin wires that move as one have four, and add droppers and the second contact of a strip: columns
# are laid over the state for each. In an overlap only spans beside each other have eight unknowns,
# and a strip answers to the wires that are there. It is measured on the shipped line, which has
# four such spans of 30, as many of 24 as a tension section of 1.2 km has; the line for tests has
# four of 14. That of stitched wires, too, is the shipped one: shorter ones have no kernels for runs
# of stations of one type.
STITCHED, COMPOUND = "line.stitch_wire=", "line.auxiliary_wire="
SIMPLE = "line.topology=simple"
LINES: dict[str, tuple[str, list[str], list[str], float]] = {
    "stitched": ("re330_stitched", [], [SIMPLE, STITCHED], 2.6),
    "compound": ("shinkansen_compound", [], [SIMPLE, COMPOUND], 3.3),
    "twin": ("dc_twin", [], [SIMPLE, "line.twin="], 1.4),
    "twin, relative motion": (
        "dc_twin",
        ["effects.relative_motion=true"],
        [SIMPLE, "line.twin="],
        2.9,
    ),
    "overlap": ("overlap", [], ["line.overlap="], 1.4),
}
WHOLE = {"overlap", "re330_stitched"}
SHORT = ["numerics.dt_s=1e-3", "train.raise_time_s=0.1"]
ROUNDS = 8


def march_of(case: str, changes: list[str]) -> RepeatedMarch:
    """Over some hundred metres."""
    scene = load_scene(case, [*SHORT, *changes], shortened=case not in WHOLE)
    return RepeatedMarch(MPI.COMM_SELF, line_at_rest(problem_of(scene), mesh_of(scene)))


@pytest.mark.usefixtures("processor_time")
@pytest.mark.parametrize("name", LINES)
def test_a_topology_costs_what_its_wires_cost(name: str) -> None:
    case, changes, without, most = LINES[name]
    with march_of(case, changes) as march, march_of(case, without) as other:
        found = beside(march, other, ROUNDS)
    print(
        f"\n{name}: {found.least_of_other:.1f} us a step without, {found.least:.1f} with, "
        f"{found.ratio:.2f} times"
    )
    assert found.ratio < most
