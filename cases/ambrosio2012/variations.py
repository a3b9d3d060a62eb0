"""What the paper's study varies, read from ``study.toml``: readings, dampings, trains, inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from catenary.cases.scene.input.toml_input import read_toml
from catenary.cases.studies.sweep.variants import slug

TABLE = Path(__file__).with_name("study.toml")
VARIED = "vary"
SEARCHED = "search"


def run_name(reading: str, damping: str, train: str) -> str:
    """Name of the run of a train under a reading."""
    return slug(f"{reading}__{damping}__{train}")


def variations(table: Mapping[str, Any]) -> dict[str, list[str]]:
    """Assignments of all variations by "group: title"."""
    return _by_title(table["variations"])


def searched(table: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The readings of the search by "input: option", each one option off the one searched around.

    Empty if the latter is not among the readings.
    """
    search = table["search"]
    return {
        title: {**centre, "name": f"{SEARCHED}-{title}", "set": [*centre["set"], *assignments],
                "figures": False}
        for centre in table["readings"]
        if centre["name"] == search["around"]
        for title, assignments in _by_title(search["inputs"]).items()
    }  # fmt: skip


def _by_title(groups: Mapping[str, Mapping[str, list[str]]]) -> dict[str, list[str]]:
    return {
        f"{group}: {title}": assignments
        for group, entries in groups.items()
        for title, assignments in entries.items()
    }


def read_table(shortened: bool = False) -> dict[str, Any]:
    """``study.toml``, reduced to its short form on request."""
    table = read_toml(TABLE)
    if shortened:
        short = table["short"]
        for name in ("trains", "readings"):
            table[name] = [one for one in table[name] if one["name"] in short[name]]
        table["variations"] = _chosen(table["variations"], short["variations"])
        table["search"]["inputs"] = _chosen(table["search"]["inputs"], short["search"])
    return table


def _chosen(groups: Mapping[str, Any], titles: Sequence[str]) -> dict[str, dict[str, list[str]]]:
    kept: dict[str, dict[str, list[str]]] = {}
    for group, title in (name.split(": ") for name in titles):
        kept.setdefault(group, {})[title] = groups[group][title]
    return kept
