"""What was simulated and what was not, and the run: sizes, times, versions, configuration."""

from __future__ import annotations

import json

import numpy as np

from catenary.postproc.channels.line_record import says
from catenary.postproc.evaluate.error_indicators import Indicators
from catenary.postproc.evaluate.wording import counted
from catenary.postproc.read.results import Results
from catenary.postproc.report.sections.section import EvaluatedRun, Folded, Section, Text, number
from catenary.postproc.report.study_table import texts_table
from catenary.postproc.report.summary import real_time_factor

# Counters of summary.json that say how the contact problem was solved, not what came of it.
_OF_THE_SOLVER = ("steps", "rounds", "repeated_steps", "pivoted_steps")


def effects(run: EvaluatedRun) -> Section:
    """Each effect, whether it is on, and why."""
    about = run.results.attributes
    rows = [
        [name, state, title, reason]
        for state in ("on", "off")
        for name, title, reason in about[f"effects_{state}"]
    ]
    heads = ["effect", "", "what it is", "why"]
    return Section("What was simulated and what was not", [texts_table(heads, rows)])


def section(run: EvaluatedRun) -> Section:
    """Facts on the run, and its whole configuration."""
    about = run.results.attributes
    rows = [*_facts(run.results), *_of_mesh(run.indicators)]
    phases = about.get("phase_wall_s", {}).items()
    rows += [(f"wall time, phase {name}", f"{number(wall, 2)} s") for name, wall in phases]
    rows += [(f"version of {name}", version) for name, version in about["versions"].items()]
    config = json.dumps(about["config"], indent=2, ensure_ascii=False)
    folded = Folded("Full configuration, defaults included", Text(config, "code"))
    return Section("The run", [texts_table(["", ""], rows)], folded=[folded])


def _of_mesh(found: Indicators) -> list[tuple[str, str]]:
    """The shortest waves of the mesh beside those that matter."""
    if np.isnan(found.resolved_frequency):
        return []
    required = (
        f"{found.required_frequency:.0f} Hz" if np.isfinite(found.required_frequency) else "–"
    )
    return [
        (
            "waves on the contact wire that the mesh carries within 1 %",
            f"up to {found.resolved_frequency:.0f} Hz; waves that 20 Hz at the pantograph excite "
            f"ahead of the train are as short as those of {required}",
        )
    ]


def _facts(results: Results) -> list[tuple[str, str]]:
    about = results.attributes
    n_cells = sum(len(pairs) for pairs in results.elements().values())
    facts = [
        (
            "line",
            f"{counted(results.line('support_x').size - 1, 'span')}, "
            f"{results.line('support_x')[-1] - results.line('support_x')[0]:.0f} m, "
            f"{counted(results.line('dropper_x').size, 'dropper')}, "
            f"{counted(results.line('arm_x').size, 'steady arm')}",
        ),
        *(
            (name, f"{told['kind']}, {told['description']}")
            for name, told in zip(
                results.pantograph_names(), results.pantograph_words(), strict=True
            )
            if told
        ),
        ("mesh", f"{results.line('node_points').shape[0]} nodes, {n_cells} wire elements"),
        ("unknowns", f"{about['n_dofs']}"),
        ("ranks", f"{about['n_ranks']}"),
        *([("speed of steps", about["detour"])] if about.get("detour") else []),
        *([("window", about["window"])] if about.get("window") else []),
        *(("defect", fact["says"]) for fact in about.get("defects", [])),
        *(
            (f"incident at {fact['time_s']:.4g} s", fact["says"])
            for fact in about.get("incidents", [])
        ),
        *(("end of the line", says) for says in about.get("arrivals", {}).get("ends", [])),
        *(
            ("waves and run-in", fact["says"])
            for fact in about.get("arrivals", {}).get("pantographs", [])
        ),
        ("arm uplift and dropper forces", says(results.line_record, results.dt)),
        ("time step", f"{1e3 * results.dt:g} ms"),
        ("steps", f"{results.n_steps} of {about['n_steps_planned']}"),
        ("simulated time", f"{results.simulated:.3f} s"),
    ]
    if "march_wall_s" in about:
        facts.append(("wall time of the march", f"{about['march_wall_s']:.2f} s"))
    for name, with_records in (("steps", False), ("steps and all records", True)):
        factor = real_time_factor(results, with_records)
        if factor is not None:
            facts.append((f"real-time factor (simulated / wall), {name}", f"{factor:.2f}"))
    facts += [
        (name.replace("_", " "), f"{value}")
        for name, value in about.get("inner_iterations", {}).items()
        if name not in _OF_THE_SOLVER
    ]
    facts.append(("started", str(about["created"])))
    return facts
