"""Measured curves of droppers: keys, files, and what cannot be one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scenes import Scene, find_case, load_scene, problem_of, recorded

from catenary import InputError
from catenary.cases.scene.input.csv_files import file_key_of

NO_STIFFNESS = "line.dropper.stiffness_N_per_m="
POINTS = [[0.0, 0.0], [5e-4, 15.0], [1e-3, 60.0], [3e-3, 400.0]]
FILE = "strain, tension_N\n# at 20 degrees\n" + "\n".join(f"{e}, {n}" for e, n in POINTS) + "\n"


def load(*overrides: str) -> Scene:
    return load_scene("ac_simple", [NO_STIFFNESS, *overrides])


def test_a_curve_says_what_droppers_pull() -> None:
    (group,) = problem_of(load(f"line.dropper.curve={POINTS}")).line.droppers
    assert group.kind.curve == tuple(map(tuple, POINTS))
    slopes = group.kind.slopes_at(np.array([1.0, 0.5]))
    strain, tension = np.array(POINTS).T
    for stretch in (2e-4, 7e-4, 2.5e-3):
        at = np.array([stretch, 0.5 * stretch])
        assert slopes.force_at(at) == pytest.approx(np.interp(stretch, strain, tension), rel=1e-14)
        assert slopes.stretch_under(slopes.force_at(at)) == pytest.approx(at, rel=1e-14)
    # The last slope goes on, and the first one below.
    assert slopes.force_at(np.array([5e-3, -5e-4])) == pytest.approx([740.0, -30.0], rel=1e-14)


def test_a_file_is_taken_in_and_the_resolved_scene_needs_it_no_more(tmp_path: Path) -> None:
    (tmp_path / "dropper.csv").write_text(FILE)
    case = find_case("ac_simple").read_text()
    key = next(line for line in case.splitlines() if line.startswith("stiffness_N_per_m = 1e5"))
    (tmp_path / "case.toml").write_text(case.replace(key, 'curve_file = "dropper.csv"'))
    scene = load_scene(tmp_path / "case.toml")
    assert problem_of(scene) == problem_of(load(f"line.dropper.curve={POINTS}"))
    (tmp_path / "dropper.csv").unlink()
    again = recorded(scene)
    assert problem_of(again) == problem_of(scene)


def test_all_tables_of_droppers_take_a_file(tmp_path: Path) -> None:
    file = tmp_path / "dropper.csv"
    file.write_text(FILE)
    own = "line.auxiliary_wire.dropper"
    scene = load_scene(
        "shinkansen_compound", [f"{own}.stiffness_N_per_m=", f"{own}.curve_file={file}"]
    )
    kinds = {group.name: group.kind.curve for group in problem_of(scene).line.droppers}
    assert list(kinds.values()).count(tuple(map(tuple, POINTS))) == 1
    free = Path(__file__).parents[2] / "docs/examples/two_messengers.toml"
    links = list(enumerate(load_scene(free).line.links or []))
    number, first = next((i, link) for i, link in links if link.type == "droppers")
    key = f"line.links.{number}"
    words = [f"{key}.stiffness_N_per_m=", f"{key}.axial_stiffness_N=", f"{key}.curve_file={file}"]
    of_links = load_scene(free, words)
    assert file_key_of(f"{key}.curve", of_links.origin) == f"{key}.curve_file"
    found = problem_of(of_links)
    assert next(g for g in found.line.droppers if g.name == first.name).kind.curve is not None


@pytest.mark.parametrize(
    ("curve", "sentence"),
    [
        ("[[0, 0]]", "at least 2"),
        ("[[0, 0], [1e-3]]", "at least 2"),
        (f"{[[1e-3 * i, 10.0 * i] for i in range(21)]}", "at most 20"),
        ("[[0, 5], [1e-3, 50]]", "must begin with strain 0 and tension 0, but begins with 0, 5"),
        ("[[1e-4, 0], [1e-3, 50]]", "but begins with 0.0001, 0"),
        ("[[0, 0], [2e-3, 50], [1e-3, 60]]", "its strains in ascending order, but 0.001 follows"),
        ("[[0, 0], [1e-3, 50], [1e-3, 60]]", "its strains in ascending order, but 0.001 follows"),
        ("[[0, 0], [1e-3, -5]]", "its tensions in ascending order, but -5 follows 0"),
        ("[[0, 0], [1e-3, 50], [2e-3, 40]]", "its tensions in ascending order, but 40 follows 50"),
        ("[[0, 0], [1e-3, 50], [2e-3, 50]]", "its tensions in ascending order, but 50 follows 50"),
        ("[[0, 0], [1e-12, 50]]", "must have slopes of 1 to 1e+09 N, but has 5e+13 N between"),
        ("[[0, 0], [1e-3, 50], [1, 50.1]]", "but has 0.1 N between strains 0.001 and 1"),
        ("[[0, 0], [1e-3, nan]]", "finite"),
    ],
)
def test_what_is_no_curve_is_refused_in_a_sentence(curve: str, sentence: str) -> None:
    with pytest.raises(InputError) as refused:
        load(f"line.dropper.curve={curve}")
    told = str(refused.value)
    assert sentence in told and "line.dropper.curve" in told and "\n" not in told


def test_one_of_stiffness_and_curve_is_given() -> None:
    for words, sentence in (
        ([f"line.dropper.curve={POINTS}"], "stiffness_N_per_m and curve are given"),
        ([NO_STIFFNESS], "axial_stiffness_N, curve, but none is given"),
    ):
        with pytest.raises(InputError, match=sentence):
            load_scene("ac_simple", words)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "it holds no pairs of numbers"),
        ("0, 0\n1e-3; 50\n", "its line 2 must hold two numbers and a comma between"),
        ("0, 0\n1e-3, 50\n2e-3, 40\n", "its tensions in ascending order, but 40 follows 50"),
    ],
)
def test_files_that_are_no_curve_are_refused(tmp_path: Path, text: str, sentence: str) -> None:
    file = tmp_path / "dropper.csv"
    file.write_text(text)
    with pytest.raises(InputError, match=sentence) as refused:
        load(f"line.dropper.curve_file={file}")
    assert "line.dropper.curve" in str(refused.value) and "\n" not in str(refused.value)


def test_a_file_that_is_none_is_refused_and_nothing_else_is_told() -> None:
    for words, sentence in (
        (["line.dropper.curve_file=/dev/zero"], "it is no regular file"),
        (["line.dropper.curve_file=none.csv"], "cannot be read: no such file"),
        (["line.dropper.curve_file=a.csv", f"line.dropper.curve={POINTS}"], "is given too"),
    ):
        with pytest.raises(InputError) as refused:
            load(*words)
        told = str(refused.value)
        assert told.startswith("line.dropper.curve_file is") and sentence in told
        assert "\n" not in told
