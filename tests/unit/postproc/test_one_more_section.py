"""A section of a report is one function: the page, its files and `run.plot` have what it gives."""

from __future__ import annotations

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from catenary.postproc.evaluate import statistics
from catenary.postproc.files.own_files import PICTURES
from catenary.postproc.read.results import Results
from catenary.postproc.report.page import EvaluatedRun, Folded, Picture, Section, SectionEntry, Text
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.report import SECTIONS, drawings, write_report
from catenary.postproc.report.study_table import texts_table


def speed_section(run: EvaluatedRun) -> Section:
    """The course of the train: a sentence, a table, a picture, and what is folded."""
    time = run.results.time
    position = run.results.column("contact_position", 0)

    def draw() -> Figure:
        figure = figures.new_figure(3.0)
        figure.add_subplot().plot(time, position)
        return figure

    rows = [["start", f"{position[0]:.1f} m"], ["end", f"{position[-1]:.1f} m"]]
    return Section(
        "Course <of> the train",
        [Text(f"{run.results.n_pantographs} heads pass."), texts_table(["place", "at"], rows, {1})],
        [Picture("course", "Position over time.", draw)],
        [Folded("All steps", Text(f"{time.size} rows", "code"))],
    )


@pytest.mark.study
def test_a_section_is_one_function(
    run_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    entries = [*SECTIONS, SectionEntry("speed", speed_section)]
    monkeypatch.setattr("catenary.postproc.report.report.SECTIONS", entries)
    with pytest.raises(ValueError, match=r"PICTURES of section speed lacks .'course'"):
        write_report(run_folder, tmp_path)
    monkeypatch.setitem(PICTURES, "speed", ("course",))
    files = {path.name for path in write_report(run_folder, tmp_path).files}
    assert "course.png" in files
    page = (tmp_path / "report.html").read_text().replace("\N{NO-BREAK SPACE}", " ")
    assert page.index('<h2 id="run">The run</h2>') < page.index(
        '<h2 id="speed">Course &lt;of&gt; the train</h2>'
    )
    own = page[page.index('id="speed">Course') :]
    with Results(run_folder) as results:
        first = results.column("contact_position", 0)[0]
        shown = [name for name, *_ in drawings(results, statistics.evaluate(results))]
    assert shown[-1] == "course"
    assert f'<tr><td class="w">start</td><td class="n">{first:.1f} m</td></tr>' in own
    assert "<p>2 heads pass.</p>" in own and 'class="n">at</th>' in own
    assert "<figcaption>Position over time.</figcaption>" in own
    assert "<details><summary>All steps</summary>" in own and "<pre>8001 rows</pre>" in own
