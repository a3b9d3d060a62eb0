"""Files of the verb ``pantograph``: receptance as CSV and picture, the lumped model as TOML."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from catenary.base.errors import InputError
from catenary.cases.result_folder.output_folder import refuse_impossible
from catenary.cases.studies.pantograph.study import PantographStudy, fit_error
from catenary.postproc.files.disk import write_all
from catenary.postproc.report.pictures.figures import (
    COLOURS,
    LIGHT,
    legend_above,
    new_figure,
    own_style,
    painted,
    tidy,
)

HEADER = "frequency_hz,receptance_real_m_per_N,receptance_imag_m_per_N"
FILES = ("receptance.csv", "receptance.png", "lumped.toml")


def new_files(folder: Path, force: bool) -> None:
    """Raise ``InputError`` unless the files can be written into ``folder``."""
    refuse_impossible(folder)
    there = [name for name in FILES if (folder / name).exists()]
    if there and not force:
        raise InputError(f"-o {folder} has {there[0]} already; give --force to replace it")


def write_study(found: PantographStudy, folder: Path) -> list[Path]:
    """Write all files and return their paths. Raises ``RunBroken`` if the disk refuses."""
    table, drawn, lumped = FILES
    content: dict[str, bytes | str] = {table: csv_text(found)}
    content |= painted(drawn, lambda: picture(found))
    content[lumped] = lumped_toml(found)
    return write_all(folder, content)


def csv_text(found: PantographStudy) -> str:
    """The receptance at the head, upward per upward force, one frequency a line."""
    rows = [
        f"{frequency:.10g},{value.real:.10g},{value.imag:.10g}"
        for frequency, value in zip(found.range.frequencies(), found.receptance, strict=True)
    ]
    return "\n".join([HEADER, *rows]) + "\n"


@own_style()
def picture(found: PantographStudy) -> Figure:
    """Magnitude and phase of the receptance, the pantograph's and the fitted model's."""
    at, fit = found.range.frequencies(), found.fit
    figure = new_figure(5.6)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    curves = (
        (found.receptance, found.kind, {"color": COLOURS[0], "linewidth": 2.2}),
        (
            fit.receptance(at),
            f"{fit.data.n_masses} lumped masses, fitted",
            {"color": COLOURS[1], "linewidth": 1.2, "linestyle": "--"},
        ),
    )
    for receptance, label, style in curves:
        upper.loglog(at, 1e3 * np.abs(receptance), label=label, **style)
        lower.semilogx(at, np.degrees(np.angle(receptance)), **style)
    if fit.lowest > at[0]:
        for axes in (upper, lower):
            axes.axvspan(at[0], fit.lowest, color=LIGHT, alpha=0.4, linewidth=0, zorder=0,
                         label="not fitted" if axes is upper else None)  # fmt: skip
    lower.set_ylim(-190.0, 190.0)
    lower.set_yticks([-180, -90, 0, 90, 180])
    lower.set_xlim(at[0], at[-1])
    title = f"{found.kind} of {found.case}: receptance at the head"
    tidy(upper, "", "magnitude [mm/N]", title)
    tidy(lower, "frequency [Hz]", "phase [deg]")
    legend_above(upper)
    return figure


def lumped_toml(found: PantographStudy) -> str:
    """The fitted model as a table of a scene: to be pasted, then named on the train."""
    fit, kind = found.fit, found.kind
    name = f"{kind}_lumped"
    lines = [
        f"# {fit.data.n_masses} lumped masses fitted to the receptance of {kind} ({found.case}, "
        f"{found.speed:g} km/h)",
        f"# from {fit.lowest:g} to {fit.highest:g} Hz at {fit.n_points} frequencies: "
        f"{fit_error(fit)}",
        f"[pantographs.{_key(name)}]",
        'type = "lumped"',
        f"masses_kg = {_list(fit.data.masses)}",
        f"stiffnesses_N_per_m = {_list(fit.data.stiffnesses)}",
        f"dampings_N_s_per_m = {_list(fit.data.dampings)}",
        f"static_force_N = {found.static_force:.6g}",
    ]
    if found.nominal_height is not None:
        lines.append(f"nominal_height_m = {found.nominal_height!r}")
    return "\n".join(lines) + "\n"


def inline_table(found: PantographStudy) -> str:
    """The fitted model as the value of ``pantographs.NAME=...`` on the command line."""
    data = found.fit.data
    parts = [
        'type = "lumped"',
        f"masses_kg = {_list(data.masses)}",
        f"stiffnesses_N_per_m = {_list(data.stiffnesses)}",
        f"dampings_N_s_per_m = {_list(data.dampings)}",
        f"static_force_N = {found.static_force:.6g}",
    ]
    if found.nominal_height is not None:
        parts.append(f"nominal_height_m = {found.nominal_height!r}")
    return "{" + ", ".join(parts) + "}"


def _key(name: str) -> str:
    """A name as TOML has it in a key."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False)


def _list(values: tuple[float, ...]) -> str:
    # A float of TOML has a point or an exponent, and takes an integer for one as well.
    return "[" + ", ".join(f"{value:.6g}" for value in values) + "]"
