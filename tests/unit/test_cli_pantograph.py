"""The verb ``pantograph``: tables, files, a fitted model that loads, mistakes."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import verb_runner
from measuring import check
from scenes import load_scene, problem_of, shipped

from catenary.cases.scene.input.case_files import read_toml
from catenary.mbs.lumped import LumpedData
from catenary.mbs.response import chain_model


def invoke(*words: str) -> Any:
    return verb_runner.invoke("pantograph", *words)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Files and words for EN 50318's two masses, from 0.2 to 40 Hz."""
    folder = tmp_path_factory.mktemp("pantograph") / "of" / "en"
    words = ("en50318_2002", "-o", str(folder), "--from", "0.2", "--to", "40", "--points", "31")
    result = invoke(*words)
    assert result.exit_code == 0, result.output
    return folder, result.output


def test_receptance_is_that_of_the_masses(written: tuple[Path, str]) -> None:
    with (written[0] / "receptance.csv").open(encoding="utf-8", newline="") as stream:
        header, *rows = csv.reader(stream)
    assert header == [
        "frequency_hz",
        "receptance_real_m_per_N",
        "receptance_imag_m_per_N",
    ]
    frequency, real, imaginary = np.array(rows, dtype=float).T
    check("frequencies [Hz]", frequency, np.geomspace(0.2, 40.0, 31), within=1e-8)
    chain = chain_model(LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0)))
    expected = chain.receptance(frequency)
    found = real + 1j * imaginary
    # All digits are written: round-off at a resonance of quality 7.
    check("receptance [m/N]", np.abs(found / expected - 1.0), 0.0, within=1e-12)


def test_tables_name_what_was_asked_for(written: tuple[Path, str]) -> None:
    folder, text = written
    for words in ("reference of en50318_2002", "mass 1", "7.2", "4200", "4.658", "0.0679"):
        assert words in text
    picture = folder / "receptance.png"
    assert str(picture) in text and picture.read_bytes()[:4] == b"\x89PNG"


def test_fitted_model_runs_in_the_pantograph_s_place(
    written: tuple[Path, str], tmp_path: Path
) -> None:
    """Pasted behind its own case and named on the train it is the same pantograph."""
    fragment = (written[0] / "lumped.toml").read_text(encoding="utf-8")
    table = read_toml(written[0] / "lumped.toml")["pantographs"]["reference_lumped"]
    check("masses [kg]", table["masses_kg"], (7.2, 15.0), within=1e-4)
    scene = tmp_path / "case.toml"
    original = shipped()["en50318_2002"].read_text(encoding="utf-8")
    scene.write_text(f"{original}\n{fragment}", encoding="utf-8")
    changed = problem_of(load_scene(scene, ["train.pantographs.0.name=reference_lumped"]))
    (placement,) = changed.train.placements
    (before,) = problem_of(load_scene("en50318_2002")).train.placements
    assert placement.static_force == before.static_force == 120.0
    check("stiffnesses [N/m]", placement.data.stiffnesses, before.data.stiffnesses, within=0.1)
    again = invoke(str(scene), "--kind", "reference_lumped", "--fit", "1")
    assert again.exit_code == 0 and "reference_lumped of en50318_2002" in again.output


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--kind", "other"), "the case has no such pantograph; it has reference"),
        (("--from", "0"), "frequencies must grow from above 0"),
        (("--from", "30"), "frequencies must grow from above 0"),
        (("--points", "1"), "--points 1 must be between 2"),
        (("--fit", "4"), "1 to 3 masses, not of 4"),
        (("--fit-from", "50"), "--fit-from 50 must be above 0 Hz and below --to 25"),
    ],
)
def test_mistakes_end_in_a_sentence(words: tuple[str, ...], sentence: str) -> None:
    result = invoke("en50318_2002", *words)
    assert result.exit_code == 2 and sentence in result.output.replace("\n", " "), result.output


def test_files_are_not_overwritten_unless_told_to(written: tuple[Path, str]) -> None:
    folder = written[0]
    result = invoke("en50318_2002", "-o", str(folder))
    assert (
        result.exit_code == 2 and "receptance.csv is there already; name another" in result.output
    )
    result = invoke("en50318_2002", "-o", str(folder / "receptance.csv"))
    assert result.exit_code == 2 and "is a file; name a folder" in result.output
    before = (folder / "receptance.csv").read_bytes()
    assert invoke("en50318_2002", "-o", str(folder), "--force").exit_code == 0
    assert (folder / "receptance.csv").read_bytes() != before


def test_laws_that_are_left_out_are_named() -> None:
    law = "{type = 'damper', at_mass = 2, up_N_s_per_m = 500.0, down_N_s_per_m = 900.0}"
    words = ("en50318_2002", f"pantographs.reference.laws=[{law}]")
    sentence = "left out: the pantograph's laws, which are not linear"
    assert sentence in invoke(*words).output
    assert sentence not in invoke(*words, "effects.pantograph_laws=false").output
    assert sentence not in invoke("en50318_2002").output
