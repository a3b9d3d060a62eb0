"""A measured passage beside a run as data: histories of both, figures, findings and remarks."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from catenary.postproc.measurements.alignment import Alignment

# Source of the tolerances that a description may replace.
LINE_TEST = "comparison with a line test, EN 50318"


@dataclass(frozen=True)
class Finding:
    """An error of the measurement, or of its description.

    Attributes
    ----------
    kind : "shift", "drift", "gain", "filter", "sign", "unit", "missing pantograph",
        "other pantograph", "unlike", "height", "gaps" or "supports"
    pantograph : its name, empty if of none
    text : a sentence
    value : of what was found, in SI units, NaN without
    """

    kind: str
    pantograph: str
    text: str
    value: float = float("nan")


@dataclass(frozen=True)
class Compared:
    """A figure of run and measurement.

    Attributes
    ----------
    name, pantograph, unit : in words; the unit is that of the values
    run, measured : values
    tolerance : how far they may differ, NaN where none is known
    passed : None if it is not judged
    because : why it is not judged
    source : of the tolerance
    """

    name: str
    pantograph: str
    unit: str
    run: float
    measured: float
    tolerance: float
    passed: bool | None
    because: str
    source: str


@dataclass(frozen=True)
class Overlay:
    """Histories of a pantograph on the run's places.

    Attributes
    ----------
    pantograph : its name
    place : (n,) of the measured samples on the run's line [m]
    measured, run : (n,) forces below the cut-off [N]
    measured_height, run_height : (n,) heights of the head likewise [m], NaN in gaps of the
        measured ones, None if not measured
    alignment : None if it could not be aligned
    """

    pantograph: str
    place: np.ndarray
    measured: np.ndarray
    run: np.ndarray
    measured_height: np.ndarray | None
    run_height: np.ndarray | None
    alignment: Alignment | None


@dataclass(frozen=True)
class UpliftAtSupports:
    """Largest uplifts (n,) at supports [m], by their places in the run [m]."""

    place: np.ndarray
    measured: np.ndarray
    run: np.ndarray


@dataclass
class Comparison:
    """A measured passage beside a run.

    Attributes
    ----------
    measured, run, lead : names of both, and a sentence on the run
    remarks : sentences on damage, on the noise floor, and on what cannot be told apart
    overlays : of the pantographs that were measured
    uplift : None if it was not measured
    figures : of run and measurement
    findings : errors; empty if there is none
    """

    measured: str
    run: str
    lead: str
    remarks: list[str]
    overlays: list[Overlay] = field(default_factory=list)
    uplift: UpliftAtSupports | None = None
    figures: list[Compared] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)

    @property
    def passed(self) -> bool | None:
        """Whether all judged figures are within their tolerances, None if none is judged."""
        judged = [one.passed for one in self.figures if one.passed is not None]
        return all(judged) if judged else None
