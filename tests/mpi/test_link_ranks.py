"""Stops and leaning links give the same march on one rank and on all ranks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import registered
from mpi4py import MPI
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train
from stops import LEANING_LINKS, STOP_FORCE, UPLIFT_STOP

from catenary.solver.model.partition import distribute
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.observers import Observer, Stage, StepView

COMM = MPI.COMM_WORLD


class Seen(Observer):
    """Keeps this rank's columns of three channels."""

    def __init__(self) -> None:
        self.rows: list[tuple[np.ndarray, ...]] = []

    def start(self, stage: Stage) -> None:
        self.owned = stage.owned_droppers, stage.owned_arms

    def next_state(self, step: int) -> int:
        return step + 1

    def observe(self, view: StepView) -> None:
        stops = view.further_stop_force  # type: ignore[attr-defined]
        self.rows.append((view.contact_force.copy(), view.dropper_force.copy(), stops.copy()))

    def finish(self, outcome: str) -> None:
        assert outcome == "done"


def run(comm: MPI.Comm, rest: LineAtRest) -> list[np.ndarray]:
    seen = Seen()
    with March(comm, *rest) as march:
        march.run([seen])
    force, droppers, stops = (np.array(rows) for rows in zip(*seen.rows, strict=True))
    return [force, droppers, stops, *seen.owned]


def test_links_act_the_same_on_any_number_of_ranks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(channels.CHANNELS, STOP_FORCE.name, STOP_FORCE)
    run_of = train(80.0, 6.0, 66.0, static_force=260.0, raise_time=0.0, nominal_height=5.5)
    places = (4.0, 12.0, 20.0)
    line = replace(
        en50318_line(3),
        span_lengths=(24.0,) * 3,
        dropper_positions=(places,) * 3,
        pre_sag=((0.0,) * 3,) * 3,
        stagger=(0.0,) * 4,
    )
    with registered(UPLIFT_STOP), registered(LEANING_LINKS):
        problem = problem_of(
            line,
            WHOLE | {"uplift_stop", "leaning_links"},
            train=replace(run_of, start_below=0.02),
            numerics=numerics(1e-3),
        )
        rest = line_at_rest(problem, mesh_of(line, 2))
        together, alone = run(COMM, rest), run(MPI.COMM_SELF, rest)
        # No cut separates what a link joins.
        cuts = distribute(rest.model, COMM.size, 0).bounds[1:-1]
        for links in rest.model.links:
            low = links.direction.unknowns.min(axis=1)[:, None]
            high = links.direction.unknowns.max(axis=1)[:, None]
            assert not ((low < cuts) & (cuts <= high)).any()
    assert (alone[2] > 0.0).any(axis=0).all()
    largest = alone[1].max()
    if COMM.rank == 0:
        assert np.abs(together[0] - alone[0]).max() < 1e-9 * largest
    for name, owned in ((1, 3), (2, 4)):
        difference = together[name] - alone[name][:, together[owned]]
        assert np.abs(difference).max(initial=0.0) < 1e-9 * largest
