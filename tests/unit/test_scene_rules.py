"""Rule books in scenes: which judge, what is refused, and what a result file keeps of them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from scenes import Scene, load_scene, read_draft, recorded, resolved, scene_from
from verb_runner import invoke

from catenary import InputError
from catenary.cases.scene.input.faults import Origin
from catenary.cases.scene.run.case import LimitsTable, chosen_books, rule_entries
from catenary.postproc.standards.rule_books import LIMIT_KEYS

CASE = "en50318_2002"
OWN = """name = "mine"
title = "My rules"
[[criteria]]
id = "sigma"
title = "sigma"
quantity = "force_std"
relation = "<="
limit = { value = 30 }
"""


def scene(*overrides: str) -> Scene:
    return load_scene(CASE, overrides)


def books(of: Scene) -> list[str]:
    return [book.key for book in chosen_books(of.evaluation)]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a case that names a rule book beside it."""
    own = tmp_path / "case"
    own.mkdir()
    text = read_draft(CASE)
    assert text.folder is not None
    written = (text.folder / "case.toml").read_text(encoding="utf-8")
    written = written.replace("[evaluation]\n", '[evaluation]\nrules_file = "mine.toml"\n')
    (own / "case.toml").write_text(written, encoding="utf-8")
    (own / "mine.toml").write_text(OWN, encoding="utf-8")
    return own


@pytest.mark.parametrize(
    ("overrides", "expected"),
    [
        ([], ["en50367:2020"]),
        (["evaluation.edition=2006"], ["en50367:2006"]),
        (['evaluation.rules=["tsi_ene", "en50119"]'], ["tsi_ene:2023", "en50119:2020"]),
    ],
)
def test_books_that_judge(overrides: list[str], expected: list[str]) -> None:
    judged = scene(*overrides)
    assert books(judged) == expected
    # What a result keeps loads to the same, whatever is the newest edition by then.
    plain = resolved(judged)
    assert plain["evaluation"]["rules"] == expected and "edition" not in plain["evaluation"]
    assert (
        books(scene_from(json.loads(json.dumps(plain)), Origin("run.h5", recorded=True)))
        == expected
    )


def test_a_scene_of_an_earlier_version_keeps_its_edition() -> None:
    plain = resolved(scene())
    plain["evaluation"] = {"from_m": 360.0, "to_m": 600.0, "edition": "2006", "system": "ac"}
    assert books(scene_from(plain, Origin("run.h5", recorded=True))) == ["en50367:2006"]


def test_limits_have_the_keys_that_books_refer_to() -> None:
    assert list(LimitsTable.model_fields) == list(LIMIT_KEYS)
    given = scene('evaluation.rules=["line"]', "evaluation.limits.uplift_space_mm=200")
    assert given.evaluation.own_limits == {"uplift_space_mm": 200.0}
    assert scene().evaluation.own_limits == {}


def test_a_book_beside_the_case_judges_too(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder.parent)
    judged = load_scene(folder)
    assert books(judged) == ["en50367:2020", "mine"]
    assert books(load_scene(folder, ["evaluation.rules=[]"])) == ["mine"]
    # The result keeps the book itself, and does not change with the file.
    (folder / "mine.toml").unlink()
    assert rule_entries(judged.evaluation)[1]["criteria"][0]["limit"] == {"value": 30}  # type: ignore[index]
    assert books(recorded(judged)) == [
        "en50367:2020",
        "mine",
    ]


def test_a_variant_of_the_case_has_the_book(folder: Path) -> None:
    table = read_draft(folder).table()
    assert "rules_file" not in table["evaluation"]
    assert books(scene_from(table, Origin("a table"))) == ["en50367:2020", "mine"]


@pytest.mark.parametrize(
    "where", ["../mine.toml", "/etc/hostname", "link.toml", "sub/../../x.toml"]
)
def test_a_book_elsewhere_is_refused(folder: Path, where: str) -> None:
    (folder.parent / "mine.toml").write_text(OWN, encoding="utf-8")
    (folder / "link.toml").symlink_to(folder.parent / "mine.toml")
    written = (folder / "case.toml").read_text(encoding="utf-8")
    (folder / "case.toml").write_text(written.replace('"mine.toml"', f'"{where}"'))
    for load in (load_scene, lambda path: read_draft(path).table()):
        with pytest.raises(InputError, match="it must stand in the folder of its scene"):
            load(folder)


def test_a_faulty_book_is_refused_with_its_file(folder: Path) -> None:
    (folder / "mine.toml").write_text(OWN.replace("force_std", "force_sdt"), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        load_scene(folder)
    text = str(refused.value)
    assert "evaluation.rules_file" in text and "mine.toml" in text
    assert "has quantity 'force_sdt', but it must be one of mean_force" in text
    assert "\n" not in text and "more:" not in text


REFUSED: dict[str, tuple[list[str], str]] = {
    "unknown": (
        ['evaluation.rules=["en50367", "tsi_een"]'],
        'evaluation.rules.1 is "tsi_een" on the command line (--set); there is no rule book of '
        "that name; did you mean tsi_ene:2023?",
    ),
    "old edition": (["evaluation.edition=1999"], "it must be one of 2006, 2012, 2020"),
    "both": (
        ["evaluation.edition=2012", 'evaluation.rules=["tsi_ene"]'],
        'it is short for evaluation.rules = ["en50367:2012"]: take one away',
    ),
    "twice": (
        ['evaluation.rules=["en50367", "en50367:2020"]'],
        "has a book twice: the rule book en50367:2020 is named twice",
    ),
    "none": (["evaluation.rules=[]"], "without books a rules_file must be given"),
    "supply": (["evaluation.system=dc_750v"], "it must be one of ac, dc_3kv, dc_1500v"),
    "limit of no book": (
        ["evaluation.limits.uplift_space_mm=200"],
        "no chosen rule book reads it; those that do are en50119:2020, iec62486:2017, ife:2023, "
        "line, tb_t_3271:2011, tsi_ene:2023",
    ),
    "limit in metres": (
        ['evaluation.rules=["line"]', "evaluation.limits.uplift_space_m=0.2"],
        "did you mean evaluation.limits.uplift_space_mm?",
    ),
    "negative": (
        ['evaluation.rules=["line"]', "evaluation.limits.dropper_force_N=-1"],
        "it must be greater than 0 [N]",
    ),
    "own and wrong": (
        ['evaluation.own_rules={name="x", title="y", criteria=[]}'],
        "evaluation.own_rules on the command line (--set) has criteria = []; it ",
    ),
    "rules no list": (['evaluation.rules="tsi_ene"'], "it must be a list, in brackets"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_refused(name: str) -> None:
    overrides, says = REFUSED[name]
    with pytest.raises(InputError) as refused:
        scene(*overrides)
    text = str(refused.value)
    assert says in text and "\n" not in text and "more:" not in text, text


def test_list_tells_books_and_their_criteria() -> None:
    told = invoke("list", "--rules").output
    assert "en50367:2020       11 criteria  EN 50367:2020 (where a scene names none)" in told
    assert "jr                  1 criterion " in told
    assert len(told.splitlines()) >= 10
    told = invoke("list", "--rules", "en50119").output
    assert "limit > 0 N" in told and "not compared with the text of the standard" in told
    told = invoke("list", "--rules", "bane_nor").output
    assert "not compared" not in told and "TRV:00597; compared with the text" in told


def test_list_refuses_an_unknown_book_and_two_lists() -> None:
    done = invoke("list", "--rules", "en 50119")
    assert done.exit_code == 2 and '"en 50119": there is no rule book of that name' in done.output
    done = invoke("list", "--rules", "EN50367")
    assert done.exit_code == 2 and "did you mean en50367:20" in done.output
    both = invoke("list", "--rules", "--keys")
    assert both.exit_code == 2 and "--keys and --rules" in both.output
