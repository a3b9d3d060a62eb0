"""Random scenes: sound ones run 200 steps soundly, broken ones are refused in one sentence.

`make fuzz` runs thousands. FUZZ_SEED and FUZZ_CASES say where seeds begin and how many there are;
a failure names its seed, and FUZZ_SEED=<that> FUZZ_CASES=1 replays it.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import pytest
from fuzzing import (
    BASE,
    N_STEPS,
    RandomScene,
    broken_topology,
    sound_scene,
    topology_scene,
    twin_scene,
    wide_scene,
)
from mpi4py import MPI
from scenes import Scene, load_scene

from catenary import InputError
from catenary.base.parallel import on_root
from catenary.cases.scene.input.faults import SceneError
from catenary.cases.studies.hard import runs as hard_runs
from catenary.cases.studies.hard.runs import RunHistories
from catenary.solver.problem.defects import DropperBreak

pytestmark = pytest.mark.study

FIRST = int(os.environ.get("FUZZ_SEED", "1"))
CASES = int(os.environ.get("FUZZ_CASES", "100"))
# One test is one block of seeds, so that none runs into the limit of a test's time.
BLOCK = 25
BLOCKS = [
    range(first, min(first + BLOCK, FIRST + CASES)) for first in range(FIRST, FIRST + CASES, BLOCK)
]
# Of scenes of any topology fewer still: their lines differ in all matrices, and a block takes long.
FEW = [block[i : i + 5] for block in BLOCKS for i in range(0, len(block), 5)]
TOPOLOGIES = FEW if "FUZZ_CASES" in os.environ else FEW[:5]
# Of scenes with all of the schema some dozens are enough unless more are asked for.
WIDE = BLOCKS if "FUZZ_CASES" in os.environ else BLOCKS[:2]
WORLD = MPI.COMM_WORLD


# What may end a run of a sound scene: couplings and laws that hold for short steps, or while
# contact lasts; each says when, where, and what to do.
MAY_STOP = (
    "line and pantographs do not agree",
    "the contact force grows beyond all bounds",
    "the fixed-point correction does not converge",
    "the fixed-point correction diverges",
    "would have to pull",
    "it was thrown off the wire",
    "finds no solution within",
)

# What form finding says of droppers that cannot be.
NOT_AT_REST = (
    "would be slack at",
    "would have a length of",
    "has no static equilibrium",
    "above its place at the installation",
    "is periodic, which repeats",
    "is periodic, but this line cannot go on",
    "which is steeper than 60 degrees",
)

# Effects under which incidents change the rest that matrices are about.
PLANES = ("axial_motion", "lateral_motion")

# What an incident may leave of a line whose rest is that of a potential energy.
UNSTABLE = "after an incident the line at rest is unstable near"
NO_REST_LEFT = "after an incident the line has no static equilibrium"

# Of these, what counts as a step whose equations were not solved.
UNSOLVED = ("do not agree", "does not converge", "correction diverges", "finds no solution")


def replay(seed: int, assignments: tuple[str, ...]) -> str:
    return f"FUZZ_SEED={seed} FUZZ_CASES=1 replays it: {' '.join(assignments)}"


@pytest.mark.parametrize("seeds", BLOCKS, ids=str)
def test_sound_scenes_run(seeds: range) -> None:
    hung = 0
    for seed in seeds:
        made = sound_scene(seed)
        try:
            hung += check_run(made.assignments)
        except (Exception, AssertionError) as error:
            raise AssertionError(replay(seed, made.assignments)) from error
    print(f"{hung} of {len(seeds)} lines hang on all their droppers and were run")
    assert hung >= len(seeds) // 2


@pytest.mark.skipif(WORLD.size > 1, reason="processes of their own: test_fuzz_processes")
@pytest.mark.parametrize("seeds", WIDE, ids=str)
def test_wide_scenes_run_or_say_why_not(seeds: range) -> None:
    """All of the schema: strips, rolling heads, moving bases, mechanisms, laws, couplings."""
    ends = {"done": 0, "slack at rest": 0, "stopped": 0}
    for seed in seeds:
        made = wide_scene(seed)
        try:
            ends[check_wide(made)] += 1
        except (Exception, AssertionError) as error:
            raise AssertionError(replay(seed, made.assignments)) from error
    print(ends)
    # Two in a hundred are slack at rest, one in six has a law or coupling that its step breaks.
    assert ends["done"] >= len(seeds) // 2


@pytest.mark.skipif(WORLD.size > 1, reason="processes of their own: test_fuzz_processes")
@pytest.mark.parametrize("seeds", TOPOLOGIES, ids=str)
@pytest.mark.study
def test_scenes_of_any_topology_run_or_say_why_not(seeds: range) -> None:
    """Wires, clamps and sections in any combination: done, or one sentence."""
    ends = {"done": 0, "slack at rest": 0, "stopped": 0, "refused": 0}
    for seed in seeds:
        made = topology_scene(seed)
        try:
            ends[check_topology(made)] += 1
        except (Exception, AssertionError) as error:
            raise AssertionError(replay(seed, made.assignments)) from error
    print(ends)
    # Some half of them are done; others take schemes that do not converge on stiff contacts. That
    # none of five is done would be chance once in thirty, which hundreds of blocks do meet.
    assert ends["done"] >= max(1, len(seeds) // 4) or "FUZZ_CASES" in os.environ


@pytest.mark.skipif(WORLD.size > 1, reason="processes of their own: test_fuzz_processes")
def test_a_dropper_that_is_neither_taut_nor_slack_does_not_end_a_run() -> None:
    """An auxiliary wire's short droppers, leaning in a level curve, under light heads at steps of
    8 ms: in one of them no set of slack droppers fits."""
    made = topology_scene(30280)
    level = [*made.assignments, "line.curve.cant_mm=0"]
    rest = hard_runs.at_rest(load_scene(made.base, level), MPI.COMM_SELF)
    run = hard_runs.run(rest, MPI.COMM_SELF)
    assert run.outcome == "done" and run.counters["pivoted_steps"] > 0


@pytest.mark.skipif(WORLD.size > 1, reason="processes of their own: test_fuzz_processes")
@pytest.mark.parametrize("seeds", BLOCKS, ids=str)
def test_twin_wires_move_as_one_as_they_do_apart(seeds: range) -> None:
    """In 40 steps, which leave few hops for round-off to grow by; see `check_twins`."""
    hung = 0
    for seed in seeds:
        made = twin_scene(seed, 40)
        try:
            hung += check_twins(made.assignments)
        except (Exception, AssertionError) as error:
            raise AssertionError(replay(seed, made.assignments)) from error
    assert hung >= len(seeds) // 2


def check_twins(assignments: tuple[str, ...]) -> bool:
    """Forces and energies with and without relative motion agree as well as the scene lets them,
    see `nudged`; False as in `check_run`."""
    apart_, together = (
        (*assignments, f"effects.relative_motion={relative}") for relative in ("true", "false")
    )
    found = []
    for given in (apart_, together):
        try:
            rest = hard_runs.at_rest(load_scene(BASE, given), MPI.COMM_SELF)
        except InputError as error:
            assert any(words in str(error) for words in NOT_AT_REST) and "\n" not in str(error)
            return False
        found.append(hard_runs.run(rest, MPI.COMM_SELF, with_work=True))
    apart, one = found
    assert apart.outcome == one.outcome == "done"
    beside: RunHistories | None = None
    for what in ("force", "on_wires", "energy"):
        expected, values = getattr(apart, what), getattr(one, what)
        off = np.abs(values - expected).max()
        usual = 1e-8 * max(np.abs(expected).max(), 1e-3)
        if off > usual:
            beside = beside or hard_runs.run(nudged(apart_), MPI.COMM_SELF, with_work=True)
            assert off <= usual + 100 * np.abs(getattr(beside, what) - expected).max()
    if not one.switches().any():
        assert one.energy_gain() < 1e-9
    return True


def check_topology(made: RandomScene) -> str:
    """How the run ended, see `check_wide`, or that parts were refused in a sentence."""
    return "refused" if is_refused(made) else check_wide(made)


def is_refused(made: RandomScene) -> bool:
    """Whether a scene is refused, in one sentence."""
    try:
        load_scene(made.base, made.assignments)
    except InputError as error:
        sentence = str(error)
        assert sentence and "\n" not in sentence and len(sentence) < 1500, sentence
        return True
    return False


def check_wide(made: RandomScene) -> str:
    """How the run ended: done, finite and balanced, or stopped by what may stop it, in words."""
    scene = load_scene(made.base, made.assignments)
    try:
        rest = hard_runs.at_rest(scene, MPI.COMM_SELF)
    except InputError as error:
        assert any(words in str(error) for words in NOT_AT_REST) and "\n" not in str(error)
        return "slack at rest"
    try:
        run = hard_runs.run(rest, MPI.COMM_SELF, with_work=True)
    except InputError as error:
        assert "does not let it be stepped by stations" in str(error) and "\n" not in str(error)
        return "slack at rest"
    assert run.all_finite
    numerics = scene.numerics
    if run.outcome != "done":
        check_end(scene, run)
        return "stopped"
    assert run.time.size == N_STEPS + 1
    # The work of a pantograph's force is that of one strip. With numerical damping the balance is
    # that of a line without incidents. Work in halved steps is not seen, nor that of gusts.
    excess, more = numerics.newmark_gamma - 0.5, numerics.newmark_beta - numerics.newmark_gamma / 2
    newmark = numerics.integrator == "newmark" and more <= 4.0 * excess**2
    newmark = newmark and (excess == 0.0 or not rest.problem.incidents)
    strips = max(scene.pantographs[p.name].strips.number for p in scene.train.pantographs)
    balanced = newmark and strips == 1 and numerics.adaptive_tolerance_N is None
    if balanced and not switches_by_itself(rest, run):
        # In other planes matrices are about the rest that the changed line comes to, so that an
        # incident may add to the energy of a line that has not come to the rest before.
        planes = any(scene.switches()[name] for name in PLANES)
        if "periodic" in (scene.line.ends.start.kind, scene.line.ends.end.kind):
            # The spans beyond an end store energy and return some of it, but never make any.
            balance = run.energy - run.work + (run.terms if run.terms.size else 0.0)
            assert balance.max() - balance[0] < 1e-9 * run.energy_scale()
        else:
            assert run.energy_gain(run.kept if planes else ()) < 1e-9
    return "done"


def check_end(scene: Scene, run: RunHistories) -> None:
    """A run that stopped was one that may, says time, place and remedy, and was counted."""
    numerics = scene.numerics
    if NO_REST_LEFT in run.outcome:
        # A wire that keeps some hundredths of its tension hangs slack.
        assert any(scene.switches()[name] for name in PLANES)
        assert "wires may be slack there" in run.outcome and "\n" not in run.outcome
        return
    if UNSTABLE in run.outcome:
        # Arms that less tension leaves to the wind fold over.
        assert scene.switches()["lateral_motion"] and "; take less wind" in run.outcome
        return
    assert (
        numerics.scheme == "fixed_point"
        or numerics.coupling in ("iterated", "explicit")
        or scene.contact.law == "kinematic"
    ), run.outcome
    assert any(words in run.outcome for words in MAY_STOP), run.outcome
    assert all(words in run.outcome for words in ("t = ", "with the train at ", "; take "))
    unsolved = any(words in run.outcome for words in UNSOLVED)
    assert run.counters["unconverged_steps"] == unsolved or numerics.iterations is not None


def switches_by_itself(rest: hard_runs.LineAtRest, run: RunHistories) -> bool:
    """Whether a dropper slackens or tightens, other than by breaking, or an uplift stop is met."""
    if run.stops.any():
        return True
    switched = run.taut[1:] != run.taut[:-1]
    for incident in rest.problem.incidents:
        if isinstance(incident, DropperBreak) and "dropper_break" in rest.problem.effects:
            step = round(incident.time / rest.problem.numerics.dt)
            switched[step:, rest.model.droppers_at([incident.place])] = False
    return bool(switched.any())


def check_run(assignments: tuple[str, ...]) -> bool:
    """Everything is finite, and the line holds no more energy than was given to it.

    False if the line is one whose droppers cannot all be tight, which is told as bad input: where
    they may hang at random, a few in a hundred are.
    """
    scene = load_scene(BASE, assignments)
    try:
        rest = hard_runs.at_rest(scene, WORLD)
    except InputError as error:
        assert "would be slack at rest" in str(error) and "\n" not in str(error)
        return False
    run = on_root(WORLD, lambda: hard_runs.run(rest, MPI.COMM_SELF, with_work=True))
    assert run.outcome == "done"
    # The run's length has half a step to spare for round-off.
    assert run.time.size == N_STEPS + 1
    assert run.all_finite
    gain = run.energy_gain()
    if not run.switches().any():
        # Average acceleration takes from its balance what damping takes, and nothing else; sums
        # of 200 products of forces with differences of displacements have lost six digits.
        assert gain < 1e-9
    if WORLD.size > 1:
        check_ranks(assignments, rest, run)
    return True


def nudged(assignments: tuple[str, ...]) -> hard_runs.LineAtRest:
    """The scene at rest with a static force that differs in the 12th digit.

    A head that hops on a stiff contact without damping is chaotic, and multiplies round-off with
    each hop: what this difference makes says by how much.
    """
    force = load_scene(BASE, assignments).pantographs["reference"].static_force_N
    assert force is not None
    words = [*assignments, f"pantographs.reference.static_force_N={force * (1 + 1e-12)!r}"]
    return hard_runs.at_rest(load_scene(BASE, words), WORLD)


def check_ranks(assignments: tuple[str, ...], rest: Any, run: Any) -> None:
    """Ranks agree as well as the scene lets them, see `nudged`. Fails on all ranks or on none."""
    together = hard_runs.run(rest, WORLD)
    beside = nudged(assignments)
    other = on_root(WORLD, lambda: hard_runs.run(beside, MPI.COMM_SELF, with_work=True))
    apart = WORLD.bcast(float(np.abs(together.force - run.force).max()))
    sensitive = float(np.abs(other.force - run.force).max())
    assert apart <= 1e-6 * max(np.abs(run.force).max(), 1.0) + 100 * sensitive


@pytest.mark.skipif(WORLD.size > 1, reason="what all ranks make of it: test_cli_under_mpirun")
@pytest.mark.parametrize("seeds", BLOCKS, ids=str)
def test_broken_scenes_of_any_topology_are_refused(seeds: range) -> None:
    """Nonsense in any key; one of the sentences names it, if there are some."""
    for seed in seeds:
        made = broken_topology(seed)
        told = f"{made.broken_by} in {replay(seed, made.assignments)}"
        try:
            load_scene(made.base, made.assignments)
        except InputError as error:
            faults = error.faults if isinstance(error, SceneError) else []
            sentences = [str(error), *(fault.sentence for fault in faults)]
            assert all(one and "\n" not in one and len(one) < 1500 for one in sentences), told
            named = any(made.names in one for one in sentences)
            assert named or is_refused(topology_scene(seed)), (told, sentences)
        except Exception as error:
            raise AssertionError(told) from error
        else:
            raise AssertionError(f"taken: {told}")
