"""Scenes that are made of one case are as if each was made alone."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import pytest
from scenes import read_draft, resolved

from catenary import InputError
from catenary.cases.scene.load import Draft

SPEED, SEED = "train.speed_km_h", "irregularities.dropper_lengths.seed"
SLACK_WIRE = {"type": "wrong_tension", "wire": "contact_wire", "factor": 0.5}
DEVIATION = "irregularities.dropper_lengths.standard_deviation_mm"


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
        # Too slow a wave for the trains before is the fault of a later, faster one.
        {"defects": [SLACK_WIRE], SPEED: 290.0},
        {"defects": [SLACK_WIRE], SPEED: 310.0},
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


def test_a_faster_train_is_held_against_the_defects_before() -> None:
    """A check that looks at the train was left out where the train alone had changed."""
    slack = read_draft("en50318_2002").assigned([("defects", [SLACK_WIRE], "in the test")])
    slack.scene()
    with pytest.raises(InputError, match="the wave speed of contact_wire would be 309.8 km/h"):
        slack.assigned([(SPEED, 320.0, "in the test")]).scene()
