"""Reports in a browser: they ask the network for nothing, draw every picture, and can be zoomed.

The browser is Chromium without a window. A script that is put into a copy of the page says what it
finds; the browser's own logs say what the page asked for and complained of.
"""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from verb_runner import invoke

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
pytestmark = [
    pytest.mark.process,
    pytest.mark.study,
    pytest.mark.skipif(BROWSER is None, reason="there is no chromium or google-chrome"),
]
# Pulls a frame with the mouse over the middle of every plot; tells how many marks each has, the
# ranges of the axes of its first panel before and after, and the room between the buttons and the
# legend and between the names of the axes and the caption [px], which is null without a legend.
ZOOM = """
<script>
addEventListener("load", async () => {
  const found = [];
  for (const plot of document.querySelectorAll(".plot")) {
    const ranges = () => ["xaxis", "yaxis"].map(axis => plot._fullLayout[axis].range.slice());
    plot.scrollIntoView();
    const panel = plot.querySelector(".nsewdrag"), box = panel.getBoundingClientRect();
    const mouse = (target, kind, share) => target.dispatchEvent(new MouseEvent(kind, {
      bubbles: true, cancelable: true, view: window,
      clientX: box.left + share * box.width, clientY: box.top + share * box.height}));
    const before = ranges();
    mouse(panel, "mousemove", 0.3);
    mouse(panel, "mousedown", 0.3);
    mouse(document, "mousemove", 0.5);
    mouse(document, "mousemove", 0.7);
    mouse(document, "mouseup", 0.7);
    await new Promise(done => setTimeout(done, 400));
    const marks = plot.querySelectorAll(".lines path, .points path").length;
    const boxes = what => [...plot.querySelectorAll(what)].map(one => one.getBoundingClientRect());
    const buttons = boxes(".modebar-group").map(box => box.bottom);
    const names = boxes(".infolayer [class^=g-x]").map(box => box.bottom);
    const caption = plot.closest("figure").querySelector("figcaption").getBoundingClientRect();
    const legend = boxes(".legend .traces").map(box => box.top);
    const gaps = [Math.min(...legend) - Math.max(...buttons), caption.top - Math.max(...names)];
    found.push({name: plot.ariaLabel, marks, before, after: ranges(), gaps, legend, names});
  }
  const said = document.createElement("pre");
  said.id = "found";
  said.textContent = JSON.stringify(found);
  document.body.append(said);
});
</script>
"""


# Tells how many marks every plot has, how wide it and its place are, and where the names of axes
# end and their ticks begin.
NARROW = """
<script>
addEventListener("load", async () => {
  await new Promise(done => setTimeout(done, 400));
  const said = [...document.querySelectorAll(".plot")].map(plot => {
    const boxes = what => [...plot.querySelectorAll(what)].map(one => one.getBoundingClientRect());
    return {name: plot.ariaLabel, marks: plot.querySelectorAll(".lines path, .points path").length,
            needs: plot.parentElement.scrollWidth, has: plot.parentElement.clientWidth,
            axes: ["y", "y2"].filter(axis => boxes(`.${axis}title`).length).map(axis => [
              ...boxes(`.${axis}title`).flatMap(box => [box.left, box.right]),
              Math.min(...boxes(`.${axis}tick text`).map(box => box.left))])};
  });
  parent.postMessage(JSON.stringify(said), "*");
});
</script>
"""
PHONE = """
<iframe src="{page}" style="border: 0; width: 400px; height: 900px"></iframe><pre id="found"></pre>
<script>onmessage = event => found.textContent = event.data;</script>
"""


class Visit(NamedTuple):
    """A page in the browser: what it became, the addresses it asked for, and its console."""

    page: str
    asked: set[str]
    console: list[str]


def visit(page: Path, folder: Path) -> Visit:
    log = folder / "net.json"
    done = subprocess.run(
        [
            str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--window-size=1280,900",
            "--host-resolver-rules=MAP * ~NOTFOUND", "--enable-logging=stderr",
            f"--user-data-dir={folder / 'profile'}", f"--log-net-log={log}",
            "--virtual-time-budget=60000", "--dump-dom", page.as_uri(),
        ],
        capture_output=True, text=True, timeout=240, check=True,
    )  # fmt: skip
    requests = (one.get("params", {}) for one in json.loads(log.read_text())["events"])
    # The browser has errands of its own, which have no origin.
    asked = {
        one["url"] for one in requests if one.get("initiator", "not an origin") != "not an origin"
    }
    lines = done.stderr.splitlines()
    return Visit(done.stdout, asked, [line for line in lines if "CONSOLE" in line])


def said(seen: Visit) -> list[dict[str, Any]]:
    """What a script found of the plots."""
    found = re.search('<pre id="found">(.*?)</pre>', seen.page, re.DOTALL)
    assert found is not None
    plots: list[dict[str, Any]] = json.loads(html.unescape(found[1]))
    return plots


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("report")
    for words in (("run", "ac_simple", "--short", "-q", "-o"), ("report", "--interactive")):
        done = invoke(*words, str(out))
        assert done.exit_code == 0, done.output
    return out


def test_every_plot_is_drawn_and_zoomed(report: Path, tmp_path: Path) -> None:
    page = (report / "report_interactive.html").read_text(encoding="utf-8")
    copy = tmp_path / "report.html"
    copy.write_text(page.replace("</body>", f"{ZOOM}</body>"), encoding="utf-8")
    seen = visit(copy, tmp_path)
    assert not seen.asked and not seen.console
    plots = said(seen)
    assert len(plots) == page.count('<div class="plot"') > 10
    for plot in plots:
        assert plot["marks"] > 0, plot["name"]
        # Half of a letter's height.
        assert plot["names"] and plot["gaps"][1] > 6.0, plot["name"]
        assert not plot["legend"] or plot["gaps"][0] > 0.0, plot["name"]
        for (low, high), (start, end) in zip(plot["before"], plot["after"], strict=True):
            # The frame is 0.4 of the panel; a pixel of the panel's least side is 1 % of it.
            assert end - start == pytest.approx(0.4 * (high - low), abs=0.02 * (high - low))
            assert low < start < end < high


def test_plots_fit_a_phone(report: Path, tmp_path: Path) -> None:
    page = (report / "report_interactive.html").read_text(encoding="utf-8")
    copy, phone = tmp_path / "report.html", tmp_path / "phone.html"
    copy.write_text(page.replace("</body>", f"{NARROW}</body>"), encoding="utf-8")
    phone.write_text(PHONE.format(page=copy.name), encoding="utf-8")
    seen = visit(phone, tmp_path)
    assert not seen.console
    plots = said(seen)
    assert len(plots) == page.count('<div class="plot"') > 10
    for plot in plots:
        assert plot["marks"] > 0 and plot["needs"] == plot["has"] < 400, plot
        assert plot["axes"]
        for left, right, ticks in plot["axes"]:
            assert 0.0 <= left < right <= ticks, plot


def test_the_plain_form_asks_for_nothing(report: Path, tmp_path: Path) -> None:
    seen = visit(report / "report.html", tmp_path)
    assert not seen.asked and not seen.console and "Acceptance" in seen.page


def test_requests_and_errors_are_seen(tmp_path: Path) -> None:
    """Those of a page that has both: the other tests could fail."""
    page = tmp_path / "page.html"
    page.write_text(
        '<img src="http://picture.invalid/"><script>fetch("http://data.invalid/")'
        '.catch(() => 0); throw new Error("planted")</script>'
    )
    seen = visit(page, tmp_path)
    assert seen.asked == {"http://picture.invalid/", "http://data.invalid/"}
    assert len(seen.console) == 1 and "planted" in seen.console[0]
