"""The prediction for many ranks: its formula, its messages, what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from mpi4py import MPI
from program import MPIRUN, catenary
from scenes import load_scene
from verb_runner import invoke

from catenary.cases.run import cluster
from catenary.cases.run.cluster import Sizes, Wire, Work, march_on, predict
from catenary.cases.run.plan import make_plan
from catenary.cases.scene.scene import problem_of
from catenary.cases.studies import scaling
from catenary.cases.studies.scaling import as_text
from catenary.solver.contact_problem.force_exchange import Exchange, LineResponse
from catenary.solver.kernels import native

WIRE = Wire(2e-6, 1e-10)
# 1000 spans of 100 unknowns, 10 ns each, and 20 us whatever the line.
WORK = Work(100_000, 1000, 1020e-6, 20e-6, Sizes(800, 64, 552))


def test_a_step_on_many_ranks_is_the_line_shared_out_and_messages() -> None:
    found = predict(WORK, WIRE, 64)
    assert found.line == pytest.approx(1e-8 * (100_000 / 64 + 200))
    assert found.neighbours == pytest.approx(2 * (2e-6 + 800e-10))
    assert found.tree == pytest.approx(6 * (4e-6 + 616e-10))
    assert found.step == pytest.approx(
        found.line + found.neighbours + found.tree + 20e-6 + cluster._ONE_BY_ONE
    )
    alone = predict(WORK, WIRE, 1)
    assert alone.step == pytest.approx(WORK.step) and alone.messages == 0.0


def test_messages_are_as_long_as_those_of_a_march() -> None:
    """Of the exchange of a step with one contact and with two."""
    for n, more in ((1, ""), (2, ",{name='lumped',behind_m=30}")):
        words = [f"train.pantographs=[{{name='lumped'}}{more}]", "train.start_m=200"]
        sizes = cluster.work_of(load_scene("ambrosio2012", words)).sizes
        bounds = native.Bounds(*LineResponse(n, 1).bounds)
        exchange = Exchange(MPI.COMM_SELF, n, False, bounds)
        assert sizes.share == exchange.share.summed.nbytes
        assert sizes.reply == exchange._answer.nbytes


def test_ranks_shorten_the_march_of_a_long_line_alone() -> None:
    def gain(ranks: int, *words: str) -> float:
        scene = load_scene("ambrosio2012", list(words))
        plan = make_plan(scene)
        return plan.needs.march / march_on(
            problem_of(scene), plan.needs, int(plan.figures["n_unknowns"]), ranks
        )

    assert gain(1, "line.n_spans=2000") == gain(64, "line.n_spans=2000", "window.mode=bounded") == 1
    assert 8 < gain(64, "line.n_spans=2000") < 64
    assert gain(64, "line.n_spans=25") < 1


def test_one_rank_exchanges_nothing_and_times_nothing() -> None:
    assert scaling.wire_between(MPI.COMM_SELF) is None
    fastest, half = scaling.time_of_exchange(MPI.COMM_SELF, WORK.sizes)
    assert 0.0 < fastest <= half < 1e-3
    text = as_text(WORK, WIRE, [1, 64], False, None)
    assert "as given" in text and text.splitlines()[4].endswith(" 100") and "measured" not in text


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ([], "on one rank no message can be timed"),
        (["--latency-us", "2"], "belong together"),
        (["--latency-us", "0", "--bandwidth-GB-per-s", "10"], "must be above 0"),
        (["--ranks", "0,4"], "--ranks 0,4 must be whole numbers"),
        (["--ranks", "4,4"], "each once"),
        (["--ranks", "64,"], "e.g. 64,512,4096"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(words: list[str], says: str) -> None:
    done = invoke("scaling", "ambrosio2012", *words)
    assert done.exit_code == 2 and says in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.study
@pytest.mark.process
@pytest.mark.skipif(MPIRUN is None, reason="there is no mpirun")
def test_ranks_time_their_messages_and_one_tells(tmp_path: Path) -> None:
    done = catenary("scaling", "ambrosio2012", "--ranks", "2,64", cwd=tmp_path, ranks=3)
    assert done.code == 0, done.stderr
    assert "between ranks 0 and 1 of this machine" in done.stdout
    assert done.stdout.count("on the 3 ranks that there are") == 1
