"""Scenes that are made of one case share what is sound with each other, and are as if alone."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import pytest
from scenes import Scene, line_data_of, load_scene, read_draft, resolved, shipped

from catenary import InputError
from catenary.cases.scene.checks.scene import READS
from catenary.cases.scene.load import Draft

SPEED, SEED = "train.speed_km_h", "irregularities.dropper_lengths.seed"
DEVIATION = "irregularities.dropper_lengths.standard_deviation_mm"


class Guarded:
    """A scene of which a check may read some tables."""

    def __init__(self, scene: Scene, tables: frozenset[str]) -> None:
        self._scene, self._tables = scene, tables

    def __getattr__(self, name: str) -> Any:
        table = "effects" if name in ("switches", "holds") else name
        if table in Scene.model_fields:
            assert table in self._tables, f"reads {table}"
        return getattr(self._scene, name)

    def model_copy(self, update: dict[str, Any]) -> Guarded:
        return Guarded(self._scene.model_copy(update=update), self._tables)


@pytest.mark.parametrize("case", shipped())
def test_costly_checks_read_the_tables_that_they_are_said_to(case: str) -> None:
    scene = load_scene(case)
    line = line_data_of(scene)
    for check, tables in READS.items():
        of = () if check.__name__ == "size_faults" else (line,)
        assert list(check(Guarded(scene, tables), *of)) == []


def outcome(draft: Draft) -> Any:
    try:
        return resolved(draft.scene())
    except InputError as error:
        return [str(fault) for fault in error.faults]


@pytest.mark.parametrize(
    "values",
    [
        {SPEED: 300.0},
        {SPEED: 2400.0},
        {"contact.stiffness_N_per_m": 50.0},
        {"contact.stiffness_N_per_m": "fifty"},
        {DEVIATION: 3.0, SEED: 5},
        {DEVIATION: 3.0, SEED: -5},
        {"line.n_spans": 12, "train.end_m": 700.0},
        {"line.n_spans": 900_000},
        {"line.n_spans": 20_000, "mesh.elements_per_gap": 128, "case.accept_unusual": True},
        {"line.dropper.positions_m": [1.0, 99.0], "line.dropper.pre_sag_mm": [0.0, 0.0]},
        {"irregularities.contact_wire_height.by_place": [0.0, 0.01]},
        {"defects": [{"type": "missing_dropper", "span": 3, "dropper": 99}]},
        {"mesh.elements_per_gap": 4000, "case.accept_unusual": True},
        {"effects.relative_motion": True, "window.mode": "bounded"},
        {"case.title": "a\u202eb"},
    ],
)
def test_scenes_that_follow_each_other_are_as_if_alone(values: dict[str, Any]) -> None:
    first = read_draft("ac_simple")
    first.scene()
    whole = copy.deepcopy(first.raw)
    assigned = [(key, value, "in the test") for key, value in values.items()]
    alone = outcome(read_draft("ac_simple").assigned(assigned))
    for draft in (first, first.assigned([(SPEED, 280.0, "in the test")])):
        draft.scene()
        assert outcome(first.assigned(assigned)) == alone
    assert first.raw == whole
    assert outcome(first) == outcome(read_draft("ac_simple"))


def test_what_a_file_holds_is_read_for_each_scene(tmp_path: Path) -> None:
    file = tmp_path / "lengths.csv"
    file.write_text("span,dropper,error_mm\n2,1,3.0\n")
    key = "irregularities.dropper_lengths.by_dropper_file"
    draft = read_draft("ac_simple").assigned([(key, str(file), "in the test")])
    before = draft.scene().irregularities
    file.write_text("span,dropper,error_mm\n2,1,4.0\n")
    after = draft.assigned([(SPEED, 280.0, "in the test")]).scene().irregularities
    assert before != after
