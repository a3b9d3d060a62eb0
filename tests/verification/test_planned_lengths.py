"""The pre-sag that planned lengths of droppers give: the inverse of cutting them for a pre-sag.

Lengths to which droppers of a shipped line are cut go into a table, rounded to 0.1 mm as a plan may
have them; the pre-sag that is found must be that of the shipped line. An error e of a length moves
the contact wire by e / (1 + T_c / T_m) between supports, and by e where all droppers have the same
error, as both wires are strings; bending lets neighbours with opposite errors move less. So the
pre-sag is as exact as the lengths: half a digit, 0.05 mm, and what the search leaves.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from measuring import check
from scenes import Scene, line_data_of, load_scene, mesh_of, problem_of
from verb_runner import invoke

from catenary import InputError
from catenary.cases.run.planned_lengths import take_in_lengths
from catenary.cases.scene.starter import write_case
from catenary.solver.statics.form_finding import lengths_to_cut

HALF_A_DIGIT, LEFT = 0.05, 0.02  # [mm]
N = 13
CASES = {
    "simple": "ac_simple",
    "stitched": "re330_stitched",
    "compound": "shinkansen_compound",
    "twin": "dc_twin",
    "ambrosio2012": "ambrosio2012",  # with transition spans, whose droppers have lengths too
}


def cut(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Places of the droppers of contact wires and lengths to which they are cut (n,) [m]."""
    problem, mesh = problem_of(scene), mesh_of(scene)
    lengths = lengths_to_cut(problem, mesh)
    lower = np.array([own.lower for own in problem.line.droppers], dtype=str)[mesh.dropper_group]
    own = np.char.startswith(lower, "contact")
    x, first = np.unique(np.round(mesh.x(mesh.droppers[:, 1])[own], 9), return_index=True)
    return x, lengths[own][first]


def test_a_fitting_of_next_to_no_mass_changes_no_length() -> None:
    """On a wire of several pieces: its node is one more in one of them, and parts none."""
    light = 1e-9  # [kg], of 0.1 kg of wire between two droppers: a hundred-millionth of the sag
    at = [f'{{kind="splice", wire="stitch_wire", at_m={x}, mass_kg={light}}}' for x in (60, 128.5)]
    words = [f"line.fittings=[{', '.join(at)}]"]
    (_, plain), (_, fitted) = (
        cut(load_scene("re330_stitched", own, shortened=True)) for own in ([], words)
    )
    check("lengths [m]", fitted, plain, within=1e-8 * 0.05)


def planned(folder: Path, case: str, longer: dict[tuple[int, int], float] | None = None) -> Scene:
    """Tables of a shipped line's first spans with lengths of its droppers; the line itself."""
    words = [f"line.n_spans={N}", "evaluation.from_m=350", "evaluation.to_m=450"]
    scene = load_scene(case, words)
    masts = line_data_of(scene).support_positions
    rows, numbers = ["span,position_m,length_m"], dict.fromkeys(range(1, N + 1), 0)
    for x, length in zip(*cut(scene), strict=True):
        span = int(np.searchsorted(masts, x))
        numbers[span] += 1
        length += (longer or {}).get((span, numbers[span]), 0.0)
        rows.append(f"{span},{x - masts[span - 1]:.9g},{length:.4f}")
    (folder / "lengths.csv").write_text("\n".join(rows) + "\n")
    spans = "".join(f"{length}\n" for length in np.diff(masts))
    (folder / "spans.csv").write_text(f"span_m\n{spans}")
    return scene


def made(folder: Path, kind: str) -> Scene:
    """The case that ``new`` writes from these tables."""
    words = ["new", str(folder / "line"), "--topology", kind]
    words += ["--spans", str(folder / "spans.csv"), "--droppers", str(folder / "lengths.csv")]
    done = invoke(*words)
    assert done.exit_code == 0, done.output
    assert "the pre-sag found gives the lengths of the droppers within" in done.output
    return load_scene(folder / "line")


@pytest.mark.parametrize("kind", CASES)
def test_lengths_give_back_the_pre_sag_that_they_were_cut_for(tmp_path: Path, kind: str) -> None:
    given = line_data_of(planned(tmp_path, CASES[kind])).pre_sag
    found = line_data_of(made(tmp_path, kind)).pre_sag
    off = 1e3 * max(np.abs(np.subtract(a, b)).max() for a, b in zip(given, found, strict=True))
    check("largest error of the pre-sag [mm]", off, 0.0, within=HALF_A_DIGIT + LEFT)


def test_a_longer_dropper_lets_the_contact_wire_hang_lower(tmp_path: Path) -> None:
    longer = 0.010
    planned(tmp_path, "ac_simple", {(6, 5): longer})
    scene = made(tmp_path, "simple")
    x, length = cut(scene)
    table = np.loadtxt(tmp_path / "lengths.csv", delimiter=",", skiprows=1)
    check("lengths [mm]", 1e3 * np.abs(length - table[:, 2]).max(), 0.0, within=LEFT)
    # Both wires give way: the contact wire by less than the error, in the ratio of their tensions.
    lower = line_data_of(scene).pre_sag[5][4] - line_data_of(scene).pre_sag[6][4]
    tensions = scene.line.contact_wire.tension_N, scene.line.messenger_wire.tension_N  # type: ignore[union-attr]
    share = longer / (1.0 + tensions[0] / tensions[1])
    # Bending, droppers' stretch and the step of supports leave a quarter of it.
    check("by how much it hangs lower [mm]", 1e3 * lower, 1e3 * share, within=0.25e3 * share)


def test_lengths_that_make_no_line_are_refused(tmp_path: Path) -> None:
    planned(tmp_path, "ac_simple", {(6, 5): 5.0})
    words = ["new", str(tmp_path / "line"), "--spans", str(tmp_path / "spans.csv")]
    done = invoke(*words, "--droppers", str(tmp_path / "lengths.csv"))
    assert done.exit_code == 2
    assert f"the table of droppers is {tmp_path / 'lengths.csv'}; no pre-sag" in done.output
    assert not (tmp_path / "line").exists()


def test_a_table_has_lengths_or_pre_sags(tmp_path: Path) -> None:
    planned(tmp_path, "ac_simple")
    text = (tmp_path / "lengths.csv").read_text().splitlines()
    both = [f"{text[0]},pre_sag_mm", *(f"{line},0" for line in text[1:])]
    (tmp_path / "lengths.csv").write_text("\n".join(both))
    with pytest.raises(InputError, match="it has both length_m and pre_sag_mm"):
        write_case(
            tmp_path / "line",
            "simple",
            tmp_path / "spans.csv",
            tmp_path / "lengths.csv",
            lambda inner: print(take_in_lengths(inner)),
        )


def test_a_table_of_pre_sags_stays_what_it_is(tmp_path: Path) -> None:
    assert take_in_lengths(tmp_path) is None
    text = "span,position_m,pre_sag_mm\n1,5.0,0\n"
    (tmp_path / "droppers.csv").write_text(text)
    assert take_in_lengths(tmp_path) is None
    assert (tmp_path / "droppers.csv").read_text() == text
