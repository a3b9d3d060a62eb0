"""Facts on a run: effects simulated and left out, sizes, times, versions, configuration."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from hashlib import sha256
from shlex import quote

import numpy as np

from catenary.postproc.evaluate.error_indicators import Indicators
from catenary.postproc.evaluate.remarks import all_remarks
from catenary.postproc.evaluate.wording import counted, of_digits
from catenary.postproc.files.header import record_words
from catenary.postproc.read.results import Results
from catenary.postproc.report.page import EvaluatedRun, Folded, Section, Text, has_train, number
from catenary.postproc.report.study_table import StudyTable, texts_table
from catenary.postproc.report.summary import real_time_factor

# File beside a full report: the scene as a case that `catenary run` takes.
INPUT = "input.toml"


def checks(run: EvaluatedRun) -> Section:
    """Own checks of the march: energy, motion beyond linear theory, iterations."""
    return Section("The run's own checks", _checks(run))


def _checks(run: EvaluatedRun) -> Iterator[Text | StudyTable]:
    results, about = run.results, run.results.attributes
    watched, n = about.get("watched", {}), about.get("inner_iterations", {})
    rows: list[list[str]] = []
    if "contact_work_J" in watched:
        made, work = watched["energy_made_J"], watched["contact_work_J"]
        rows += [
            ["work of the contact forces on the line", of_digits(work, 3), "J", ""],
            ["energy of the line at the end", of_digits(watched["line_energy_J"], 3), "J",
             f"largest {of_digits(watched['most_line_energy_J'], 3)} J"],
            ["energy made by the time integration", of_digits(made, 3), "J",
             f"{of_digits(100.0 * made / work, 2)} % of that work" if work > 0.0 else ""],
        ]  # fmt: skip
    if "largest_rotation_rad" in watched:
        rotation = f"{watched['largest_rotation_rad']:.3g}"
        rows.append(
            ["largest rotation of a wire", rotation, "rad", "linear theory: small against 1"]
        )
    if "unconverged_steps" in n:
        steps = f"of {results.n_steps} steps"
        rows.append(["steps that did not converge", str(n["unconverged_steps"]), "", steps])
    if results.has_violations:
        largest = max((v for v in results.largest_violations() if v is not None), default=0.0)
        rows.append(["largest open joint of a pantograph", f"{largest:.1e}", "m", ""])
    if rows:
        yield texts_table(["", "value", "unit", ""], rows, {1})
    if "contact_work_J" not in watched:
        yield Text("No energy balance: loads other than contact forces do work on this line.")
    remarks = [*results.damage, *all_remarks(results, run.indicators)]
    yield from (Text(sentence, "remark") for sentence in remarks)
    if not remarks:
        yield Text("The program has no remark on this run.")


def effects(run: EvaluatedRun, costs: tuple[Mapping[str, str], str] = ({}, "")) -> Section:
    """Effects that were simulated, and effects that were not, with the reasons.

    Parameters
    ----------
    run : EvaluatedRun
        Run.
    costs : tuple, optional
        By names of effects a sentence on what each costs and changes, and the study that measured
        them.
    """
    about, (cost_of, study) = run.results.attributes, costs
    heads = ["effect", "model", "reason", *(["cost and change"] if cost_of else [])]
    on, off = (
        texts_table(
            heads,
            [
                [name, *words, *([cost_of.get(name, "–")] if cost_of else [])]
                for name, *words in rows
            ],
        )
        for rows in (about["effects_on"], about["effects_off"])
    )
    left = Folded(f"Effects that were not simulated: {len(off.rows)}", off)
    how = (
        "Costs are how many times as long a step takes with the effect as without; costs and "
        f"changes are those of {study}."
        if cost_of
        else f"`catenary plan {quote(about['case'])} --cost -o STUDY` measures what each costs and "
        "changes; `catenary report --cost STUDY` shows it here."
    )
    return Section("Simulated effects", [on, Text(how)], folded=[left])


def signatures(text: str | None, run: EvaluatedRun) -> Section:
    """Commands to make the run again, and room for signatures.

    Parameters
    ----------
    text : str or None
        What stands in ``INPUT``, None if there is no such file.
    run : EvaluatedRun
        Run.
    """
    about = run.results.attributes
    name, version = next(iter(about["versions"].items()))
    rows = [["program", f"{name} {version}; all versions above"]]
    if text is not None:
        options = " ".join(about.get("petsc_options", []))
        command = f"catenary run {INPUT} -o AGAIN" + (f" -- {options}" if options else "")
        mark = sha256(text.encode()).hexdigest()
        rows = [["input", f"{INPUT}, SHA-256 {mark}"], ["command", command], *rows]
    room = [width * "\u00a0" for width in (40, 20, 45)]
    roles = [[role, *room] for role in ("computed", "checked", "approved")]
    signed = texts_table(["", "name", "date", "signature"], roles)
    blocks = [texts_table(["", ""], rows), signed]
    return Section("Reproduction and signatures", blocks)


def section(run: EvaluatedRun) -> Section:
    """Facts on the run, and its whole configuration."""
    about = run.results.attributes
    mesh = _of_mesh(run.indicators, has_train(run))
    rows = [*_facts(run.results), *mesh, *_of_program(run.results)]
    config = json.dumps(about["config"], indent=2, ensure_ascii=False)
    folded = Folded("Full configuration, defaults included", Text(config, "code"))
    return Section("The run", [texts_table(["", ""], rows)], folded=[folded])


def _of_mesh(found: Indicators, with_train: bool) -> list[tuple[str, str]]:
    """The shortest waves of the mesh, beside the shortest that matter ahead of a train."""
    if np.isnan(found.resolved_frequency):
        return []
    carried = f"up to {found.resolved_frequency:.0f} Hz"
    required = (
        f"{found.required_frequency:.0f} Hz" if np.isfinite(found.required_frequency) else "–"
    )
    return [
        (
            "waves on the contact wire that the mesh carries within 1 %",
            f"{carried}; waves that 20 Hz at the pantograph excite ahead of the train are as short "
            f"as those of {required}"
            if with_train
            else carried,
        )
    ]


def _facts(results: Results) -> list[tuple[str, str]]:
    about = results.attributes
    n_cells = sum(len(pairs) for pairs in results.elements().values())
    arrivals, masts = about.get("arrivals", {}), results.line("support_x")
    names = results.pantograph_names()
    kinds: dict[str, list[str]] = {}
    for name, words in zip(names, results.pantograph_words(), strict=True):
        if words:
            kinds.setdefault(f"{words['kind']}, {words['description']}", []).append(name)
    if about.get("excitation"):
        kinds = {about["excitation"]["says"]: ["excitation"]}
    met = [fact["says"].partition(": ")[2] for fact in arrivals.get("pantographs", [])]
    of = [f", {name}" if len(names) > 1 else "" for name in names]
    return [
        (
            "line",
            f"{counted(masts.size - 1, 'span')}, {masts[-1] - masts[0]:.0f} m, "
            f"{counted(results.line('dropper_x').size, 'dropper')}, "
            f"{counted(results.line('arm_x').size, 'steady arm')}",
        ),
        *([("ends of the line", "; ".join(arrivals["ends"]))] if arrivals.get("ends") else []),
        *((", ".join(own), words) for words, own in kinds.items()),
        *((f"waves and run-in{name}", text) for name, text in zip(of, met, strict=False)),
        *(("defect", fact["says"]) for fact in about.get("defects", [])),
        *(
            (f"incident at {fact['time_s']:.4g} s", fact["says"])
            for fact in about.get("incidents", [])
        ),
        (
            "mesh",
            f"{results.line('node_points').shape[0]} nodes, {n_cells} wire elements, "
            f"{about['n_dofs']} unknowns on {counted(about['n_ranks'], 'rank')}",
        ),
        (
            "time",
            f"{results.simulated:.3f} s, {results.n_steps} of {about['n_steps_planned']} steps of "
            f"{1e3 * results.dt:g} ms",
        ),
        ("arm uplift and dropper forces", record_words(results.line_record, results.dt)),
        *([("speed of steps", about["detour"])] if about.get("detour") else []),
        *([("window", about["window"])] if about.get("window") else []),
    ]


def _of_program(results: Results) -> list[tuple[str, str]]:
    """Time and speed of the program's run, and its versions."""
    about = results.attributes
    phases = about.get("phase_wall_s", {}).items()
    factors = [
        f"{factor:.2f} {words}"
        for words, with_records in (("of the steps", False), ("with all records", True))
        if (factor := real_time_factor(results, with_records)) is not None
    ]
    versions = ", ".join(f"{name} {version}" for name, version in about["versions"].items())
    rows = {
        "started": str(about["created"]),
        "wall time": ", ".join(f"{name} {number(wall, 2)} s" for name, wall in phases),
        "real-time factor (simulated / wall)": ", ".join(factors),
        "versions": versions,
    }
    return [(name, words) for name, words in rows.items() if words]
