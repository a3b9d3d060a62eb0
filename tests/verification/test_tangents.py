"""Derivatives of marches by parameters: beside dense matrices, and beside differences of marches.

A march is a smooth function of a parameter as long as no contact and no dropper switches in another
step. Differences of marches are taken so close that none does: within 1e-6 of the parameter.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from dense_line import DenseLine
from measuring import check
from mpi4py import MPI
from scenes import load_scene
from scenes import mesh_of as mesh_of_scene
from scenes import problem_of as problem_of_scene
from small_lines import EN_CONTACT_WIRE, WHOLE, en50318_line, mesh_of, numerics, problem_of, train
from studies import few

from catenary import InputError
from catenary.cases.run.at_rest import sound_rest
from catenary.cases.studies.parameters.derivatives import change_by
from catenary.cases.studies.parameters.parameters import ChangedScenes
from catenary.mbs.lumped import LumpedData
from catenary.solver.kernels import native
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.tangents import lanes
from catenary.solver.tangents.march import Tangents, march_with_tangents
from catenary.solver.tangents.set_up import Change, SetUp, differentiate, set_up_of

COMM = MPI.COMM_SELF
DT = 1e-3


class ActingLine(DenseLine):
    """A dense line whose links and contact act, or do not, as in the latest step."""

    def matrices_of(self, acting: frozenset[int], x: float) -> list[np.ndarray]:
        """M, C, K and load under what acts, with the head at ``x`` [m]."""
        mass, damping, stiffness = (matrix.copy() for matrix in self.matrices)
        load = self.load.copy()
        for link in (number for number in acting if number >= 0):
            along = self.pull[link]
            stiffness -= self.spring[link] * np.outer(along, along)
            damping -= self.alpha * self.spring[link] * np.outer(along, along)
            load += self.rest[link] * along
        if -1 in acting:
            along, rest = self.meets(x)
            stiffness += self.law * np.outer(along, along)
            load -= self.law * rest * along
        return [mass, damping, stiffness, load]

    @cache  # noqa: B019  (a march's places, of lines that end with the test)
    def meets(self, x: float, contact: int = 0) -> tuple[np.ndarray, float]:
        return super().meets(x, contact)

    __hash__ = object.__hash__

    @property
    def law(self) -> float:
        """Stiffness of the contact [N/m]."""
        assert isinstance(self.problem.contact, LinearLaw)
        return self.problem.contact.stiffness


class DenseTangent:
    """The derivative of a dense line's march: average acceleration, differentiated.

    ``sides`` are the line at both sides of the parameter, ``step`` from it; ``start`` (3, size) the
    derivative of its first state.
    """

    def __init__(
        self, sides: tuple[ActingLine, ActingLine], step: float, start: np.ndarray
    ) -> None:
        self.sides, self.step, self.tangent = sides, step, start

    def follow(self, line: ActingLine, x: float, matrices: list[np.ndarray]) -> float:
        """Take the derivative through a step that ``line`` has taken, whose ``matrices`` are under
        what acted in it; of the contact force [N per unit]."""
        both = [side.matrices_of(line.acting, x) for side in self.sides]
        by_mass, by_damping, by_stiffness, by_load = (
            (high - low) / (2.0 * self.step) for high, low in zip(*both, strict=True)
        )
        mass, damping, stiffness, _ = matrices
        d, v, a = line.state
        dd, dv, da = self.tangent
        dd, dv = dd + DT * dv + DT**2 / 4 * da, dv + DT / 2 * da
        right = by_load - by_mass @ a - by_damping @ v - by_stiffness @ d
        right -= damping @ dv + stiffness @ dd
        free, new = line.free, np.zeros(line.size)
        matrix = mass + DT / 2 * damping + DT**2 / 4 * stiffness
        new[free] = np.linalg.solve(matrix[np.ix_(free, free)], right[free])
        self.tangent = np.array([dd + DT**2 / 4 * new, dv + DT / 2 * new, new])
        if -1 not in line.acting:
            return 0.0
        along, _ = line.meets(x)
        forces = [side.law * (along @ d + side.meets(x)[1]) for side in self.sides]
        by_law = (forces[0] - forces[1]) / (2.0 * self.step)
        return float(line.law * along @ self.tangent[0] + by_law)


def small_problem() -> Problem:
    """A head that rises into the wire, fast and strong enough to slacken droppers."""
    line = replace(
        en50318_line(2),
        span_lengths=(24.0, 24.0),
        dropper_positions=((4.0, 12.0, 20.0),) * 2,
        pre_sag=((0.0,) * 3,) * 2,
    )
    run = train(100.0, 6.0, 42.0, static_force=260.0, raise_time=0.0, nominal_height=5.5)
    return problem_of(
        line,
        WHOLE,
        damping=Damping(alpha=5e-3, beta=0.0),
        train=replace(run, start_below=0.02),
        numerics=numerics(DT),
        evaluation=(10.0, 40.0),
    )


def with_head(problem: Problem, **changes: Any) -> Problem:
    (placement,) = problem.train.placements
    placement = replace(placement, **changes)
    return replace(problem, train=replace(problem.train, placements=(placement,)))


def with_tension(problem: Problem, by: float) -> Problem:
    line = replace(
        en50318_line(2),
        span_lengths=(24.0, 24.0),
        dropper_positions=((4.0, 12.0, 20.0),) * 2,
        pre_sag=((0.0,) * 3,) * 2,
        contact_wire=replace(EN_CONTACT_WIRE, tension=EN_CONTACT_WIRE.tension + by),
    )
    return replace(problem, line=problem_of(line).line)


# Each with the step of differences, for which dense matrices are linear or nearly so.
CHANGES: dict[str, tuple[float, Callable[[Problem, float], Problem]]] = {
    "static force": (1.0, lambda p, by: with_head(p, static_force=260.0 + by)),
    "head mass": (
        1e-3,
        lambda p, by: with_head(p, data=LumpedData((7.2 + by, 15.0), (4200.0, 50.0), (10.0, 90.0))),
    ),
    "contact stiffness": (
        10.0,
        lambda p, by: replace(p, contact=LinearLaw(5e4 + by, 0.0)),
    ),
    "tension": (10.0, with_tension),
    "damping": (1e-6, lambda p, by: replace(p, damping=Damping(5e-3 + by, 0.0))),
}


def at_rest(problem: Problem) -> LineAtRest:
    return line_at_rest(problem, mesh_of(problem.line, 2))


def change_of(problem: Problem, name: str) -> Change:
    step, changed = CHANGES[name]
    now = set_up_of(COMM, at_rest(problem))
    return differentiate(lambda by: set_up_of(COMM, at_rest(changed(problem, by))), now, step, name)


def acting_line(rest: LineAtRest) -> ActingLine:
    return ActingLine(rest.problem, rest.mesh, rest.form, dampers_act=False)


@pytest.mark.study
def test_tangents_are_those_of_dense_matrices() -> None:
    """NumPy alone, with the set of slack droppers and of contact that its own search finds."""
    problem = small_problem()
    rest = at_rest(problem)
    changes = [change_of(problem, name) for name in CHANGES]
    marched = march_with_tangents(COMM, rest, changes)
    line = acting_line(rest)
    line.state = np.zeros((3, line.size))
    line.state[:, -2:] = set_up_of(COMM, rest).states[0].reshape(3, 2)
    tangents = []
    for change, (step, changed) in zip(changes, CHANGES.values(), strict=True):
        sides = (
            acting_line(at_rest(changed(problem, step))),
            acting_line(at_rest(changed(problem, -step))),
        )
        # Heads start with the accelerations of their forces, which are other ones at both sides.
        start = np.zeros((3, line.size))
        start[:, -2:] = change.heads[0].state.reshape(3, 2)
        tangents.append(DenseTangent(sides, step, start))
    forces, sets = np.zeros((len(marched.force), len(CHANGES))), set()
    heights = np.zeros_like(forces)
    for row, own, x in zip(forces, heights, marched.position[:, 0], strict=True):
        line.step(x)
        matrices = line.matrices_of(line.acting, x)
        row[:] = [tangent.follow(line, x, matrices) for tangent in tangents]
        own[:] = [tangent.tangent[0, -2] for tangent in tangents]  # the upper one of two masses
        sets.add(line.acting)
    print(f"{len(sets)} sets; {marched.contact_switches} switches of contact")
    assert len(sets) > 5 and marched.open_steps > 40 and marched.link_switches > 5
    for number, name in enumerate(CHANGES):
        expected = forces[:, number]
        # Second differences of dense matrices, which are not linear in tension and mass of heads,
        # over steps of 1e-4 to 5e-4 of them: 1e-8 to 1e-7 of the derivative.
        limit = 1e-6 * np.abs(expected).max()
        check(f"by {name}", marched.by_force[:, number, 0], expected, within=limit)
        expected = heights[:, number]
        limit = 1e-6 * np.abs(expected).max()
        check(f"height by {name}", marched.by_head_height[:, number, 0], expected, within=limit)


def test_a_march_is_the_same_with_and_without_tangents() -> None:
    problem = small_problem()
    rest = at_rest(problem)
    alone = march_with_tangents(COMM, rest, [])
    beside = march_with_tangents(COMM, rest, [change_of(problem, "tension")] * 2)
    assert np.array_equal(alone.force, beside.force)
    assert np.array_equal(alone.uplift, beside.uplift)
    assert np.array_equal(beside.by_force[:, 0], beside.by_force[:, 1])
    assert alone.by_force.shape == (len(alone.force), 0, 1)


def test_tangents_side_by_side_are_those_of_each_alone() -> None:
    """Heads and the law load no line, the others do: by matrices, or by contacts that move."""
    problem = small_problem()
    rest = at_rest(problem)
    now = set_up_of(COMM, rest)

    def faster(by: float) -> SetUp:
        run = replace(problem.train, speed=problem.train.speed + by)
        return set_up_of(COMM, at_rest(replace(problem, train=run)), len(now.drives))

    names = ["tension", "static force", "damping", "contact stiffness"]
    changes = [change_of(problem, name) for name in names]
    changes += [differentiate(faster, now, 1e-3, "speed"), changes[0], changes[2]]
    assert sum(change.loads_line for change in changes) > 4
    alone = [march_with_tangents(COMM, rest, [change]) for change in changes]
    best, *others = reversed(native.targets())
    try:
        for target in (best, *others):
            assert native.set_target(target)
            # All in one group where vectors hold eight, and in several.
            for n in (len(changes), len(changes) + 3):
                numbers = [number % len(changes) for number in range(n)]
                together = march_with_tangents(COMM, rest, [changes[k] for k in numbers])
                for number, k in enumerate(numbers):
                    for name in ("by_force", "by_uplift", "by_head_height"):
                        found, expected = getattr(together, name), getattr(alone[k], name)[:, 0]
                        # Sums in another order, over 1000 steps.
                        within = 1e-10 * np.abs(expected).max()
                        what = f"{name} of {number}, {target}"
                        check(what, found[:, number], expected, within=within)
    finally:
        native.set_target(best)


def evaluated(first: int, last: int) -> list[str]:
    return [f"evaluation.from_m={first}", f"evaluation.to_m={last}"]


class AllAwake:
    """Kernels of which free steps of tangents move all stations, or their own that are kept."""

    def __init__(self, moves_all: bool) -> None:
        self.moves_all, self.made = moves_all, []  # type: ignore[var-annotated]

    def __getattr__(self, name: str) -> Any:
        return getattr(native, name)

    def LanePasses(self, *parts: Any) -> native.LanePasses:  # noqa: N802
        *others, guard = parts
        self.made.append(native.LanePasses(*others, 0 if self.moves_all else guard))
        return self.made[-1]


@pytest.mark.parametrize(
    "case, words, begins, ends",
    [
        ("ac_simple", ["train.start_m=220", *evaluated(280, 330)], False, True),
        ("re330_stitched", evaluated(250, 350), False, True),
        # Behind the middle, where elimination of the whole line ends.
        ("en50318_2002", ["train.start_m=800", *evaluated(860, 900)], True, False),
    ],
)
def test_stations_that_no_wave_has_reached_are_left_out(
    case: str, words: list[str], begins: bool, ends: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of marches that end before waves are at the line's end, or at its start."""
    scenes = ChangedScenes(load_scene(case, words))
    rest = sound_rest(scenes.scene)
    now = set_up_of(COMM, rest)
    keys = ["irregularities.dropper_lengths.2.3", "line.contact_wire.tension_N"]
    changes = [change_by(scenes.parameter(key), scenes, rest, now, COMM) for key in keys]
    found = {}
    for moves_all in (True, False):
        kernels = AllAwake(moves_all)
        monkeypatch.setattr(lanes, "native", kernels)
        found[moves_all] = march_with_tangents(COMM, rest, changes)
        (passes,) = kernels.made
        n = rest.model.n_unknowns
        assert (passes.begin > 0, passes.end < n) == (
            begins and not moves_all,
            ends and not moves_all,
        )
    for name in ("by_force", "by_uplift", "by_head_height"):
        expected = getattr(found[True], name)
        # What is left out is 1e-14 of the motion at each of 1000 steps.
        within = 1e-11 * np.abs(expected).max(axis=(0, 2), keepdims=True)
        check(name, getattr(found[False], name) / within, expected / within, within=1.0)


SHORT = ["line.n_spans=6", "evaluation.from_m=140", "evaluation.to_m=240"]
RESTITUTION = ["contact.law=lankarani_nikravesh", "contact.restitution=0.8"]
KINEMATIC = [
    "contact.law=kinematic", "contact.stiffness_N_per_m=", "train.speed_km_h=200",
    "numerics.newmark_gamma=0.55", "numerics.newmark_beta=0.28",
]  # fmt: skip
TWO = ["line.n_spans=6", "evaluation.from_m=160", "evaluation.to_m=220",
       "train.pantographs.1.name=three_masses", "train.pantographs.1.behind_m=100"]  # fmt: skip
HEAD = "pantographs.reference"
DAMPER = f'{HEAD}.laws=[{{type="damper",at_mass=2,up_N_s_per_m=60.0,down_N_s_per_m=120.0}}]'
LIMITER = (
    f"{HEAD}.laws=[{{type='limiter',rise_m=0.002,stiffness_N_per_m=5e3}}] "
    f"{HEAD}.nominal_height_m=5.0"
).split()
BENDING = [
    f"{HEAD}.strips={{number=2,spacing_m=0.5,length_m=1.6,mass_kg=1.5,stiffness_N_per_m=8000.0,"
    "damping_N_s_per_m=10.0,flexure={bending_stiffness_N_m2=400.0,spring_distance_m=0.8}}",
    f"{HEAD}.roll={{inertia_kg_m2=2.0,spring_distance_m=0.67}}",
    "line.stagger_m=0.2",
    "effects.head_roll=true",
]
PITCHING = (
    f"{HEAD}.strips={{number=2,spacing_m=0.5,pitch_inertia_kg_m2=0.5,pitch_spring_distance_m=0.4}}"
)
# At all supports, of which that at 180 m is 10 mm higher.
HEIGHTS = [[60.0 * number, 0.01 * (number == 3)] for number in range(7)]
# A case, how it is changed, and parameters with steps of differences in parts of them.
SCENES: dict[str, tuple[str, list[str], dict[str, float]]] = {
    "simple": (
        "en50318_2002",
        SHORT,
        {
            f"{HEAD}.static_force_N": 1e-5,
            f"{HEAD}.masses_kg.0": 1e-5,
            f"{HEAD}.stiffnesses_N_per_m.0": 1e-5,
            "contact.stiffness_N_per_m": 2e-4,
            "line.messenger_wire.tension_N": 1e-5,
            "line.damping.alpha_s": 1e-4,
        },
    ),
    "height at a support": (
        "en50318_2002",
        [*SHORT, f"irregularities.contact_wire_height.by_place={HEIGHTS}"],
        {"irregularities.contact_wire_height.3": 1e-3},
    ),
    # A set-up bends with the place within an element, of a metre, however far along the line it is.
    "hard spot": (
        "en50318_2002",
        [*SHORT, 'defects=[{type="hard_spot",at_m=201.3,mass_kg=3.0,stiffness_N_per_m=5e3}]'],
        {"defects.0.at_m": 1e-6, "defects.0.mass_kg": 1e-5},
    ),
    "impact": (
        "en50318_2002",
        [*SHORT, *RESTITUTION, "effects.contact_damping=true"],
        {"contact.restitution": 1e-4, f"{HEAD}.static_force_N": 1e-5},
    ),
    "kinematic": (
        "en50318_2002",
        [*SHORT, *KINEMATIC],
        {f"{HEAD}.static_force_N": 1e-5, "line.contact_wire.tension_N": 1e-5},
    ),
    "pneumatic damper": (
        "en50318_2002",
        [*SHORT, DAMPER],
        {f"{HEAD}.masses_kg.1": 1e-4, "line.contact_wire.tension_N": 1e-5},
    ),
    "limiter": (
        "en50318_2002",
        [*SHORT, *LIMITER],
        {f"{HEAD}.nominal_height_m": 1e-7, f"{HEAD}.laws.0.rise_m": 1e-5},
    ),
    "strips that bend on a head that rolls": (
        "en50318_2002",
        [*SHORT, *BENDING],
        {
            f"{HEAD}.masses_kg.1": 1e-5,
            f"{HEAD}.stiffnesses_N_per_m.1": 1e-4,
            f"{HEAD}.roll.inertia_kg_m2": 1e-4,
            f"{HEAD}.strips.flexure.bending_stiffness_N_m2": 4e-5,
            f"{HEAD}.static_force_N": 1e-5,
        },
    ),
    "two pantographs": (
        "ac_simple",
        TWO,
        {"line.dropper.pre_sag_mm.2": 1e-5, "line.contact_wire.mass_kg_per_m": 1e-5},
    ),
}
LONG = {
    # Elements that agree in 38 bits have one matrix, and which these are changes with a parameter:
    # forces of this line move by 5e-12 of the largest then. Steps are so large that this is below
    # the bound.
    "stitched": (
        "re330_stitched",
        [],
        {"line.stitch_wire.tension_N": 4e-5, "line.messenger_wire.mass_kg_per_m": 2e-5},
    ),
    "twin": (
        "dc_twin",
        [],
        {"line.contact_wire.tension_N": 1e-6, "line.dropper.pre_sag_mid_mm": 1e-5},
    ),
    # Two wires that heads leave and meet switch 943 times: one of them already 1e-7 away.
    "overlap": ("overlap", [], {"line.contact_wire.tension_N": 2e-8}),
    "seven bodies": (
        "ambrosio2012",
        [],
        {
            "pantographs.seven_body.static_force_N": 1e-5,
            "pantographs.seven_body.bodies.upper_arm.mass_kg": 1e-5,
            "contact.stiffness_N_per_m": 1e-4,
        },
    ),
    "gusts": ("windy_viaduct", [], {"line.contact_wire.mass_kg_per_m": 1e-5}),
    "three dimensions": ("ac_simple_3d", [], {"line.contact_wire.tension_N": 1e-6}),
}


def marched_scene(
    case: str, words: list[str], keys: list[str]
) -> tuple[Tangents, Callable[[str, float], Tangents]]:
    """A march with tangents, and marches with a parameter changed."""
    scenes = ChangedScenes(load_scene(case, words, shortened=True))

    def rest_of(scene: Any) -> LineAtRest:
        return line_at_rest(problem_of_scene(scene), mesh_of_scene(scene))

    def changed(key: str, by: float) -> LineAtRest:
        return rest_of(scenes.changed(scenes.parameter(key), by))

    rest = rest_of(scenes.scene)
    now = set_up_of(COMM, rest)
    changes = [
        differentiate(
            lambda by, key=key: set_up_of(COMM, changed(key, by), len(now.drives)),
            now,
            scenes.parameter(key).step,
            key,
        )
        for key in keys
    ]

    def again(key: str, part: float) -> Tangents:
        return march_with_tangents(COMM, changed(key, part * scenes.parameter(key).size), [])

    own = march_with_tangents(COMM, rest, changes)
    # Per part of a parameter, as differences are.
    sizes = np.array([scenes.parameter(key).size for key in keys])
    scaled = replace(
        own,
        by_force=own.by_force * sizes[:, None],
        by_uplift=own.by_uplift * sizes[:, None],
        by_head_height=own.by_head_height * sizes[:, None],
    )
    return scaled, again


def is_difference(case: str, words: list[str], steps: dict[str, float]) -> None:
    own, again = marched_scene(case, words, list(steps))
    print(f"{own.contact_switches} switches of contacts, {own.link_switches} of links")
    for number, (key, part) in enumerate(steps.items()):
        high, low = again(key, part), again(key, -part)
        n = min(len(high.force), len(low.force), len(own.force))
        # Round-off of a march of thousands of steps, [N] and [m], over the step of the difference.
        for what, by, noise in (
            ("force", "by_force", 1e-9),
            ("uplift", "by_uplift", 1e-13),
            ("head_height", "by_head_height", 1e-13),
        ):
            expected = (getattr(high, what)[:n] - getattr(low, what)[:n]) / (2.0 * part)
            limit = noise / part + 1e-6 * np.abs(expected).max()
            check(f"{what} by {key}", getattr(own, by)[:n, number], expected, within=limit)


@pytest.mark.parametrize("name", few(SCENES, "two pantographs", "kinematic", "hard spot"))
def test_tangents_are_differences_of_marches(name: str) -> None:
    is_difference(*SCENES[name])


@pytest.mark.study
@pytest.mark.parametrize("name", LONG)
def test_tangents_are_differences_of_marches_of_cases(name: str) -> None:
    is_difference(*LONG[name])


# Eight parameters of each of five kinds of line.
FORTY: dict[str, tuple[str, list[str], list[str]]] = {
    "simple": (
        "en50318_2002",
        [*SHORT, "irregularities.dropper_lengths.by_dropper=[[3,5,4.0]]"],
        [
            f"{HEAD}.static_force_N",
            f"{HEAD}.dampings_N_s_per_m.1",
            "contact.stiffness_N_per_m",
            "line.contact_wire.tension_N",
            "line.messenger_wire.mass_kg_per_m",
            "line.dropper.stiffness_N_per_m",
            "line.support.stiffness_N_per_m",
            "irregularities.dropper_lengths.3.5",
        ],
    ),
    "stitched": (
        "re330_stitched",
        [],
        [
            "line.stitch_wire.tension_N",
            "line.stitch_wire.mass_kg_per_m",
            "line.messenger_wire.tension_N",
            "line.contact_wire.tension_N",
            "line.dropper.messenger_clamp_kg",
            "line.steady_arm.mass_kg_per_m",
            "pantographs.three_masses.masses_kg.2",
            "pantographs.three_masses.stiffnesses_N_per_m.0",
        ],
    ),
    "twin": (
        "dc_twin",
        [],
        [
            "line.contact_wire.tension_N",
            "line.contact_wire.mass_kg_per_m",
            "line.messenger_wire.tension_N",
            "line.dropper.pre_sag_mid_mm",
            "line.steady_arm.mass_kg_per_m",
            "line.damping.alpha_s",
            "pantographs.three_masses.masses_kg.1",
            "contact.stiffness_N_per_m",
        ],
    ),
    "overlap": (
        "overlap",
        ["effects.dropper_slackening=false"],  # else one of 943 switches is 1e-7 away
        [
            "line.contact_wire.tension_N",
            "line.messenger_wire.mass_kg_per_m",
            "line.messenger_wire.bending_stiffness_N_m2",
            "line.dropper.contact_clamp_kg",
            "line.dropper.pre_sag_mm.3",
            "line.steady_arm.length_m",
            "pantographs.three_masses.static_force_N",
            "pantographs.three_masses.masses_kg.0",
        ],
    ),
    "three planes": (
        "ac_simple_3d",
        [],
        [
            "line.contact_wire.tension_N",
            "line.messenger_wire.tension_N",
            "line.dropper.pre_sag_mm",
            "line.steady_arm.clamp_kg",
            "line.damping.alpha_s",
            "pantographs.three_masses.stiffnesses_N_per_m.2",
            "pantographs.three_masses.dampings_N_s_per_m.0",
            "contact.stiffness_N_per_m",
        ],
    ),
}
# Steps in parts of a parameter. Differences err by round-off of marches over the step and, from the
# step on that moves a switch, by its kink; between both lies one where neither counts.
PARTS = (1e-5, 1e-4, 1e-6, 1e-3, 1e-7, 2e-8)


@pytest.mark.study
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("name", FORTY)
def test_forty_tangents_are_differences_within_a_millionth(name: str) -> None:
    case, words, keys = FORTY[name]
    own, again = marched_scene(case, words, keys)
    for number, key in enumerate(keys):
        error = dict.fromkeys(("force", "uplift", "head_height"), np.inf)
        for part in PARTS:
            high, low = again(key, part), again(key, -part)
            for what in error:
                found = getattr(own, f"by_{what}")[:, number]
                by = (getattr(high, what) - getattr(low, what)) / (2.0 * part)
                off = float(np.abs(found - by).max() / np.abs(by).max())
                error[what] = min(error[what], off)
            if max(error.values()) < 1e-6:
                break
        for what, least in error.items():
            check(f"{what} by {key}, of its largest", least, 0.0, within=1e-6)


def test_a_smooth_march_has_derivatives_by_speed_and_place() -> None:
    """Without switches; contacts cross nodes, where third derivatives of heights jump."""
    words = [*SHORT, "effects.contact_loss=false", "effects.dropper_slackening=false",
             "train.speed_km_h=251.37"]  # fmt: skip
    own, again = marched_scene("en50318_2002", words, ["train.speed_km_h"])
    high, low = again("train.speed_km_h", 1e-8), again("train.speed_km_h", -1e-8)
    n = min(len(high.force), len(low.force))
    expected = (high.force[:n] - low.force[:n]) / 2e-8
    check("by speed", own.by_force[:n, 0], expected, within=1e-4 * np.abs(expected).max())


def test_what_is_not_differentiated_is_refused() -> None:
    problem = small_problem()
    rest = at_rest(problem)
    coarse = replace(rest.problem, numerics=numerics(DT, coupling="explicit"))
    with pytest.raises(InputError, match='coupling other than "implicit" is not differentiated'):
        set_up_of(COMM, rest._replace(problem=coarse))
    now = set_up_of(COMM, rest)
    longer = replace(problem, train=replace(problem.train, start=problem.train.start + 1.0))
    moved = set_up_of(COMM, at_rest(longer), len(now.drives))
    assert moved.start[0] == now.start[0] + 1.0
    finer = line_at_rest(problem, mesh_of(problem.line, 3))
    with pytest.raises(InputError, match="the mesh changes the number of unknowns"):
        differentiate(lambda by: set_up_of(COMM, finer), now, 1.0, "the mesh")


@pytest.mark.parametrize(
    ("strips", "key"),
    [
        (BENDING, "length_m"),
        ([PITCHING], "spacing_m"),
    ],
)
def test_a_parameter_by_which_forces_meet_heads_otherwise_is_refused(
    strips: list[str], key: str
) -> None:
    """Modes of a longer strip, and levers of strips farther from each other."""
    with pytest.raises(InputError, match="changes how contact forces act on heads"):
        marched_scene("en50318_2002", [*SHORT, *strips], [f"{HEAD}.strips.{key}"])
