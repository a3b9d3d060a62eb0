"""Variants: how keys are varied, products, names of folders, files; words after ``--vary``."""

from __future__ import annotations

import unicodedata
from pathlib import Path

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from verb_runner import invoke

from catenary import InputError
from catenary.cases.cli.app import each_varied
from catenary.cases.studies.sweep.variants import (
    Variant,
    check_keys,
    parse_vary,
    product,
    read_named,
    slug,
)

# --- variants -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("a.b=1,2,3", ("1", "2", "3")),
        ("a.b= 1 , 2 ", ("1", "2")),
        ("a.b=[1,2],[3]", ("[1,2]", "[3]")),
        ('a.b="x,y",z', ('"x,y"', "z")),
        ('a.b=[{n="l"},{n="l",d=2}],[]', ('[{n="l"},{n="l",d=2}]', "[]")),
        ("a.b=1", ("1",)),
    ],
)
def test_values_are_cut_at_outer_commas(text: str, values: tuple[str, ...]) -> None:
    assert parse_vary(text) == ("a.b", values)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("a.b", "must have the form"),
        ("a.b=", "must have the form"),
        ("=1,2", "must have the form"),
        ("a.b=1,,2", "must have the form"),
        ("a.b=1,2,1", "names 1 twice"),
        ("a.b=200,2,2e2", "names 2e2 after 200, which is the same"),
        ("petsc.ksp_type=cg,gmres", "when the program starts"),
    ],
)
def test_what_is_no_variation_is_told(text: str, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        parse_vary(text)


def test_a_product_has_every_combination_once_and_the_last_key_is_fastest() -> None:
    variants = product([parse_vary("a.x=1,2"), parse_vary("b.y=3,4,5")], {})
    assert [v.name for v in variants] == [
        "x_1__y_3", "x_1__y_4", "x_1__y_5", "x_2__y_3", "x_2__y_4", "x_2__y_5",
    ]  # fmt: skip
    assert variants[3].assignments == ("a.x=2", "b.y=3")
    assert variants[3].varied == {"a.x": "2", "b.y": "3"}


def test_named_variants_come_before_the_varied_keys_that_win() -> None:
    variants = product([parse_vary("a.x=1,2")], {"soft": ["c.k=1"], "hard": ["c.k=9", "c.d=0"]})
    assert [v.name for v in variants] == ["soft__x_1", "soft__x_2", "hard__x_1", "hard__x_2"]
    assert variants[2].assignments == ("c.k=9", "c.d=0", "a.x=1")
    assert (variants[2].varied, variants[2].named) == ({"a.x": "1"}, "hard")
    assert product([], {"only": ["c.k=1"]}) == [Variant("only", ("c.k=1",), {})]


def test_keys_that_share_their_last_part_are_told_apart() -> None:
    (variant,) = product([parse_vary("one.t=1"), parse_vary("two.t=1")], {})
    assert variant.name == "one.t_1__two.t_1"
    (of_an_entry,) = product([parse_vary("head.masses_kg.0=7.2")], {})
    assert of_an_entry.name == "masses_kg.0_7.2"


def test_values_that_make_the_same_folder_get_two() -> None:
    names = [v.name for v in product([parse_vary('a.x="b/c","b c","B-C"')], {})]
    assert len({name.lower() for name in names}) == 3


@pytest.mark.parametrize(
    ("texts", "sentence"),
    [
        (["a.x=1,2", "a.x=3"], "given twice"),
        ([f"a.x{i}=" + ",".join(str(j) for j in range(10)) for i in range(5)], "100000 runs"),
    ],
)
def test_impossible_products_are_told(texts: list[str], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        product([parse_vary(text) for text in texts], {})


@given(st.text(max_size=300))
def test_every_text_makes_a_folder_name(text: str) -> None:
    name = slug(text)
    assert 0 < len(name.encode()) <= 100
    assert all(one in "._-" or unicodedata.category(one)[0] in "LMN" for one in name)
    assert name not in (".", "..") and slug(name) == name


def test_names_keep_letters_of_all_scripts() -> None:
    """They kept those of English: variants "Stütz" and "Stätz" were "St-tz" and "St-tz-2"."""
    table = {"Stützpunkt": [], "Stätz": [], "пролёт": [], "スパン": [], "अवधि": []}
    assert [one.name for one in product([], table)] == list(table)
    assert slug("u\N{COMBINING DIAERESIS}ber 5 °C, \u202eλ/2") == "über-5-C-λ-2"
    (cut,) = product([], {200 * "я": []})
    assert cut.name.startswith(45 * "я" + "-")


def test_long_names_that_differ_at_their_end_stay_apart() -> None:
    assert slug("x" * 200 + "a") != slug("x" * 200 + "b")


def test_named_variants_are_read_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "variants.toml"
    path.write_text('soft = ["contact.stiffness_N_per_m=1e4"]\nbase = []\n')
    assert read_named(path) == {"soft": ["contact.stiffness_N_per_m=1e4"], "base": []}


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "names no variant"),
        ("soft = 3\n", "soft in .* must be a list of assignments"),
        ("soft = [3]\n", "soft in .* must be a list of assignments"),
        ("[soft]\nx = 1\n", "soft in .* must be a list of assignments"),
        ("soft = [\n", "not valid TOML"),
    ],
)
def test_other_files_are_told(text: str, sentence: str, tmp_path: Path) -> None:
    path = tmp_path / "variants.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence):
        read_named(path)


def test_an_unknown_key_brings_the_nearest_one() -> None:
    with pytest.raises(InputError, match=r"did you mean train\.speed_km_h"):
        check_keys([Variant("v", ("train.sped_km_h=300",))], "on the command line (--vary)")
    # The table in which it stands would be no help.
    with pytest.raises(InputError, match="numerics.n .* is unknown; see `catenary list --keys`"):
        check_keys([Variant("v", ("numerics.n=3",))], "on the command line (--vary)")


# --- words after ``--vary`` -----------------------------------------------------------------------


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
