"""Words after ``--vary``: those with several values are varied, others are assignments."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from verb_runner import invoke

from catenary.cases.cli.app import each_varied

CASE = "en50318_2002"
SPEEDS, LAWS = "train.speed_km_h=200,250", "contact.stiffness_N_per_m=2e4,5e4"
MASSES = "pantographs.reference.masses_kg"
STEP = "numerics.dt_s=0.004"


@pytest.mark.parametrize(
    ("words", "varied"),
    [
        ("--vary a=1,2 b=3,4", "--vary a=1,2 --vary b=3,4"),
        ("--vary=a=1,2 b=3,4", "--vary=a=1,2 --vary b=3,4"),
        ("--vary a=1,2 c=5 b=3,4 d=6", "--vary a=1,2 c=5 --vary b=3,4 d=6"),
        ("--vary a=1,2 --vary b=3,4 c=5,6", "--vary a=1,2 --vary b=3,4 --vary c=5,6"),
        ("--vary a=1 b=3,4 --short -o out", "--vary a=1 --vary b=3,4 --short -o out"),
        # a value in brackets or quotes is one
        ("--vary a=1,2 b=[3,4] c='x,y'", None),
        ("--vary a=1,2 b=[3,4],[5,6]", "--vary a=1,2 --vary b=[3,4],[5,6]"),
        # words of another option, of none, and for PETSc
        ("--vary a=1,2 --set b=3,4", None),
        ("--set b=3 c=4,5 --vary a=1,2", None),
        ("b=3,4 --vary a=1,2", None),
        ("--vary a=1,2 -o out b=3,4", None),
        ("--vary a=1,2 -- b=3,4", None),
        # a value of --vary, and what is no key with a value
        ("--vary --set b=3,4", "--vary --set --vary b=3,4"),
        ("--vary a=1,2 b,c", None),
        ("--variants a b=3,4", None),
    ],
)
def test_words_belong_to_the_option_before_them(words: str, varied: str | None) -> None:
    assert each_varied(words.split()) == (words if varied is None else varied).split()


def test_all_combinations_of_keys_after_one_option_are_run(tmp_path: Path) -> None:
    words = ["sweep", CASE, "--short", "--only-statistics"]

    def swept(name: str, *more: str) -> pd.DataFrame:
        done = invoke(*words, "-o", str(tmp_path / name), *more)
        assert done.exit_code == 0, done.output
        return pd.read_csv(tmp_path / name / "sweep.csv").drop(columns="wall_s", errors="ignore")

    found = swept("one", "--vary", SPEEDS, LAWS, STEP)
    assert len(found) == 4 and (found.outcome == "done").all()
    pd.testing.assert_frame_equal(
        found, swept("each", "--vary", SPEEDS, "--vary", LAWS, "--set", STEP)
    )


def test_submitted_sweeps_vary_them_too(tmp_path: Path) -> None:
    words = ["submit", CASE, "--short", "-o", str(tmp_path / "out"), "--array", "4", "--print"]
    done = invoke(*words, "--vary", SPEEDS, LAWS, STEP)
    assert done.exit_code == 0, done.output
    assert f"--set {STEP}" in done.output
    assert f"--vary {SPEEDS} --vary {LAWS}" in done.output


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--vary", SPEEDS, "contact.stifness_N_per_m=2e4,5e4"], "line (--vary) is unknown"),
        (["--vary", SPEEDS, "contact.stiffness_N_per_m=2e4,"], '--vary "contact.stiffness_N_per'),
        (["--vary", SPEEDS, SPEEDS], "--vary train.speed_km_h is given twice"),
        (
            ["--vary", f"{MASSES}.1=15,16", f"{MASSES}=[7,15],[8,15]"],
            f"--vary {MASSES} sets {MASSES}.1 again",
        ),
        (["--vary", SPEEDS, "--set", LAWS], "on the command line (--set)"),
    ],
)
def test_refusals_name_the_option(words: list[str], told: str, tmp_path: Path) -> None:
    done = invoke("sweep", CASE, "-o", str(tmp_path / "out"), *words)
    assert done.exit_code == 2 and told in done.stderr, done.output


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("run CASE -o out -options_view", "-options_view is no option of run: those of PETSc"),
        ("run CASE -o out -log_view :log", "-log_view is no option of run: those of PETSc"),
        ("restart out --set train.end_m=800", "--set belongs to `catenary run`"),
        ("worst out --set=train.end_m=800", "--set belongs to `catenary run`"),
    ],
)
def test_options_in_a_wrong_place_are_told_where_they_belong(
    words: str, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = invoke(*words.replace("CASE", CASE).split())
    assert done.exit_code == 2 and says in done.output, done.output
    assert list(tmp_path.iterdir()) == []


def test_a_variant_keeps_what_it_sets(tmp_path: Path) -> None:
    """A key that a variant sets and that varies, too, would be lost; a part of it is set behind."""
    (tmp_path / "variants.toml").write_text(f'light = ["{MASSES}=[6.0, 15.0]"]\n')
    words = ["sweep", CASE, "--short", "-o", str(tmp_path / "out"), "--only-statistics"]
    words += ["--variants", str(tmp_path / "variants.toml"), "--vary"]
    refused = invoke(*words, f"{MASSES}=[7,15],[8,15]")
    assert refused.exit_code == 2
    assert f"--vary {MASSES} sets the {MASSES} of variant light again" in refused.output
    done = invoke(*words, f"{MASSES}.1=14,16")
    assert done.exit_code == 0, done.output
    assert pd.read_csv(tmp_path / "out" / "sweep.csv").std_N.nunique() == 2
