"""Notebooks of the site: a page of Python as a file for Jupyter, beside the page."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
PAGES = ("tutorials/python.md",)
_CODE = re.compile(r"^```python\n(.*?)^```$", re.M | re.S)


def notebook(page: str) -> dict[str, Any]:
    """A page as a notebook of format 4.5: its text, and its blocks of Python as cells to be run."""
    parts = [part.strip("\n") for part in _CODE.split(page)]
    cells = []
    for number, text in enumerate(parts):
        if not text:
            continue
        cell: dict[str, Any] = {"id": f"cell-{number}", "metadata": {}}
        if number % 2:
            cell |= {"cell_type": "code", "execution_count": None, "outputs": []}
        else:
            cell["cell_type"] = "markdown"
        cells.append({**cell, "source": text.splitlines(keepends=True)})
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}


def on_files(files: Files, config: Any) -> Files:
    """The files of the site with notebooks; called by MkDocs."""
    for name in PAGES:
        made = notebook((ROOT / "docs" / name).read_text(encoding="utf-8"))
        text = json.dumps(made, indent=1, ensure_ascii=False)
        files.append(File.generated(config, name.replace(".md", ".ipynb"), content=text))
    return files
