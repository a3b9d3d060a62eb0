"""Frequency response of a kind of pantograph, and the lumped model fitted to it."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from catenary.base.errors import InputError
from catenary.cases.run.description import description_of
from catenary.cases.scene.scene import Scene, pantograph_of, static_force
from catenary.cases.studies.asked import Frequencies
from catenary.mbs.build import PantographData
from catenary.mbs.mechanism.multibody_pantograph import MultibodyData, stand
from catenary.mbs.response import ChainFit, HeadResponse, fit_chain, head_response, peaks
from catenary.postproc.evaluate.wording import counted
from catenary.postproc.report.pictures.figures import (
    COLOURS,
    LIGHT,
    legend_above,
    new_figure,
    own_style,
    tidy,
)
from catenary.postproc.report.study_table import Content, StudyTable, file_table, texts_table

# Frequencies for the search of peaks and for the fit.
N_SEARCHED, N_FITTED = 400, 200
# A mode that moves the head by less than this part of what moves it most is not driven by it.
UNMOVED = 1e-6


class PantographStudy(NamedTuple):
    """A kind of pantograph with its response (n_points,) [m/N] and the chain fitted to it.

    ``speed`` [km/h]; ``static_force`` [N]; ``nominal_height`` [m] of the head, None if the scene
    leaves it to the line.
    """

    kind: str
    case: str
    speed: float
    static_force: float
    nominal_height: float | None
    data: PantographData
    response: HeadResponse
    range: Frequencies
    receptance: np.ndarray
    fit: ChainFit


def study(
    scene: Scene, kind: str | None, n_masses: int | None, over: Frequencies
) -> PantographStudy:
    """The response of a kind of pantograph of a scene, the leading one's if none is named.

    ``n_masses`` of the lumped model: as many as a lumped pantograph has, or two, and one more for
    strips on springs of their own, if left out.

    Raises
    ------
    InputError
        There is no such kind, it has no static force at the train's speed, or cannot stand.
    """
    over.checked()
    kind = scene.train.pantographs[0].name if kind is None else kind
    if kind not in scene.pantographs:
        raise InputError(
            f"--kind {kind}: the case has no such pantograph; it has {', '.join(scene.pantographs)}"
        )
    table, speed = scene.pantographs[kind], scene.train.speed_km_h
    try:
        force = static_force(kind, table, speed)
        if force is None:
            raise InputError(f"it has no static force at {speed:g} km/h")
        data = pantograph_of(kind, table, speed)
        if not scene.switches()["pantograph_laws"]:
            data = replace(data, laws=())
        if not scene.switches()["flexible_strips"]:
            data = replace(data, strips=replace(data.strips, flexure=None))
        response = head_response(data, force)
    except InputError as error:
        raise InputError(f"pantographs.{kind}: {error}") from error
    if n_masses is None:
        own = 2 if isinstance(data, MultibodyData) else data.n_masses
        n_masses = min(own + (data.strips.suspension is not None), 3)
    at = np.geomspace(over.fit_low, over.high, N_FITTED)
    fit = fit_chain(at, response.model.receptance(at), n_masses)
    receptance = response.model.receptance(over.frequencies())
    of_case = kind, scene.case.name, speed, force, table.nominal_height_m
    return PantographStudy(*of_case, data, response, over, receptance, fit)


def study_text(found: PantographStudy) -> str:
    """Tables of what was found."""
    fit, model = found.fit, found.response.model
    parts = [
        f"pantograph {found.kind} of {found.case} at {found.speed:g} km/h\n"
        f"  {description_of(found.data, found.static_force)}",
        *_at_rest(found),
        _modes(found.response).text(),
    ]
    if model.n_left_out:
        parts[-1] += (
            f"\nleft out: {counted(model.n_left_out, 'mode')} without stiffness that the head does "
            f"not excite, of {', '.join(model.left_out)}"
        )
    if found.data.laws:
        parts[-1] += "\nleft out: the pantograph's laws, which are not linear"
    head = f"lumped model fitted from {fit.lowest:g} to {fit.highest:g} Hz: {fit_error(fit)}"
    columns = zip(fit.data.masses, fit.data.stiffnesses, fit.data.dampings, strict=True)
    rows = [[k, *(f"{one:.5g}" for one in own)] for k, own in enumerate(columns, start=1)]
    masses = texts_table(["mass", "kg", "N/m below", "N s/m below"], rows, right=(1, 2, 3))
    return "\n\n".join([*parts, _peaks(found), f"{head}\n{masses.text()}"])


def _figures(title: str, rows: Sequence[tuple[str, float, str]]) -> str:
    """Names, values and units below a title."""
    cells = [(name, f"{value:.6g}", unit) for name, value, unit in rows]
    return texts_table([title, "", ""], cells, right=(1,)).text()


def _at_rest(found: PantographStudy) -> Iterator[str]:
    response = found.response
    rows = [("force on the head", response.static_force, "N")]
    if isinstance(found.data, MultibodyData):
        standing, given = stand(found.data), "static force with the given actuator force"
        if standing.actuator_force is not None:
            rows.append((f"force of {found.data.actuator}", standing.actuator_force, "N"))
            rows.append((given, standing.force_before, "N"))
        rows.append(("height of the arm above the base", standing.working_height, "m"))
    rows.append(("lift lost per metre of raising", response.lift_stiffness, "N/m"))
    rows += [(name, mass, "kg") for name, mass in response.masses.items()]
    yield _figures("at rest under the wire", rows)
    if isinstance(found.data, MultibodyData):
        missed = [(miss.joint, 1e3 * miss.gap, "mm") for miss in stand(found.data).missed]
        yield _figures("closure errors of joints before assembly", missed)


def _modes(response: HeadResponse) -> StudyTable:
    rows = []
    for mode in response.model.modes():
        cells: list[str | None] = [
            "oscillates",
            f"{mode.frequency:.4g}",
            f"{mode.damping_ratio:.4g}",
        ]
        if mode.root.imag == 0.0:
            cells = ["grows" if mode.root.real > 0.0 else "decays", None, None]
        moves = "" if mode.share > UNMOVED else "the head does not move"
        rows.append([*cells, f"{mode.root.real:+.4g}", moves])
    return texts_table(["modes", "Hz", "damping ratio", "1/s", ""], rows, right=(1, 2, 3))


def _peaks(found: PantographStudy) -> str:
    over = found.range
    at = np.geomspace(over.low, over.high, max(N_SEARCHED, over.n_points))
    rows = [
        ("", f"{peak.frequency:.4g}", f"{1e3 * abs(peak.receptance):.4g}",
         f"{math.degrees(np.angle(peak.receptance)):.1f}")
        for peak in peaks(found.response.model, at)
    ]  # fmt: skip
    if not rows:
        return f"no peak of the receptance from {over.low:g} to {over.high:g} Hz"
    heads = ["peaks of the receptance", "Hz", "mm/N", "phase, deg"]
    return texts_table(heads, rows, right=(1, 2, 3)).text()


def fit_error(fit: ChainFit) -> str:
    """Error of a fit, in words."""
    return f"rms error {100 * fit.rms_error:.2g} %, largest {100 * fit.largest_error:.2g} %"


FILES = ("receptance.csv", "receptance.png", "lumped.toml")


def files_of(found: PantographStudy) -> dict[str, Content]:
    """The receptance as table and picture, and the fitted model. Not collective."""
    table, drawn, lumped = FILES
    heads = ("frequency_hz", "receptance_real_m_per_N", "receptance_imag_m_per_N")
    columns = found.range.frequencies(), found.receptance.real, found.receptance.imag
    # The receptance at the head, upward per upward force.
    rows = file_table(heads, np.column_stack(columns).tolist())
    return {table: rows, lumped: lumped_toml(found), drawn: lambda: picture(found)}


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
    lines = [
        f"# {fit.data.n_masses} lumped masses fitted to the receptance of {kind} ({found.case}, "
        f"{found.speed:g} km/h)",
        f"# from {fit.lowest:g} to {fit.highest:g} Hz at {fit.n_points} frequencies: "
        f"{fit_error(fit)}",
        f"[pantographs.{json.dumps(f'{kind}_lumped', ensure_ascii=False)}]",
        *_keys_of(found),
    ]
    return "\n".join(lines) + "\n"


def inline_table(found: PantographStudy) -> str:
    """The fitted model as the value of ``pantographs.NAME=...`` on the command line."""
    return "{" + ", ".join(_keys_of(found)) + "}"


def _keys_of(found: PantographStudy) -> list[str]:
    """The fitted model as keys with values, which TOML writes as JSON does."""
    data = found.fit.data
    figures = data.masses, data.stiffnesses, data.dampings, (found.static_force,)
    masses, stiffnesses, dampings, (force,) = (
        [float(f"{value:.6g}") for value in values] for values in figures
    )
    table: dict[str, Any] = {"type": "lumped", "masses_kg": masses}
    table |= {"stiffnesses_N_per_m": stiffnesses, "dampings_N_s_per_m": dampings}
    table["static_force_N"] = force
    if found.nominal_height is not None:
        table["nominal_height_m"] = found.nominal_height
    return [f"{key} = {json.dumps(value)}" for key, value in table.items()]
