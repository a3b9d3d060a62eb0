"""Which links have a row in the small problem: all that forces within the bounds may switch."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from mpi4py import MPI
from scenes import load_scene, mesh_of, problem_of

from catenary.solver.schemes.scheme import OneSolve
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop.march import March

# A stiff wire, which goes down between the droppers beside the one that the head lifts after the
# first, long step. Each wire has a contact with the head.
DT = 8e-3
WORDS = [
    "line.n_spans=6", "line.dropper.stiffness_N_per_m=1e5", f"numerics.dt_s={DT}",
    "line.contact_wire.bending_stiffness_N_m2=1e5",
    "train.start_m=137", "train.end_m=150", "train.raise_time_s=0",
    "evaluation.from_m=140", "evaluation.to_m=145",
]  # fmt: skip
Rows = Callable[[tuple[float, float], float], list[int]]


@pytest.fixture
def rows(monkeypatch: pytest.MonkeyPatch) -> Iterator[Rows]:
    """Links with a row if contacts may push and pull so hard [N]."""
    schemes: list[OneSolve] = []
    make = OneSolve.__post_init__

    def made(self: OneSolve) -> None:
        make(self)
        schemes.append(self)

    monkeypatch.setattr(OneSolve, "__post_init__", made)
    scene = load_scene("dc_twin", WORDS)
    problem = problem_of(scene)
    with March(MPI.COMM_SELF, *line_at_rest(problem, mesh_of(scene))):
        (scheme,) = schemes
        scheme.begin(DT)
        respond = scheme.interaction.responder(scheme.share.arrays)

        def found(push: tuple[float, float], pull: float) -> list[int]:
            bounds = scheme.share.bounds
            bounds.push[:], bounds.pull[:], bounds.loss[:] = push, pull, 1e-6
            respond()
            return sorted(scheme.share.links.tolist())

        yield found


def least(has_rows: Callable[[float], bool]) -> float:
    """The least force [N] with which there are rows, to a thousandth."""
    low, high = 0.0, 1e6
    assert not has_rows(low) and has_rows(high)
    while high - low > 1e-3 * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if has_rows(middle) else (middle, high)
    return high


def test_contacts_that_push_at_once_are_added_up(rows: Rows) -> None:
    """Of two at one place each needs half of what one alone needs to slacken a dropper."""
    alone = least(lambda force: bool(rows((force, 0.0), 0.0)))
    together = least(lambda force: bool(rows((force, force), 0.0)))
    assert together == pytest.approx(0.5 * alone, rel=2e-3)
    assert rows((alone, alone), 0.0) == rows((2.0 * alone, 0.0), 0.0)


def test_contacts_that_pull_slacken_other_droppers(rows: Rows) -> None:
    pushed, pulled = rows((1e6, 0.0), 0.0), rows((0.0, 0.0), 1e6)
    assert pushed and pulled and not set(pushed) & set(pulled)
    assert rows((1e6, 0.0), 1e6) == sorted(pushed + pulled)
