"""``summary.json``: the figures of a run under keys that other programs rely on.

Keys end in the unit that a reader expects (mm, km/h); what a run does not give is null.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from catenary.meshgen.wires import Role
from catenary.postproc.evaluate.error_indicators import Indicators, as_table, indicate
from catenary.postproc.evaluate.remarks import all_remarks
from catenary.postproc.evaluate.statistics import PantographStatistics, RunStatistics
from catenary.postproc.evaluate.statistics import lateral_table as as_lateral_table
from catenary.postproc.evaluate.verdict import Criterion, judged_by, verdict
from catenary.postproc.files.disk import plain
from catenary.postproc.read.results import Results
from catenary.postproc.standards.rule_books import KMH


def summarise(
    results: Results,
    statistics: RunStatistics,
    criteria: list[Criterion],
    indicators: Indicators | None = None,
) -> dict[str, Any]:
    """The content of ``summary.json``: plain Python values, NaN as None. Not collective.

    Parameters
    ----------
    results : Results
        Results of the run.
    statistics : RunStatistics
        Its statistics.
    criteria : list of Criterion
        Judged criteria.
    indicators : Indicators, optional
        Estimated errors of the run; found here without them.
    """
    attributes = results.attributes
    indicators = indicate(results) if indicators is None else indicators
    short = _short(results, statistics, criteria, indicators)
    start, end = results.evaluation
    summary = {
        "case": attributes["case"],
        "title": attributes["title"],
        "outcome": results.outcome,
        "speed_km_h": KMH * results.fact("speed"),
        "n_dofs": attributes["n_dofs"],
        "n_ranks": attributes["n_ranks"],
        "n_steps": results.n_steps,
        "dt_s": results.dt,
        "simulated_s": results.simulated,
        "march_wall_s": attributes.get("march_wall_s"),
        "march_cpu_s": attributes.get("march_cpu_s"),
        "records_wall_s": attributes.get("records_wall_s"),
        "real_time_factor": real_time_factor(results),
        "real_time_factor_with_records": real_time_factor(results, with_records=True),
        "phase_wall_s": attributes.get("phase_wall_s", {}),
        "inner_iterations": attributes.get("inner_iterations", {}),
        "detour": attributes.get("detour") or None,
        "window": attributes.get("window") or None,
        "evaluation_m": [start, end],
        "pantographs": short["pantographs"],
        "histograms": short["histograms"],
        "lateral": as_lateral_table(list(statistics.lateral)),
        "supports": {**short["supports"], "per_support": _of_supports(results, statistics)},
        "defects": attributes.get("defects", []),
        "incidents": attributes.get("incidents", []),
        "arrivals": attributes.get("arrivals", {}),
        "excitation": attributes.get("excitation") or None,
        "droppers": short["droppers"],
        "static": _static(results),
        "acceptance": short["acceptance"],
        "not_judged": short["not_judged"],
        "judged_by": judged_by(results, criteria),
        "passed": short["passed"],
        "indicators": as_table(indicators),
        "complaints": statistics.complaints + results.damage,
        "remarks": short["remarks"],
        "watched": {k: v for k, v in attributes.get("watched", {}).items() if k != "remarks"},
        "effects_on": [name for name, _, _ in attributes["effects_on"]],
        "effects_off": [name for name, _, _ in attributes["effects_off"]],
        "effects": _effects(attributes),
        "versions": attributes["versions"],
    }
    return dict(plain(summary))


def short_summary(
    results: Results, statistics: RunStatistics, criteria: list[Criterion]
) -> dict[str, Any]:
    """The part of ``summarise`` that tables of studies read, without tables of all supports; its
    parameters are those of that. Not collective."""
    return dict(plain(_short(results, statistics, criteria, indicate(results))))


def _short(
    results: Results, statistics: RunStatistics, criteria: list[Criterion], indicators: Indicators
) -> dict[str, Any]:
    """Figures of ``short_summary``, not plain yet."""
    return {
        "pantographs": [
            _pantograph(*row)
            for row in zip(
                statistics.pantographs,
                results.pantograph_words(),
                results.facts_of("static_force"),
                results.facts_of("actuator_force"),
                results.largest_violations(),
                strict=True,
            )
        ],
        "histograms": [_histogram(p) for p in statistics.pantographs if not p.complaint],
        "droppers": {
            "n_slackened": statistics.droppers.n_slackened,
            "max_force_N": statistics.droppers.maximum,
            "min_force_N": statistics.droppers.minimum,
        },
        "acceptance": [_chosen(c, _JUDGED) for c in criteria if not c.absent],
        "not_judged": [_chosen(c, _UNJUDGED) for c in criteria if c.absent],
        "passed": verdict(criteria) if results.complete else None,
        "remarks": all_remarks(results, indicators),
        "supports": {"max_uplift_mm": 1e3 * statistics.supports.maximum},
    }


def as_json(summary: dict[str, Any]) -> str:
    """``summary`` as the text of a JSON file."""
    return json.dumps(summary, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def real_time_factor(results: Results, with_records: bool = False) -> float | None:
    """Simulated time over the wall time of the march: above 1 the run is faster than the train.

    Of a resumed run this is the speed of its last part. ``with_records`` adds to the time of the
    steps that of the records that are written when these have been taken.
    """
    about = results.attributes
    marched, wall = about.get("marched_s"), about.get("march_wall_s")
    if with_records:
        after = about.get("records_wall_s")
        wall = None if wall is None or after is None else wall + after
    return marched / wall if wall and marched is not None else None


def _pantograph(
    p: PantographStatistics,
    recorded: Mapping[str, Any],
    static_force: float,
    actuator_force: float,
    violation: float | None,
) -> dict[str, Any]:
    return {
        "name": p.name,
        "kind": recorded.get("kind"),
        "model": recorded.get("model"),
        "static_force_N": static_force,
        "actuator_force_N": actuator_force,
        "mean_N": p.mean,
        "std_N": p.std,
        "std_0_5_N": p.std_0_5,
        "std_5_20_N": p.std_5_20,
        "max_N": p.maximum,
        "min_N": p.minimum,
        "stat_max_N": p.stat_max,
        "stat_min_N": p.stat_min,
        "loss_percent": p.loss_percent,
        "arcing_percent": p.arcing_percent,
        "contact_height_range_mm": 1e3 * p.contact_height_range,
        "max_constraint_violation_m": violation,
    }


def _histogram(p: PantographStatistics) -> dict[str, Any]:
    """Share of time of the filtered force in bins of one width from ``from_N`` up."""
    edges = p.histogram_edges
    own = {"from_N": edges[0], "bin_N": edges[1] - edges[0]}
    return {"name": p.name, **own, "percent": p.histogram_percent}


def _of_supports(results: Results, statistics: RunStatistics) -> list[dict[str, Any]]:
    own = statistics.supports
    rows = zip(own.x, own.uplift, own.evaluated, results.arm_wires(), strict=True)
    return [
        {"x_m": x, "wire": wire, "max_uplift_mm": 1e3 * uplift, "evaluated": evaluated}
        for x, uplift, evaluated, wire in rows
    ]


def _static(results: Results) -> dict[str, Any]:
    in_span = results.line("dropper_span") == results.span_at_rest
    elasticity = 1e3 * results.static("elasticity")
    return {
        "span": results.span_at_rest + 1,
        "dropper_lengths_m": results.static("dropper_length")[in_span],
        "dropper_forces_N": results.static("dropper_force")[in_span],
        "elasticity_mm_per_N": {
            "max": np.max(elasticity, initial=-np.inf),
            "min": np.min(elasticity, initial=np.inf),
        },
        **_elasticity_of_wires(results),
    }


def _elasticity_of_wires(results: Results) -> dict[str, Any]:
    """Elasticity of each of several contact wires pressed alone, by its name."""
    names = results.wires_of(Role.CONTACT)
    if len(names) == 1:
        return {}
    columns = 1e3 * results.static("elasticity_of_wires").T
    return {
        "elasticity_of_wires_mm_per_N": {
            name: {
                "max": np.max(own, initial=-np.inf, where=np.isfinite(own)),
                "min": np.min(own, initial=np.inf, where=np.isfinite(own)),
            }
            for name, own in zip(names, columns, strict=True)
        }
    }


def _effects(attributes: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Effects simulated and left out, each with the reason."""
    return [
        {"name": name, "title": title, "simulated": simulated, "reason": reason}
        for key, simulated in (("effects_on", True), ("effects_off", False))
        for name, title, reason in attributes[key]
    ]


# What is told of criteria that are judged, and of those that a run has no data for.
_JUDGED = (
    *("criterion", "value", "limit", "unit", "relation", "passed"),
    *("clause", "book", "rule", "compared", "because"),
)
_UNJUDGED = ("criterion", "clause", "book", "rule", "because")


def _chosen(one: Criterion, names: Sequence[str]) -> dict[str, Any]:
    return {
        name: getattr(one, name) if name != "because" else one.because or None for name in names
    }
