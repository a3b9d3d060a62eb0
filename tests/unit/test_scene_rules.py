"""Rule books in scenes, on pages, on the terminal and in the table of a sweep."""

from __future__ import annotations

import importlib.util
import json
import math
import re
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from scenes import Scene, load_scene, read_draft, recorded, resolved, scene_from
from verb_runner import invoke

from catenary import InputError
from catenary.cases.scene.input.faults import Origin
from catenary.cases.scene.run.case import LimitsTable, chosen_books, rule_entries
from catenary.cases.studies.sweep.jobs import Ended
from catenary.cases.studies.sweep.output import table_of
from catenary.cases.studies.sweep.variants import Variant
from catenary.cases.terminal.terminal_text import _acceptance
from catenary.postproc.evaluate.compare import _judged
from catenary.postproc.evaluate.verdict import Criterion
from catenary.postproc.standards.rule_books import LIMIT_KEYS, QUANTITIES, book_of, shipped

# --- rule books in scenes -------------------------------------------------------------------------


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


# --- pages about rule books -----------------------------------------------------------------------


ROOT = Path(__file__).parents[2]
GUIDE = (ROOT / "docs/guide/rules.md").read_text(encoding="utf-8")
BLOCKS = [tomllib.loads(text) for text in re.findall(r"```toml\n(.*?)```", GUIDE, re.S)]


def test_the_reference_has_every_criterion_quantity_and_key() -> None:
    spec = importlib.util.spec_from_file_location("pages", ROOT / ".site/generated_pages.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    sections = module.rules_page().split("\n## ")
    for (key, book), section in zip(shipped().items(), sections[1:], strict=False):
        assert section.startswith(f"{key}\n")
        rows = [line for line in section.splitlines() if line.startswith("| ")][1:]
        assert len(rows) == len(book.criteria)
        for rule, row in zip(book.criteria, rows, strict=True):
            assert rule.title in row and f"`{rule.quantity}`" in row and rule.words() in row
            assert ("| not compared with the text" in row) is not book.is_compared(rule)
    assert all(f"| `{name}` |" in sections[-2] for name in QUANTITIES)
    assert all(f"| `{name}` |" in sections[-1] for name in LIMIT_KEYS)


def test_the_guide_tells_every_book() -> None:
    rows = "\n".join(line for line in GUIDE.splitlines() if line.startswith("| `"))
    assert {book.name for book in shipped().values() if f"`{book.name}" not in rows} == set()


def test_the_books_that_the_guide_chooses_judge_a_scene() -> None:
    chosen, limits = BLOCKS[0]["evaluation"], BLOCKS[0]["evaluation"].pop("limits")
    values = [(f"evaluation.{key}", value, "in the guide") for key, value in chosen.items()]
    values += [(f"evaluation.limits.{key}", value, "in the guide") for key, value in limits.items()]
    scene = read_draft("en50318_2002").assigned(values).scene()
    judged = [book.key for book in chosen_books(scene.evaluation)]
    assert judged == ["en50367:2020", "tsi_ene:2023", "line"]


def test_the_book_of_the_guide_is_one() -> None:
    book = book_of(BLOCKS[1], "the book of the guide")
    assert book.key == "my_line:2026" and len(book.criteria) == 2
    assert book.criteria[1].words() == ("< 250 N (AC, up to 160 km/h); 0.0025 v^2 + 70 N (AC)")


# --- criteria of several rule books on the terminal and in the table of a sweep -------------------


def judged(book: str, passed: bool | None, compared: bool = False) -> dict[str, Any]:
    return {
        "criterion": "arcing NQ",
        "value": 0.15,
        "limit": 0.2 if passed else 0.1,
        "unit": "%",
        "passed": passed,
        "book": book,
        "compared": compared,
    }


LEFT = {"criterion": "tension of the contact wire", "book": "line", "because": "there is none"}


def test_one_book_needs_no_name() -> None:
    lines = _acceptance({"acceptance": [judged("en50367:2020", True)], "not_judged": []})
    assert lines == [
        "  passed      arcing NQ: 0.15, limit 0.20 % *",
        "  * limit not compared with the text of the standard",
    ]


def test_a_value_at_a_limit_that_it_must_not_reach() -> None:
    row = {**judged("own", False, compared=True), "value": 350.0, "limit": 350.0, "relation": "<"}
    told = _acceptance({"acceptance": [row], "not_judged": []})
    assert told == ["  FAILED      arcing NQ: 350.00, limit < 350.00 %"]


def test_runs_side_by_side_show_what_fails_by_little() -> None:
    one = Criterion("arcing NQ", 0.2046, 0.2, "%", "<=", False, "", compared=True)
    assert _judged(one) == "0.205 % FAILED"
    assert _judged(replace(one, value=0.5)) == "0.50 % FAILED"
    assert _judged(replace(one, value=math.nan, passed=None)) == "no value, not judged"


def test_books_are_named_and_limits_marked() -> None:
    rows = [judged("tsi_ene:2023", False), judged("line", True, compared=True)]
    summary = {"acceptance": rows, "not_judged": [LEFT], "judged_by": "TSI", "passed": False}
    assert _acceptance(summary) == [
        "  FAILED      arcing NQ (tsi_ene:2023): 0.15, limit 0.10 % *",
        "  passed      arcing NQ (line): 0.15, limit 0.20 %",
        "  not judged  tension of the contact wire (line), because there is none",
        "  NOT PASSED by TSI",
        "  * limit not compared with the text of the standard",
    ]
    rows[0] = judged("tsi_ene:2023", True, compared=True)
    assert _acceptance({**summary, "acceptance": rows, "passed": True})[-1] == "  PASSED by TSI"
    assert _acceptance({**summary, "acceptance": [], "passed": None})[-1] == "  NOT JUDGED by TSI"


def test_a_sweep_tells_books_and_what_they_did_not_judge() -> None:
    rows = [judged("tsi_ene:2023", False), judged("line", True)]
    summary = {"acceptance": rows, "not_judged": [LEFT], "passed": False, "pantographs": [{}]}
    (row,) = table_of([Ended(Variant("a", (), {}), "done", summary)]).records()
    assert row["rules"] == ["tsi_ene:2023", "line"]
    assert row["failed"] == ["arcing NQ (tsi_ene:2023)"]
    assert row["not_judged"] == ["tension of the contact wire (line)"]
    # A table of an earlier version has no books.
    old = {"acceptance": [{"criterion": "arcing NQ", "passed": False}], "passed": False}
    (row,) = table_of([Ended(Variant("a", (), {}), "done", old)]).records()
    assert (row["rules"], row["failed"], row["not_judged"]) == ([], ["arcing NQ"], [])
