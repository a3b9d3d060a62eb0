"""A run whose line something other than its train sets into motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from catenary.cases.run.arrivals import end_sentences
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.time_loop.views.observers import Observer
from catenary.solver.waves.excitation import Excitation, as_facts
from catenary.solver.waves.excitation_load import load_of


@dataclass(frozen=True)
class ExcitedRun:
    """Such a run, beside its scene.

    Attributes
    ----------
    problem : the scene's problem with a train that exerts no force, see
        `cases.studies.waves.excited`
    excitation : excitation of the contact wire
    snapshot_every : time between snapshots unless the scene sets it [s]
    watching : returns the observers beside the recorder, for a line at rest
    """

    problem: Problem
    excitation: Excitation
    snapshot_every: float
    watching: Callable[[LineAtRest], Sequence[Observer]]

    def excite(self, rest: LineAtRest) -> None:
        """Put the excitation on a line at rest. Not collective."""
        rest.model.loads.append(load_of(self.excitation, rest.model, self.problem.numerics.dt))

    def attributes(self) -> dict[str, Any]:
        """Attributes of the result file that replace those of a train."""
        sentence = self.excitation.in_words()
        return {
            "excitation": as_facts(self.excitation),
            "pantographs": [
                {"kind": self.excitation.kind, "model": "none", "description": sentence}
            ],
            "arrivals": {"ends": list(end_sentences(self.problem))},
        }
