"""Sentences on incidents for the plan, the result file, the summary and the report."""

from __future__ import annotations

from typing import Any

from catenary.cases.scene.run.incidents import (
    DropperBreakTable,
    Incident,
    TensionLossTable,
    at_step,
    dropper_place,
)
from catenary.cases.scene.scene import Scene
from catenary.meshgen.line import Line
from catenary.solver.problem.problem import Problem


def incident_facts(scene: Scene, problem: Problem) -> list[dict[str, Any]]:
    """Type, time [s] and a sentence of each incident that is simulated, in order of time; of a
    dropper its place [m].

    Not collective.
    """
    dt = problem.numerics.dt
    found = [
        {
            "type": table.type,
            "time_s": at_step(table.at_s, dt),
            **_place(table, problem.line),
            "says": _sentence(table, problem.line),
        }
        for table in scene.incidents
        if table.type in problem.effects
    ]
    return sorted(found, key=lambda fact: float(str(fact["time_s"])))


def _place(table: Incident, line: Line) -> dict[str, float]:
    return {"at_m": dropper_place(table, line)} if isinstance(table, DropperBreakTable) else {}


def _sentence(table: Incident, line: Line) -> str:
    if isinstance(table, DropperBreakTable):
        x = dropper_place(table, line)
        return f"dropper {table.dropper} of span {table.span}, at {x:g} m, breaks"
    if isinstance(table, TensionLossTable):
        left = table.share * line.wire(table.wire).tension / 1e3
        name = table.wire.replace("_", " ")
        return f"the tension of the {name} falls to {left:.4g} kN, {table.share:g} of what it was"
    return (
        f"pantograph {table.pantograph} is lowered: its static force goes over to "
        f"{table.force_N:g} N within {table.within_s:g} s; its head is caught {table.drop_m:g} m "
        "lower"
    )
