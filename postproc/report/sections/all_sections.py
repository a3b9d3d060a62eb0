"""The sections of a report in their order."""

from __future__ import annotations

from collections.abc import Callable

from catenary.postproc.report.sections import acceptance, contact_force, line, run
from catenary.postproc.report.sections.section import EvaluatedRun, Section

SECTIONS: list[Callable[[EvaluatedRun], Section]] = [
    acceptance.status,
    acceptance.section,
    contact_force.section,
    line.in_motion,
    line.at_rest,
    line.from_above,
    run.effects,
    run.section,
]
