"""Lines of all topologies and in all planes on 1, 2, 3, 5 and 8 ranks.

Run by ``make test-ranks``: one ``mpirun -n 8`` holds all counts, as groups of its first ranks. With
fewer ranks the counts that these allow are compared.
"""

from __future__ import annotations

import pytest
from mpi4py import MPI
from rank_histories import WORLD, check_off, marched, on_one, rest_on_all
from scenes import load_scene

COUNTS = (2, 3, 5, 8)
N_SPANS = 10
STEPS, DT = 80, 2e-3

APART = "effects.relative_motion=true"
# By topology: its case, what else it needs, and its tables of wires.
LINES: dict[str, tuple[str, list[str], tuple[str, ...]]] = {
    "simple": ("ac_simple", [], ("contact_wire", "messenger_wire")),
    "stitched": ("re330_stitched", [], ("contact_wire", "messenger_wire", "stitch_wire")),
    "compound": ("shinkansen_compound", [], ("contact_wire", "messenger_wire", "auxiliary_wire")),
    "twin": ("dc_twin", [APART], ("contact_wire", "messenger_wire")),
    "twin_messenger": (
        "ac_simple",
        ["line.topology=twin_messenger", "line.twin.spacing_m=0.1"],
        ("contact_wire", "messenger_wire"),
    ),
    "single": ("tramway", ["line.steady_arm.length_m=0.8"], ("contact_wire",)),
    "overlap": ("overlap", ["line.overlap.first_span=4"], ("contact_wire", "messenger_wire")),
}
LATERAL = ["effects.lateral_motion=true"]
# Droppers of some 60 N at rest that soften to both sides of it.
BENT = [
    "line.dropper.stiffness_N_per_m=",
    "line.dropper.curve=[[0,0],[5e-4,20],[8e-4,80],[3e-3,120],[4e-3,600]]",
]
PLANES = {
    "vertical": [],
    "lateral": LATERAL,
    "axial": ["effects.axial_motion=true"],
    "curves": BENT,
    "curves in three planes": [*LATERAL, *BENT],
    "gusts": [
        *LATERAL,
        "wind={speed_m_per_s=30,direction_deg=110,drag='quadratic',gusts={highest_hz=2}}",
    ],
}
# Each topology in the vertical plane and in three; the simple line also by each effect.
CHOSEN = [
    *((name, plane) for name in LINES for plane in ("vertical", "all")),
    *(("simple", plane) for plane in ("lateral", "axial", "gusts")),
    *(("simple", plane) for plane in ("curves", "curves in three planes")),
]


def words_of(topology: str, plane: str) -> tuple[str, list[str]]:
    """A case, and a run of some steps over the middle of its line."""
    case, own, wires = LINES[topology]
    scene = load_scene(case)
    span = scene.line.span_m
    middle = sum(span) / len(span) * N_SPANS / 2
    kind = scene.train.pantographs[0].name
    way = scene.train.speed_km_h / 3.6 * DT * STEPS
    words = [
        f"line.n_spans={N_SPANS}",
        f"mesh.elements_per_gap={10 if topology == 'single' else 2}",
        f"train.pantographs=[{{name='{kind}'}}]",
        f"train.start_m={middle - 0.5 * way}",
        f"train.end_m={middle + 0.5 * way}",
        "train.raise_time_s=0.02",
        f"evaluation.from_m={middle}",
        f"evaluation.to_m={middle + 0.2 * way}",
        f"numerics.dt_s={DT}",
        *own,
    ]
    chosen = ("axial", "gusts") if plane == "all" else (plane,)
    if "axial" in chosen:
        words += [f"line.{wire}.axial_stiffness_N=1.2e7" for wire in wires]
        words += ["line.ends.end.along=tensioner"]
        words += ["line.mid_points_m=[]" if topology != "overlap" else _anchors(middle, span[0])]
    if "gusts" in chosen:
        words += [f"line.{wire}.diameter_mm=12" for wire in wires]
    for one in chosen:
        words += PLANES[one]
    return case, words


def _anchors(middle: float, span: float) -> str:
    """Masts that hold both sections of an overlap, which have tensioners at both ends."""
    return f"line.mid_points_m=[{middle - 3 * span},{middle + 3 * span}]"


def test_scenes_are_accepted() -> None:
    """Also where ranks are too few to compare what they give."""
    for topology, plane in CHOSEN if WORLD.rank == 0 else ():
        assert load_scene(*words_of(topology, plane))


@pytest.mark.study
@pytest.mark.parametrize(("topology", "plane"), CHOSEN)
def test_any_number_of_ranks_gives_the_answer_of_one(topology: str, plane: str) -> None:
    rest = rest_on_all(*words_of(topology, plane))
    alone = on_one(lambda comm: marched(comm, rest))
    for count in (count for count in COUNTS if count <= WORLD.size):
        group = WORLD.Split(0 if WORLD.rank < count else MPI.UNDEFINED)
        if group != MPI.COMM_NULL:
            check_off(group, marched(group, rest), alone)
            group.Free()
