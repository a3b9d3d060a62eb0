"""The tables of docs/architecture.md that are written down in the code too are the same there."""

from __future__ import annotations

from pathlib import Path

import pytest

from catenary.postproc.files.facts import FACTS
from catenary.solver.time_loop.views.channels import CHANNELS, ENERGIES, RUN

DOCUMENT = Path(__file__).parents[3] / "docs" / "architecture.md"


def tables() -> dict[str, list[str]]:
    """Lines of each table, by the name in the comments around it."""
    facts = [
        f"| `{name}` | {fact.unit} | {fact.per if fact.per != RUN else ''} | {fact.meaning} |"
        for name, fact in FACTS.items()
    ]
    channels = [
        f"| `{channel.name}` | {channel.unit} | {channel.per} | {channel.meaning} |"
        for channel in (*CHANNELS.values(), *ENERGIES.values())
        if channel.values or channel.energy
    ]
    return {
        "facts": ["| fact | unit | of each | |", "|---|---|---|---|", *facts],
        "channels": ["| channel | unit | per | |", "|---|---|---|---|", *channels],
    }


@pytest.mark.parametrize("name", tables())
def test_a_table_is_the_one_in_the_code(name: str) -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    shown = text.split(f"<!-- {name} -->")[1].split(f"<!-- /{name} -->")[0]
    assert shown.split("\n")[2:-2] == tables()[name]
