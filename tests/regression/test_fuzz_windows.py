"""Random scenes of all topologies with a window that moves with the train, beside the whole line.

Each runs with all that a scene may have, or is refused in one sentence. FUZZ_SEED and FUZZ_WINDOWS
say where seeds begin and how many there are; `make fuzz` runs many.
"""

from __future__ import annotations

import os

import numpy as np
import pytest
from fuzzing import RandomScene, topology_scene
from scenes import Scene, load_scene, problem_of
from windowed import COMM, apart, largest, march, nudged

from catenary import InputError
from catenary.cases.studies.hard import runs as hard_runs
from catenary.cases.studies.hard.runs import RunHistories
from catenary.solver.linear import pieces
from catenary.solver.problem.problem import BOUNDED, EXACT, WindowChoice
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.window import moving_window
from catenary.solver.window.choice import why_no_window

pytestmark = pytest.mark.study

FIRST = int(os.environ.get("FUZZ_SEED", "1"))
CASES = int(os.environ.get("FUZZ_WINDOWS", "20"))
SEEDS = range(FIRST, FIRST + CASES)
# Spans of lines that are longer than what a train of a random scene runs on.
SPANS = 14
# What sums in another order make of 1e-16 in 200 steps; scenes in which round-off grows to more say
# so themselves: a head that hops on a stiff contact without damping is chaotic.
ROUND_OFF, TELLING = 1e-9, 1e-3
# What makes lists of as many numbers as there are spans or masts.
_BY_SPAN = ("line.span_m=[", "line.stagger_m=[", "line.dropper.patterns", "line.messenger_stagger")
_ENDS = ("line.ends.", "line.n_spans=", "window.")


def long_scene(seed: int) -> RandomScene:
    """A random scene whose line goes on for many spans beyond the train, without a window."""
    made = topology_scene(seed)
    kept = [word for word in made.assignments if not word.startswith("window.")]
    if not any(made.assigns(word) for word in _BY_SPAN):
        kept = [word for word in kept if not word.startswith(_ENDS)]
        kept.append(f"line.n_spans={SPANS}")
    return RandomScene(seed, tuple(kept), base=made.base)


def loaded(made: RandomScene, *more: str) -> Scene | None:
    """The scene, None if its parts do not go together."""
    try:
        return load_scene(made.base, (*made.assignments, *more))
    except InputError as error:
        sentence = str(error)
        assert sentence and "\n" not in sentence, sentence
        return None


def hung(scene: Scene) -> LineAtRest | None:
    """Its line at rest, None if a dropper would be slack there."""
    try:
        return hard_runs.at_rest(scene, COMM)
    except InputError:
        return None


@pytest.mark.parametrize("seed", SEEDS)
def test_windows_give_what_the_whole_line_gives_or_say_why_not(
    seed: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    made = long_scene(seed)
    told = f"FUZZ_SEED={seed} FUZZ_WINDOWS=1 replays it: {' '.join(made.assignments)}"
    scene = loaded(made)
    rest = None if scene is None else hung(scene)
    if rest is None:
        pytest.skip("its parts do not go together, or droppers would be slack at rest")
    why = why_no_window(rest.problem)
    if why:
        with pytest.raises(InputError) as refused:
            load_scene(made.base, (*made.assignments, "window.mode=exact"))
        assert "window.mode" in str(refused.value) and "\n" not in str(refused.value), told
        return
    assert loaded(made, "window.mode=exact") is not None, told
    whole = march(rest)
    if whole.outcome != "done":
        pytest.skip(whole.outcome)
    sensitive = apart(march(nudged(rest)), whole)
    if 100.0 * sensitive > TELLING:
        pytest.skip("round-off alone makes another run of it")
    within = ROUND_OFF + 100.0 * sensitive
    if any("the model joins stations further apart" in one.getMessage() for one in caplog.records):
        with pytest.raises(InputError, match="does not let it be stepped by stations"):
            march(rest, WindowChoice(EXACT))
        return
    exact = march(rest, WindowChoice(EXACT))
    check_same("exact", exact, whole, within, told)
    if loaded(made, "window.mode=bounded", "window.spans_ahead=2", "window.spans_behind=2") is None:
        return
    window = problem_of(
        load_scene(
            made.base,
            (*made.assignments, "window.mode=bounded", "window.spans_ahead=2",
             "window.spans_behind=2"),
        )
    ).window  # fmt: skip
    assert window.mode == BOUNDED
    # Of pieces as small as can be, and of the whole line at once.
    monkeypatch.setattr(pieces, "_SIZE", 32)
    monkeypatch.setattr(moving_window, "_AROUND", 16)
    by_pieces = march(rest, window)
    monkeypatch.setattr(pieces.Pieces, "are_few", True)
    at_once = march(rest, window)
    check_same("pieces", by_pieces, at_once, within, told)
    # Waves of the start have not been anywhere yet, or a window of two spans would feel them.
    early = slice(0, 20)
    off = np.abs(at_once.force[early] - whole.force[early]).max() / largest(whole)
    print(f"seed {seed}: exact {apart(exact, whole):.1e}, pieces {apart(by_pieces, at_once):.1e}, "
          f"two spans {off:.1e} in 20 steps and {apart(at_once, whole):.1e} at last")  # fmt: skip


def check_same(
    what: str, found: RunHistories, expected: RunHistories, within: float, told: str
) -> None:
    assert found.outcome == expected.outcome, (what, found.outcome, expected.outcome, told)
    off = apart(found, expected)
    assert off <= within, (what, off, within, told)
