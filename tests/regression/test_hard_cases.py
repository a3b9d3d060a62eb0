"""The collection of hard cases on one rank, and some in their short form on two."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from mpi4py import MPI
from program import MPIRUN, catenary

from catenary import InputError
from catenary.cases.studies.hard import cases
from catenary.cases.studies.hard.cases import HardCase, hard_cases
from catenary.cases.studies.hard.checks import check_cases

pytestmark = pytest.mark.study

# What the parallel solve and the coupling meet: stiff contact, several heads, switches at a cut,
# lines that change on the way.
IN_PARALLEL = (
    "speed_1.0",
    "undamped_line",
    "rank_boundary",
    "four",
    "lost_over_spans",
    "dropper_breaks_at_a_cut",
    "all_at_once",
    "arm_at_its_stop",
)


@pytest.mark.parametrize("case", hard_cases(), ids=lambda case: case.name)
def test_a_hard_case_keeps_its_limits(case: HardCase) -> None:
    ((found, _),) = check_cases([case], MPI.COMM_SELF, short=False)
    for row in found:
        print(f"{row.name}: {row.value:.3g}, limit {row.limit:.3g} {row.note}")
    assert [row.name for row in found if not row.passed] == []


def table(folder: Path) -> list[dict[str, str]]:
    with (folder / "hard.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.skipif(MPIRUN is None, reason="there is no mpirun")
def test_ranks_agree_on_hard_cases(tmp_path: Path) -> None:
    done = catenary(
        "hard", *IN_PARALLEL, "--short", "-o", str(tmp_path / "out"), cwd=tmp_path, ranks=2
    )
    assert done.code == 0, done.stdout + done.stderr
    rows = table(tmp_path / "out")
    assert {row["kept"] for row in rows if row["criterion"] != "remarks"} == {"yes"}
    compared = [row["case"] for row in rows if row["criterion"] == "1 and 2 ranks, relative"]
    assert compared == list(IN_PARALLEL)


def test_patterns_choose_hard_cases_in_the_order_of_the_words() -> None:
    found = [case.name for case in hard_cases(["four", "twin_messenger_*", "twin_*_head", "four"])]
    assert found[0] == "four"
    assert found[1:] == [
        case.name for case in hard_cases() if case.name.startswith("twin_messenger_")
    ] + ["twin_light_head"]


def test_names_and_folders_that_cannot_be_are_refused(tmp_path: Path) -> None:
    (tmp_path / "hard.csv").write_text("mine")
    for words, said in (
        (["no_such"], 'there is no hard case "no_such"; there are speed_0.7, '),
        (["twin_undampt"], '"twin_undampt"; did you mean twin_undamped or '),
        (["undamped_line", "-o", str(tmp_path)], "is there already"),
    ):
        done = catenary("hard", *words, cwd=tmp_path)
        assert done.code == 2
        (sentence,) = done.sentences
        assert said in sentence
    assert (tmp_path / "hard.csv").read_text() == "mine"


@pytest.mark.parametrize(
    ("sets", "chain"),
    [
        ('a = ["a"]', "a > a"),
        ('a = ["b"]\nb = ["numerics.dt_s=1e-3", "c"]\nc = ["b"]', "b > c > b"),
    ],
)
def test_sets_that_name_themselves_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sets: str, chain: str
) -> None:
    table = tmp_path / "hard.toml"
    case = '[[cases]]\nname = "one"\nwhat = "hard"\nright = "well"'
    table.write_text(f'base = "ac_simple"\ncommon = []\n[sets]\n{sets}\n{case}\n')
    monkeypatch.setattr(cases, "TABLE", table)
    with pytest.raises(InputError, match=rf"hard.toml has a set .* names itself \({chain}\)"):
        cases.collection.__wrapped__()
