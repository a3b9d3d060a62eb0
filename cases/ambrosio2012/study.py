"""The paper's study: two pantographs at several separations, with light and average damping.

``study.toml`` lists runs and statements, ``figures.py`` redraws the paper's figures 8 to 14.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catenary.cases.studies.paper_study import PaperStudy

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene
    from catenary.cases.studies.case_study import StudyRun, StudyVariant
    from catenary.postproc.read.results import Results
    from catenary.postproc.report.study_report import Study

TABLE = Path(__file__).with_name("study.toml")


def variants(scene: Scene, shortened: bool) -> list[StudyVariant]:
    """All runs; only those of the readings that the figures show keep their results."""
    return PaperStudy.read(TABLE, shortened).variants(scene)


def measure(results: Results) -> dict[str, Any]:
    """Beside the summary: slack droppers by passage, onset of the uplift, wave and train speed."""
    from catenary.cases.ambrosio2012 import passages

    return passages.measure(results)


def conclude(runs: Mapping[str, StudyRun]) -> Study:
    """Verdicts, search, ranking and figures of the runs that are done."""
    from catenary.cases.ambrosio2012 import figures
    from catenary.cases.studies.paper_study import conclude as draw_up

    return draw_up(PaperStudy.read(TABLE), runs, figures.draw)
