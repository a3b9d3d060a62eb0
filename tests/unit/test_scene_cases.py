"""The shipped cases hold what their sources state; what they derive is derived here again."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from scenes import line_data_of, load_scene, mesh_of, problem_of, shipped

from catenary.solver.statics.form_finding import find_form


def reference(case: str, name: str) -> list[dict[str, str]]:
    path = shipped()[case].parent / "reference" / name
    with path.open(encoding="utf-8") as stream:
        return list(csv.DictReader(line for line in stream if not line.startswith("#")))


@pytest.mark.parametrize("case", list(shipped()))
def test_each_case_explains_itself(case: str) -> None:
    text = (shipped()[case].parent / "README.md").read_text(encoding="utf-8")
    for part in ("Problem", "Set-up", "Source", "How to run", "ssumed"):
        assert part in text, part
    assert f"catenary run {case}" in text


@pytest.mark.parametrize("case", list(shipped()))
def test_what_is_assumed_is_marked(case: str) -> None:
    assert "assumed" in Path(shipped()[case]).read_text(encoding="utf-8")


def test_accepted_ranges_are_complete() -> None:
    rows = reference("en50318_2002", "accepted_ranges.csv")
    assert len(rows) == 16
    assert {row["speed_km_h"] for row in rows} == {"250", "300"}
    for row in rows:
        assert float(row["lower"]) <= float(row["upper"])
        assert row["unit"] in ("N", "mm", "%")


@pytest.mark.study
def test_first_guesses_of_droppers_come_near_the_lengths_of_form_finding() -> None:
    # They leave out the supports' give (27 mm in en50318_2002: 1330 N on 5e4 N/m), the clamps,
    # that the curvature of a pre-sag d lets the contact wire carry 8 d T/L^2, by which the
    # messenger wire hangs d T/T_m higher, and the tension that stitch wires take of the messenger
    # wire (58 mm: q L l/4 (1/17.5 kN - 1/21 kN)); they only have to tell the possible from the
    # impossible.
    for case in shipped():
        scene = load_scene(case)
        if scene.line.overlap is not None:  # its rise is looked at elsewhere
            scene = load_scene(case, ["line.overlap="])
        problem, mesh = problem_of(scene), mesh_of(scene)
        _, form = find_form(problem, mesh)
        line = problem.line
        for number, group in enumerate(line.droppers):
            upper, lower, x = (
                line.wire(group.upper),
                line.wire(group.lower),
                np.array(group.lower_x),
            )
            assert lower.profile is not None
            carried = lower.profile.pre_sag(x).max() * lower.tension / upper.tension
            stitched = 0.06 if scene.line.stitch_wire is not None else 0.0
            found = form.dropper_length[mesh.dropper_group == number]
            guess = upper.points(x)[:, 2] - lower.points(x)[:, 2]
            print(f"{case}: {group.name} differ by {1e3 * np.abs(guess - found).max():.0f} mm")
            assert np.abs(guess - found).max() < 0.06 + carried + stitched, case


def test_ac_simple_starts_from_the_mean_force_of_the_standard() -> None:
    for speed in (275.0, 320.0):
        scene = load_scene("ac_simple", [f"train.speed_km_h={speed}"])
        force = problem_of(scene).train.placements[0].static_force
        assert force == pytest.approx(0.00097 * speed**2 + 70, rel=0.1)


def test_ambrosio_has_the_papers_line() -> None:
    line = line_data_of(load_scene("ambrosio2012"))
    assert line.n_spans == 25
    assert line.n_spans - sum(line.n_transition) == 20
    assert all(len(x) == 8 for x in line.dropper_positions)
    assert set(line.span_lengths) == {50.0, 54.0}
    assert 3.6 * line.contact_wire.wave_speed == pytest.approx(441, abs=0.5)  # the paper's speed
    area = 150e-6  # solid circle: I = A^2 / (4 pi)
    assert line.contact_wire.bending_stiffness == pytest.approx(
        120e9 * area**2 / (4 * math.pi), rel=1e-2
    )
    scaled = 131.7 * (66 / 120) ** 2 * 110 / 97
    assert line.messenger_wire.bending_stiffness == pytest.approx(scaled, rel=1e-2)


def test_ambrosio_dropper_lengths_come_near_the_papers() -> None:
    # Table 1 gives 1.25 to 1.075 m. With the paper's weights and tensions the messenger wire sags
    # more between the outer and the inner droppers than that; the ends agree to a span's 1/1000.
    scene = load_scene("ambrosio2012")
    _, form = find_form(problem_of(scene), mesh_of(scene))
    middle = form.dropper_length[8 * 12 : 8 * 13]
    print("paper 1.25-1.075, observed", np.round(middle, 3))
    assert middle.max() == pytest.approx(1.25, abs=0.03)
    assert middle.min() == pytest.approx(1.075, abs=0.06)


def test_ambrosio_reduces_the_papers_arm_damper() -> None:
    # Table 4: the damper acts at the same point of the lower arm as the actuator. By virtual work
    # the actuator's force reaches the head in the ratio 498 N / 8970 N; the lever arms about the
    # pivot are 0.1395 m (damper) and 0.128 m (actuator); the damper counts with the ratio squared.
    ratio = 498 / 8970 * 0.1395 / 0.128
    kind = load_scene("ambrosio2012").pantographs["lumped"]
    assert kind.dampings_N_s_per_m[-1] == pytest.approx(60 * ratio**2, rel=0.03)
