"""The ParaView of this machine opens a run, plays it, and its pictures show what they should.

Run by ``make test-paraview``; under ``xvfb-run``, for Debian's ParaView draws on a screen only.
"""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from program import catenary

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
found = {}
for name in sys.argv[2:]:
    reader = getattr(pv, sys.argv[1])
    source = reader(**{"FileName" if "Xdmf3" in sys.argv[1] else "FileNames": [name]})
    source.UpdatePipelineInformation()
    times = list(source.TimestepValues) if hasattr(source, "TimestepValues") else []
    ranges = []
    for time in times or [0.0]:
        source.UpdatePipeline(time)
        about = source.GetDataInformation()
        array = source.PointData.GetArray("uplift")
        uplift = list(array.GetRange()) if array else None
        ranges.append([about.GetNumberOfPoints(), list(about.GetBounds()), uplift])
    found[name] = {"times": times, "ranges": ranges}
print("FOUND " + json.dumps(found))
"""


def on_screen(*words: object) -> str:
    """What a program of ParaView prints under a screen of its own."""
    command = ["xvfb-run", "-a", "-s", "-screen 0 1600x900x24", *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


@pytest.fixture(scope="module", params=[1, 2], ids=["one pantograph", "two pantographs"])
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short run, opened for ParaView."""
    out = tmp_path_factory.mktemp("paraview") / "run"
    two = 'train.pantographs=[{name="reference"},{name="reference",behind_m=50}]'
    more = ["train.start_m=180", two] if request.param == 2 else []
    words = ["run", "en50318_2002", "-o", out, "--short", "--set", "output.field_every_m=2", *more]
    for line in (words, ["paraview", out]):
        done = catenary(*map(str, line), cwd=out.parent)
        assert done.code == 0, done.stderr
    return out


@pytest.mark.parametrize("reader", ["Xdmf3ReaderS", "XDMFReader"])
def test_both_readers_play_all_times(folder: Path, reader: str, tmp_path: Path) -> None:
    probe = tmp_path / "probe.py"
    probe.write_text(PROBE)
    names = [folder / "fields.xdmf", *(folder / "paraview" / f"{name}.xdmf" for name in
             ("pantographs", "forces", "surroundings"))]  # fmt: skip
    text = on_screen("pvpython", probe, reader, *names)
    found = json.loads(text.split("FOUND ", 1)[1].splitlines()[0])
    with Results(folder) as results:
        n, heads = results.n_pantographs, results.extremes("head_height")
        first, last = results.channel("contact_position")[[0, -1]]
    line, arms, forces, around = (found[str(name)] for name in names)
    assert line["times"] == arms["times"] == forces["times"] and len(line["times"]) > 20
    assert [row[0] for row in arms["ranges"]] == [5 * n] * len(arms["times"])
    assert [row[0] for row in forces["ranges"]] == [n] * len(arms["times"])
    for row, place in ((arms["ranges"][0], first), (arms["ranges"][-1], last)):
        low, high = row[1][:2]
        assert low == pytest.approx(place.min() - 0.45, abs=2.5)
        assert high >= place.max() and high < place.max() + 4.5
    uplift = np.array([row[2] for row in line["ranges"]])
    assert 0.01 < uplift.max() < 0.2 and np.ptp(uplift[:, 1]) > 0.005
    assert around["ranges"][0][1][5] > heads.max()


def test_pictures_show_line_and_pantographs(folder: Path, tmp_path: Path) -> None:
    with Results(folder) as results:
        n, end = results.n_pantographs, results.simulated
    pictures = []
    for share in (0.3, 0.8):
        picture = tmp_path / f"{share}.png"
        script = folder / "paraview" / "view.py"
        on_screen("pvpython", script, "--picture", picture, "--time", share * end)
        with Image.open(picture) as image:
            pictures.append(np.asarray(image.convert("RGB")).astype(int))
    for pixels in pictures:
        red, green, blue = np.moveaxis(pixels, 2, 0)
        leading = (red > green + 60) & (red > blue + 60) & (green < 90)
        trailing = (blue > red + 60) & (blue > green + 20)
        assert leading.sum() > 200, "the leading pantograph is red"
        # The scale of colours is blue at its lower end.
        assert (trailing[:, :1000].sum() > 200) == (n == 2)
        dark = pixels.sum(axis=2) < 330
        assert dark.any(axis=0).mean() > 0.9, "wires go from side to side"
        assert 0.005 < dark.mean() < 0.2
    assert (pictures[0] != pictures[1]).any(axis=2).mean() > 0.01
