"""Derivatives of the line at rest: against a closed form, the implicit function theorem, rests."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
import verb_runner
from measuring import check
from scenes import load_scene, mesh_of, problem_of
from scipy import sparse

import catenary
from catenary.meshgen.wires import Role
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest

TENSION = "line.contact_wire.tension_N"


def test_sag_of_a_tensioned_beam_falls_with_its_tension() -> None:
    """Equal spans of a wire: q L^2 / (8 T) - q L / (2 T) sqrt(EI / T), its slope zero at supports;
    terms of exp(-L sqrt(T / EI) / 2), 2e-20, are left out."""
    finer = {"line.n_spans": 8, "mesh.elements_per_gap": 128, "evaluation.to_m": 200.0,
             "line.contact_wire.bending_stiffness_N_m2": 1100.0,
             "train.end_m": 220.0, "evaluation.from_m": 100.0}  # fmt: skip
    scene = catenary.load("tramway").replace(finer)
    own = catenary.static(scene).sensitivity(TENSION)
    length = float(own.x[-1] - own.x[0])
    tension, stiffness = scene[TENSION], scene["line.contact_wire.bending_stiffness_N_m2"]
    load = 9.81 * scene["line.contact_wire.mass_kg_per_m"]
    wanted = load / tension**2 * (length**2 / 8 - 0.75 * length * np.sqrt(stiffness / tension))
    moved = own.by_height.sel(parameter=TENSION, wire="contact_wire")
    found = float(moved.interp(x=own.x[0] + length / 2) - moved[0])
    # Elements of 0.7 sqrt(EI / T): the boundary layers, 7 % of this, are wrong by 0.7^4 / 720.
    check("rise of the middle by tension [m/N]", found, wanted, within=3e-5 * wanted)


def test_elasticity_changes_by_the_implicit_function_theorem() -> None:
    """K u = b and e = b . u give de = -u . dK u; K is linear in the tension."""
    step = 100.0

    def rest(tension: float) -> LineAtRest:
        scene = load_scene("en50318_2002", [f"{TENSION}={tension}"])
        return line_at_rest(problem_of(scene), mesh_of(scene))

    stiffness = {own: whole_matrix(rest(20e3 + own).model, stiffness=1.0) for own in (-step, step)}
    by_tension = (stiffness[step] - stiffness[-step]) / (2 * step)
    model = rest(20e3).model
    whole = whole_matrix(model, stiffness=1.0).tocsc()
    free = np.flatnonzero(whole.diagonal())
    factor, by_tension = sparse.linalg.splu(whole[free][:, free]), by_tension[free][:, free]
    own = catenary.static("en50318_2002").sensitivity(TENSION)
    nodes = model.nodes_of(Role.CONTACT)[0]
    for place in own.x.values[1:-1:10]:
        (unknown,) = model.numbering.of(nodes[np.isclose(model.mesh.x(nodes), place)], "w")
        unknown = np.searchsorted(free, unknown)
        load = np.zeros(free.size)
        load[unknown] = 1.0
        motion = factor.solve(load)
        assert float(own.elasticity.sel(x=place)) == pytest.approx(motion[unknown], rel=1e-9)
        wanted = -motion @ by_tension @ motion
        found = float(own.by_elasticity.sel(parameter=TENSION, x=place))
        # Differences of elasticities whose round-off is some 1e-12, over steps of a hundredth.
        assert found == pytest.approx(wanted, rel=1e-7)


@pytest.mark.parametrize(
    ("case", "key"),
    [
        ("re330_stitched", "line.stitch_wire.tension_N"),
        ("dc_twin", "line.messenger_wire.tension_N"),
        ("ac_simple_3d", "line.steady_arm.length_m"),
        ("overlap", "line.contact_wire.mass_kg_per_m"),
    ],
)
def test_lines_hang_as_the_derivatives_say(case: str, key: str) -> None:
    """Heights and elasticity of lines with other values, by differences of the second order."""
    scene = catenary.load(case)
    own = catenary.static(scene).sensitivity(key)
    by = 1e-3 * scene[key]
    high, low = (catenary.static(scene.replace({key: scene[key] + d})) for d in (by, -by))
    wanted = (high.elasticity - low.elasticity).elasticity_mm_per_N.to_numpy() / (2e3 * by)
    scale = np.abs(wanted).max()
    assert np.abs(own.by_elasticity.values[0] - wanted).max() < 1e-5 * scale + 1e-11 / by
    compared = 0
    for wire in own.wire.values:
        heights = [
            line.contact_wires[line.contact_wires.wire == wire].set_index("x_m").height_m
            for line in (high, low)
        ]
        moved = ((heights[0] - heights[1]) / (2 * by)).groupby(level=0).first()
        at = own.by_height.sel(wire=wire).isel(parameter=0).dropna("x")
        there = moved.reindex(at.x.values)
        compared += int(there.notna().sum())
        # Rests are found to some 1e-10 m.
        error = np.abs(there.to_numpy() - at.values)[there.notna().to_numpy()].max(initial=0.0)
        assert error < 1e-4 * np.abs(at.values).max(initial=0.0) + 1e-9 / by
    assert compared > 20


def test_the_program_ranks_what_changes_the_line_at_rest(tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = verb_runner.invoke("sensitivity", "ac_simple", "--at-rest", "-p", TENSION, "-p",
                              "line.dropper.pre_sag_mm", "-o", str(out))  # fmt: skip
    assert done.exit_code == 0, done.output
    # Pre-sag, which droppers give the wire, moves it by as much.
    ranked = [line.split() for line in done.output.splitlines() if line.startswith("line.")]
    assert [words[0] for words in ranked] == ["line.dropper.pre_sag_mm", TENSION]
    with (out / "sensitivity_at_rest.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["parameter"] == TENSION]
    assert {row["change"] for row in rows} == {"1000"} and len(rows) > 20
    assert all(float(row["elasticity_change_mm_per_N"]) < 0.0 for row in rows)
    again = verb_runner.invoke("sensitivity", "ac_simple", "--at-rest", "-o", str(out))
    assert again.exit_code == 2 and "sensitivity_at_rest.csv" in again.output


def test_what_moves_no_wire_has_no_place() -> None:
    """Droppers are cut for the messenger's tension, so that the contact wire stays: what is left is
    round-off, whose largest value is anywhere."""
    key = "line.messenger_wire.tension_N"
    said = verb_runner.invoke("sensitivity", "en50318_2002", "--at-rest", "-p", key).output
    (words,) = (line.split() for line in said.splitlines() if line.startswith(key))
    assert float(words[4]) == 0.0 and words[5] == "-" and float(words[6]) < -2.0


@pytest.mark.parametrize(
    ("key", "sentence"),
    [
        ("train.speed_km_h", "train.speed_km_h does not change the line at rest"),
        ("line.span_m", "moves nodes of the mesh"),
    ],
)
def test_what_has_no_derivative_at_rest_is_refused(key: str, sentence: str) -> None:
    with pytest.raises(catenary.InputError, match=sentence):
        catenary.static("en50318_2002").sensitivity(key)
