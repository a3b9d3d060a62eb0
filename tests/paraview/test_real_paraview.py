"""The ParaView of this machine opens a run, plays it, and its pictures show what they should.

Run by ``make test-paraview``; under ``xvfb-run``, for Debian's ParaView draws on a screen only.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from program import catenary

from catenary.postproc.film.open_in_paraview import SCREEN_OF_ITS_OWN
from catenary.postproc.read.results import Results

TOOLS = ("pvpython", "xvfb-run")
pytestmark = [
    pytest.mark.process,
    pytest.mark.skipif(
        any(shutil.which(tool) is None for tool in TOOLS),
        reason="needs ParaView's Python and a screen: apt-get install python3-paraview xvfb",
    ),
]

# Opens a file with a reader, steps through its times, prints what is there.
PROBE = """
import json, sys
from paraview import simple as pv, servermanager
from vtkmodules.vtkCommonDataModel import vtkCompositeDataSet

def ranges_in(arrays):
    return {arrays.GetArrayName(i): arrays.GetArray(i).GetRange(-1)
            for i in range(arrays.GetNumberOfArrays())}

def leaves(data):
    several = data.IsA("vtkMultiPieceDataSet")
    for i in range(data.GetNumberOfPieces() if several else data.GetNumberOfBlocks()):
        leaf = data.GetPiece(i) if several else data.GetBlock(i)
        named = data.HasMetaData(i) and data.GetMetaData(i).Has(vtkCompositeDataSet.NAME())
        name = data.GetMetaData(i).Get(vtkCompositeDataSet.NAME()) if named else None
        if leaf.IsA("vtkCompositeDataSet"):
            yield from leaves(leaf)
        else:
            yield name, [leaf.GetNumberOfPoints(), leaf.GetNumberOfCells(),
                         {**ranges_in(leaf.GetPointData()), **ranges_in(leaf.GetCellData())}]

found = {}
for name in sys.argv[2:]:
    reader = getattr(pv, sys.argv[1])
    source = reader(**{"FileName" if "Xdmf3" in sys.argv[1] else "FileNames": [name]})
    source.UpdatePipelineInformation()
    times = list(source.TimestepValues) if hasattr(source, "TimestepValues") else []
    ranges, blocks = [], []
    for time in times or [0.0]:
        source.UpdatePipeline(time)
        about = source.GetDataInformation()
        ranges.append([about.GetNumberOfPoints(), list(about.GetBounds())])
        data = servermanager.Fetch(source)
        blocks.append(list(leaves(data)) if data.IsA("vtkCompositeDataSet") else [])
    found[name] = {"times": times, "ranges": ranges, "blocks": blocks}
print("FOUND " + json.dumps(found))
"""
# Opens a state, goes to times, saves a picture of each and prints where the camera looks.
OPEN_STATE = """
import json, sys
from paraview import simple as pv
pv.LoadState(sys.argv[1])
pv._DisableFirstRenderCameraReset()
view, scene, seen = pv.GetActiveView(), pv.GetAnimationScene(), []
view.ViewSize = [1280, 480]
for number, time in enumerate(sys.argv[3:]):
    scene.AnimationTime = float(time)
    pv.SaveScreenshot(sys.argv[2] + "/%d.png" % number, view, ImageResolution=[1280, 480])
    seen.append([scene.AnimationTime, list(view.CameraFocalPoint), view.CameraParallelScale])
print("FOUND " + json.dumps(seen))
"""
FIELDS = '["uplift","displacement","velocity","tension","bending_moment","dropper_force"]'


def on_screen(*words: object) -> str:
    """What a program of ParaView prints under a screen of its own."""
    for attempt in range(3):
        number = str(5200 + 100 * attempt + os.getpid() % 5000)
        command = ["xvfb-run", "-a", "-n", number, "-s", SCREEN_OF_ITS_OWN, *map(str, words)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=240)
        # Two screens that are made at one time may get one number.
        if "X server connection" not in done.stderr:
            break
    assert done.returncode == 0, done.stderr[-2000:]
    assert not done.stderr.strip(), done.stderr[-2000:]
    return done.stdout


@pytest.fixture(scope="module", params=[1, 2], ids=["one pantograph", "two pantographs"])
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short run, opened for ParaView."""
    out = tmp_path_factory.mktemp("paraview") / "run"
    two = 'train.pantographs=[{name="reference"},{name="reference",behind_m=50}]'
    more = ["train.start_m=210", two] if request.param == 2 else []
    more += [f"output.fields={FIELDS}", "output.field_every_m=2"]
    if request.param == 2:
        more += ["output.field_window_m=[150, 120]"]
    words = ["run", "en50318_2002", "-o", out, "--short", "--set", *more]
    for line in (words, ["paraview", out]):
        done = catenary(*map(str, line), cwd=out.parent)
        assert done.code == 0, done.stderr
    return out


@pytest.mark.parametrize("reader", ["Xdmf3ReaderS", "XDMFReader"])
def test_both_readers_play_all_times(folder: Path, reader: str, tmp_path: Path) -> None:
    probe = tmp_path / "probe.py"
    probe.write_text(PROBE)
    names = [folder / "fields.xdmf", *(folder / "paraview" / f"{name}.xdmf" for name in
             ("pantographs", "forces", "train", "track"))]  # fmt: skip
    text = on_screen("pvpython", probe, reader, *names)
    found = json.loads(text.split("FOUND ", 1)[1].splitlines()[0])
    with Results(folder) as results:
        n, heads = results.n_pantographs, results.extremes("head_height")
        first, last = results.channel("contact_position")[[0, -1]]
    line, arms, forces, train, track = (found[str(name)] for name in names)
    assert line["times"] == arms["times"] == forces["times"] and len(line["times"]) > 20
    assert train["times"] == line["times"]
    # Head, arms and lift of each.
    (points,) = {row[0] for row in arms["ranges"]}
    assert points == n * (6 + 9 + 6)
    assert [row[0] for row in forces["ranges"]] == [n] * len(arms["times"])
    for row, place in ((arms["ranges"][0], first), (arms["ranges"][-1], last)):
        low, high = row[1][:2]
        assert low == pytest.approx(place.min() - 0.7, abs=2.5)
        assert high == pytest.approx(place.max() + 0.7, abs=2.5)
    assert track["ranges"][0][1][5] == 0.0
    assert all(row[1][5] < heads.max() - 1.0 for row in train["ranges"])
    names = ["contact_wire", "messenger_wire", "droppers", "steady_arms", "masts"]
    if reader == "XDMFReader":
        assert all([name for name, _ in blocks] == names for blocks in line["blocks"])
    contact = [blocks[0][1] for blocks in line["blocks"]]
    largest = np.array([about[2]["uplift"][1] for about in contact])
    assert 0.01 < largest.max() < 0.2 and np.ptp(largest) > 0.005
    assert 0.1 < max(about[2]["velocity"][1] for about in contact) < 5.0
    assert {tuple(about[2]["tension"]) for about in contact} == {(20000.0, 20000.0)}
    assert 1.0 < max(about[2]["bending_moment"][1] for about in contact) < 50.0
    droppers = [blocks[2][1] for blocks in line["blocks"]]
    assert 80.0 < max(about[2]["dropper_force"][1] for about in droppers) < 400.0
    assert {about[2]["dropper_state"][1] for about in droppers} == {1.0}
    assert all(blocks[4][1][2] == {} for blocks in line["blocks"])
    # A window goes with the train, and shows as much of the line all the way.
    sizes = np.array([about[0] for about in contact])
    begins = [row[1][0] for row in line["ranges"]]
    if n == 2:
        assert sizes.max() < 700 and np.ptp(sizes) < 20 and begins[-1] > begins[0] + 100.0
    else:
        assert np.ptp(sizes) == np.ptp(begins) == 0


def _looks_right(pixels: np.ndarray, n: int) -> None:
    """A picture has wires from side to side, a red pantograph and, of two, a blue one."""
    red, green, blue = np.moveaxis(pixels, 2, 0)
    leading = (red > green + 60) & (red > blue + 60) & (green < 90)
    # Of the blues of the wires' scale none has so little red and green.
    trailing = (blue > 60) & (red < 0.27 * blue) & (green < 0.72 * blue)
    # The scale of colours stands in the upper right corner.
    leading[:100, 900:] = trailing[:100, 900:] = False
    assert leading.sum() > 200, "the leading pantograph is red"
    assert (trailing.sum() > 200) == (n == 2)
    dark = pixels.sum(axis=2) < 330
    assert dark.any(axis=0).mean() > 0.9, "wires go from side to side"
    assert 0.005 < dark.mean() < 0.2


def _pixels(picture: Path) -> np.ndarray:
    with Image.open(picture) as image:
        return np.asarray(image.convert("RGB")).astype(int)


def test_pictures_show_line_and_pantographs(folder: Path, tmp_path: Path) -> None:
    with Results(folder) as results:
        n, end = results.n_pantographs, results.simulated
    pictures = []
    for share in (0.3, 0.8):
        picture = tmp_path / f"{share}.png"
        script = folder / "paraview" / "view.py"
        on_screen("pvpython", script, "--picture", picture, "--time", share * end)
        pictures.append(_pixels(picture))
        _looks_right(pictures[-1], n)
    assert (pictures[0] != pictures[1]).any(axis=2).mean() > 0.01


def test_a_state_opens_without_complaint_and_its_camera_follows(
    folder: Path, tmp_path: Path
) -> None:
    probe = tmp_path / "open_state.py"
    probe.write_text(OPEN_STATE)
    with Results(folder) as results:
        n, end = results.n_pantographs, results.simulated
        time, position = results.time, results.channel("contact_position").mean(axis=1)
    text = on_screen(
        "pvpython", probe, folder / "paraview" / "view.pvsm", tmp_path, 0.3 * end, 0.8 * end
    )
    seen = json.loads(text.split("FOUND ", 1)[1].splitlines()[0])
    for number, (shown, focus, scale) in enumerate(seen):
        assert focus[0] == pytest.approx(np.interp(shown, time, position), abs=0.5)
        assert 20.0 < scale < 60.0
        _looks_right(_pixels(tmp_path / f"{number}.png"), n)


def test_from_above_the_wires_zigzag_and_move_sideways(tmp_path: Path) -> None:
    out = tmp_path / "run"
    more = [
        "line.n_spans=5",
        "evaluation.from_m=150",
        "evaluation.to_m=200",
        "output.field_every_m=2",
    ]
    words = ["run", "ac_simple_3d", "-o", out, "--set", *more]
    for line in (words, ["paraview", out, "--view", "plan", "--no-state"]):
        done = catenary(*map(str, line), cwd=out.parent)
        assert done.code == 0, done.stderr
    picture = tmp_path / "plan.png"
    on_screen("pvpython", out / "paraview" / "view.py", "--picture", picture, "--time", 1.0)
    pixels = _pixels(picture)
    red, green, blue = np.moveaxis(pixels, 2, 0)
    head = np.argwhere((red > green + 60) & (red > blue + 60) & (green < 90))
    head = head[head[:, 0] > 100]
    # The head lies across the track: more than a quarter of the picture's height, and little of its
    # width.
    ends = head[np.abs(head[:, 0] - 240) > 50]
    assert np.ptp(ends[:, 0]) > 120 and np.ptp(ends[:, 1]) < 40
    # Between the supports the contact wire leaves the middle by its stagger to both sides.
    dark = (pixels.sum(axis=2) < 330)[150:330]
    rows = np.argwhere(dark)[:, 0]
    assert np.ptp(rows) > 30
