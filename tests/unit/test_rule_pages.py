"""Pages about rule books: the reference has every criterion, the guide every book, and both run."""

from __future__ import annotations

import importlib.util
import re
import tomllib
from pathlib import Path

from scenes import read_draft

from catenary.cases.scene.run.case import chosen_books
from catenary.postproc.standards.rule_books import LIMIT_KEYS, QUANTITIES, book_of, shipped

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
