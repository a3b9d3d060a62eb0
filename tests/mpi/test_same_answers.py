"""Scenes on one rank and on all: what every step shows agrees, and so does what is continued.

Run by ``mpirun -n N python -m mpi4py -m pytest tests/mpi``; on one rank it compares a run with
itself. Trains pass the middle of their lines, where two ranks meet.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rank_histories import WORLD, Shown, check_ranks, rest_on_all, scene_on_all
from small_lines import bare_wires

from catenary.base.parallel import on_root
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE, LineMesh
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.solver.model.partition import distribute
from catenary.solver.problem.defects import TensionLoss
from catenary.solver.problem.problem import steps_of
from catenary.solver.statics.form_finding import find_form
from catenary.solver.statics.line_at_rest import line_at_rest_on_all

EN = "en50318_2002"


def run(first: float, last: float, raised: float = 0.1, dt: float = 2e-3) -> list[str]:
    """A train from one place to another [m]."""
    way = last - first
    return [
        f"train.start_m={first}",
        f"train.end_m={last}",
        f"train.raise_time_s={raised}",
        f"evaluation.from_m={last - 0.38 * way}",
        f"evaluation.to_m={last - 0.32 * way}",
        f"numerics.dt_s={dt}",
    ]


# Two pantographs 31 m apart that cross the cuts between 2 and between 3 ranks, with slackening
# droppers, viscous contact and losses of contact while they are raised.
TWO = [
    "line.n_spans=10",
    "train.pantographs=[{name='reference'},{name='reference',behind_m=31.0}]",
    "effects.contact_damping=true",
    "contact.damping_N_s_per_m=50",
]
CLOSE = [*TWO, "train.pantographs.1.behind_m=5"]
# The correction stops at its own tolerance, which a round-off may cross one iteration earlier. It
# takes a step some ten solves: a way about the cut between the first two ranks.
CORRECTED = [
    "numerics.scheme=fixed_point",
    "numerics.eps_d_m=1e-13",
    "numerics.eps_v_m_per_s=1e-10",
]
CUT = 600.0 / max(2, WORLD.size)
DAMPED = ["numerics.spectral_radius=0.7"]
# Decisions are rank 0's. A size that round-off decides would show as an error of the order of the
# tolerance, far above what is allowed. Half of it is the raising, in which sizes change most.
ADAPTED = ["numerics.adaptive_tolerance_N=0.02", "numerics.smallest_dt_s=2.5e-4"]
# Long elements make the overlap of ranks long: several solve for what stands at an end, near which
# the train runs.
ON = ["line.n_spans=5", "line.ends.start.kind=periodic", "line.ends.end.kind=periodic"]
LAWS = [
    "mesh.elements_per_gap=3",
    "pantographs.reference.laws=[{type='limiter',rise_m=0,stiffness_N_per_m=1e4},"
    "{type='damper',up_N_s_per_m=200,down_N_s_per_m=30}]",
    "pantographs.reference.regulation={measures='contact_force',target=140,"
    "gains=[{at=0,error=0.2,integral_per_s=3}],filter_s=0.05,delay_s=0.02}",
    "effects.vehicle_motion=true",
    "vehicle.irregularity.spectrum=fra_5",
    "vehicle.suspension={body_mass_kg=3e4,pitch_inertia_kg_m2=2e6,"
    "stiffness_N_per_m=9e5,damping_N_s_per_m=4e4,bogie_distance_m=19,wheelbase_m=2.5}",
]
# A slack dropper breaks there, too.
DEFECTS = [
    "irregularities.contact_wire_height.standard_deviation_mm=10",
    "irregularities.running_surface.standard_deviation_mm=0.2",
    "irregularities.dropper_lengths={standard_deviation_mm=5,by_dropper=[[4,5,60],[4,9,60]]}",
    "defects=[{type='missing_dropper',span=4,dropper=3},{type='loose_clamp',span=5,dropper=2},"
    "{type='worn_wire',from_m=190,to_m=215,lost_share=0.2},"
    "{type='wrong_tension',wire='messenger_wire',factor=0.9},"
    "{type='hard_spot',at_m=205.3,mass_kg=5,stiffness_N_per_m=500},"
    "{type='kink',at_m=212.0,angle_deg=0.3}]",
    "line.fittings=[{kind='splice',at_m=209.4,mass_kg=1.2}]",
    "incidents=[{type='dropper_break',at_s=0.45,span=4,dropper=9}]",
]
GUSTS = [
    "line.contact_wire.diameter_mm=14.4",
    "line.messenger_wire.diameter_mm=14",
    "pantographs.reference.aerodynamics={uplift_polynomial=[0, 0, 1e-3], head_share=0.7}",
    "line.tunnels=[{from_m=145, to_m=300, force_factor=1.5}]",
    "wind={speed_m_per_s=30, direction_deg=120, drag='quadratic', gusts={highest_hz=2}}",
]
SEVEN = ["line.n_spans=8", "pantographs.seven_body.motion=all_bodies"]
APART = "effects.relative_motion=true"
# The case of each, the length of a span and the kind of pantograph, of eight spans or others.
TOPOLOGIES: dict[str, tuple[str, float, str, list[str]]] = {
    "stitched": ("re330_stitched", 65.0, "three_masses", []),
    "compound": ("shinkansen_compound", 50.0, "three_masses", []),
    "twin": ("dc_twin", 55.0, "three_masses", []),
    "twin, relative motion": ("dc_twin", 55.0, "three_masses", [APART]),
    "two messenger wires": ("dc_twin", 55.0, "three_masses", ["line.topology=twin_messenger"]),
    "single": ("tramway", 30.0, "two_masses", []),
    # Its force passes from one contact wire to the other.
    "overlap": (
        "overlap",
        55.0,
        "three_masses",
        ["line.overlap.first_span=[3,8]", "line.n_spans=12"],
    ),
}


SCENES: dict[str, tuple[str, list[str]]] = {
    "two pantographs": (EN, [*TWO, *run(150, 460, 0.5)]),
    "by correction": (EN, [*CLOSE, *run(CUT - 9, CUT + 9, 0.05), *CORRECTED]),
    # With the paper's average damping, and its law of a slack dropper.
    "dampers of slack droppers": (
        EN,
        [
            *(*TWO, *run(150, 270)),
            *(
                "line.dropper.slack_damping=kept",
                "line.damping.alpha_s=0.0275",
                "line.damping.beta_per_s=0",
            ),
        ],
    ),
    "damping by component": (
        EN,
        [*TWO, *run(150, 250), "line.damping.per_component.droppers={alpha_s=0,beta_per_s=0}"],
    ),
    "hht": (EN, [*TWO, *run(150, 250), "numerics.integrator=hht", *DAMPED]),
    "generalized alpha": (
        EN,
        [*TWO, *run(150, 250), "numerics.integrator=generalized_alpha", *DAMPED],
    ),
    "adapted steps": (EN, [*CLOSE, *run(150, 170, 0.15, 1e-3), *ADAPTED]),
    "adapted, by correction": (EN, [*CLOSE, *run(150, 170, 0.15, 1e-3), *ADAPTED, *CORRECTED]),
    "ends that go on": (EN, [*ON, *run(240, 285), "mesh.elements_per_gap=4"]),
    "ends that go on, long elements": (EN, [*ON, *run(240, 285), "mesh.elements_per_gap=1"]),
    "defects": (EN, ["line.n_spans=7", *run(180, 230), *DEFECTS]),
    "gusts": (EN, ["line.n_spans=7", *run(120, 155), *GUSTS]),
    "laws, a regulated lift, a car": (EN, ["line.n_spans=6", *run(120, 150, dt=1e-3), *LAWS]),
    "all bodies": ("ambrosio2012", [*SEVEN, *run(120, 150)]),
    "all bodies by correction": ("ambrosio2012", [*SEVEN, *run(120, 130, 0.02), *CORRECTED]),
    **{
        name: (
            case,
            [
                "line.n_spans=8",
                f"train.pantographs=[{{name='{kind}'}}]",
                *run(4 * span - 10, 4 * span + 10, 0.05),
                *words,
            ],
        )
        for name, (case, span, kind, words) in TOPOLOGIES.items()
    },
}
STUDIES = ("hht", "adapted, by correction")
# Which of them are continued, from the middle of the run or so.
CONTINUED = {
    "twin", "twin, relative motion", "overlap", "defects", "gusts", "ends that go on",
    "ends that go on, long elements",
}  # fmt: skip


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.study) if name in STUDIES else name for name in SCENES],
)
def test_all_ranks_give_the_answer_of_one(name: str) -> None:
    rest = rest_on_all(*SCENES[name])
    kept = [steps_of(rest.model.problem) // 2] if name in CONTINUED else []
    shown = check_ranks(rest, *kept).channels
    # Something happens in each: a share that is lost would show.
    assert np.ptp(shown["contact_force"][:, 0]) > 20.0
    if name in ("dampers of slack droppers", "defects"):
        assert (shown["dropper_force"] <= 0.0).any()
    if name in ("twin, relative motion", "overlap"):
        assert (shown["contact_wire_force"] > 1.0).any(axis=0).all()
    if name.startswith("all bodies"):
        assert 0.0 < shown["constraint_violation"].max() < 1e-9


@pytest.mark.skipif(WORLD.size > 3, reason="a longer line would be needed")
def test_rank_0_may_have_less_of_a_long_line() -> None:
    """The train crosses the end of rank 0's share."""
    problem, mesh = scene_on_all(EN, ["line.n_spans=140"])

    def shares() -> tuple[np.ndarray, float]:
        model, _ = find_form(problem, mesh)
        ownership = distribute(model, max(2, WORLD.size), 0)
        nodes = mesh.wires[CONTACT_WIRE]
        cut = float(mesh.x(nodes[ownership.owned(model.dofs(nodes))]).max())
        return np.diff(ownership.bounds), cut

    of_ranks, cut = on_root(WORLD, shares)
    assert of_ranks[0] < 0.9 * of_ranks[1]
    train = replace(problem.train, start=cut - 30.0, end=cut + 20.0, raise_time=0.2)
    check_ranks(line_at_rest_on_all(replace(problem, train=train), mesh, WORLD))


def test_a_rank_without_any_station_is_legal() -> None:
    """Two bare wires of one element have two stations: on three ranks one owns nothing. One of them
    loses tension."""
    problem, _ = scene_on_all(EN, ["line.n_spans=7", *run(150, 250)])
    length = 60.0
    mesh = LineMesh(
        points=np.array([[0.0, 0.0, 5.0], [length, 0.0, 5.0], [0.0, 0.0, 6.2], [length, 0.0, 6.2]]),
        wires={CONTACT_WIRE: np.array([0, 1]), MESSENGER_WIRE: np.array([2, 3])},
        droppers=np.zeros((0, 2), dtype=int),
        steady_arms=np.zeros(0, dtype=int),
        supports=np.zeros(0, dtype=int),
        anchors=np.array([0, 1, 2, 3]),
    )
    lost = (TensionLoss(0.3, CONTACT_WIRE, 0.8),)

    def shown(incidents: tuple[TensionLoss, ...]) -> Shown:
        bare = replace(
            problem,
            line=make_line(bare_wires(length)),
            train=replace(problem.train, start=5.0, end=50.0, raise_time=0.1),
            incidents=incidents,
        )
        rest = line_at_rest_on_all(bare, mesh, WORLD)
        owned = np.diff(distribute(rest.model, WORLD.size, WORLD.rank).bounds)
        assert owned.sum() == rest.model.n_dofs
        assert WORLD.size < 3 or (owned == 0).any()
        return check_ranks(rest)

    sound, changed = (shown(incidents).channels["energies"] for incidents in ((), lost))
    assert np.abs(changed - sound)[16:, 1].max() > 1e-3
