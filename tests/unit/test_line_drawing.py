"""`catenary mesh CASE -o NAME.png` and `NAME.svg`: the line at rest, drawn to scale."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from PIL import Image
from scenes import load_scene
from verb_runner import invoke

from catenary.cases.run.scene_mesh import draw_scene


@pytest.mark.parametrize(
    ("case", "drawn"),
    [
        ("re330_stitched", ["stitched: side view, heights 20 times", "stitch wire"]),
        ("overlap", ["simple: side view, heights 100 times", "cross-section at 495 m"]),
        ("tramway", ["single: side view, heights", "plan view, lateral positions"]),
    ],
)
def test_a_drawing_shows_the_three_views(case: str, drawn: list[str], tmp_path: Path) -> None:
    out = tmp_path / "line.svg"
    draw_scene(load_scene(case, shortened=True), out, force=False)
    said = " ".join(re.findall(r"([^<>]+)</text>", out.read_text(encoding="utf-8")))
    for words in drawn:
        assert words in said, said


def test_views_are_to_scale(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A metre of height is as many times longer on paper than one along the track as is said."""
    seen: list[Figure] = []
    monkeypatch.setattr(Figure, "savefig", lambda self, *_, **__: seen.append(self))
    strips = ["pantographs.three_masses.strips.length_m=1.45"]
    draw_scene(load_scene("overlap", strips, shortened=True), tmp_path / "a.svg", force=False)
    for axes in seen[0].axes:
        box = axes.get_window_extent()
        (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
        ratio = (box.height / (y1 - y0)) / (box.width / (x1 - x0))
        told = re.search(r"(\d+) times", axes.get_title("left"))
        if told is None:
            assert axes.get_aspect() == 1.0
        else:
            assert ratio == pytest.approx(float(told[1]), rel=1e-6)
    plan = seen[0].axes[1]
    assert plan.get_ylim()[1] > 0.725 and "working length of the pan head" in plan.get_title("left")


def test_a_picture_is_written_once_and_only_by_its_suffix(tmp_path: Path) -> None:
    out = tmp_path / "line.png"
    words = "mesh", "tramway", "--set", "line.n_spans=20", "-o"
    done = invoke(*words, str(out))
    assert done.exit_code == 0 and "the line at rest from" in done.output, done.output
    with Image.open(out) as picture:
        assert picture.size == (1170, 871) and len(picture.convert("L").getcolors()) > 20
    again = invoke(*words, str(out))
    assert again.exit_code == 2 and "exists already" in again.output
    other = invoke(*words, str(tmp_path / "line.pdf"))
    assert other.exit_code == 2 and "ends in .msh or .png or .svg" in other.output


@pytest.mark.parametrize(
    ("case", "arms"),
    [("en50318_2002", ""), ("ac_simple", " arms sketched,"), ("ac_simple_3d", " arms at rest,")],
)
def test_the_title_of_the_cross_section_names_arms_only_where_they_are_drawn(
    case: str, arms: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    seen: list[Figure] = []
    monkeypatch.setattr(Figure, "savefig", lambda self, *_, **__: seen.append(self))
    draw_scene(load_scene(case, shortened=True), tmp_path / "a.svg", force=False)
    title = " ".join(seen[0].axes[2].get_title("left").split())
    assert re.fullmatch(rf"cross-section at [0-9.]+ m,{arms} hollow: at [0-9.]+ m", title), title
