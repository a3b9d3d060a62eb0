"""A line drawn to scale: side view, plan view, and the cross-section at a support."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from catenary.meshgen.line import Line
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.wires import Role
from catenary.postproc.evaluate.wording import wire_words
from catenary.postproc.report.pictures.figures import COLOURS, GREY, LIGHT, own_style
from catenary.solver.model.rest_shape import Equilibrium

# Of contact wires, messenger wires, and all further roles in their order.
_COLOUR = dict(zip(Role, (COLOURS[1], COLOURS[0], *COLOURS[2:]), strict=False))
# Exaggerations of heights and lateral positions, and sizes of figure and panels [inch].
_FACTORS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
_WIDTH, _HEIGHT = 9.0, 6.7
_LEFT, _LONG, _CROSS = 0.8, 5.6, 1.75
_SIDE, _PLAN, _LOW, _GAP = 3.0, 1.5, 0.55, 0.75
_LEAST = 0.5  # least width and height that a drawing shows [m]
_MARGIN = 0.08  # of a range, on both sides
_MOST_NAMED = 12  # marks that have a number and a line below
_LINE = 0.22  # of text [inch]


class Mark(NamedTuple):
    """Mark on a ``wire`` at ``x`` [m], and the text on it in a line below."""

    x: float
    wire: str
    text: str


@own_style()
def draw_line(
    line: Line,
    mesh: LineMesh,
    form: Equilibrium,
    stretch: tuple[float, float],
    half_head: float | None = None,
    marks: Sequence[Mark] = (),
) -> Figure:
    """A drawing of a line at rest. Not collective.

    Parameters
    ----------
    line : Line
        Line as an engineer describes it.
    mesh : LineMesh
        Its mesh.
    form : Equilibrium
        Its shape at rest.
    stretch : tuple of float
        From and to of side view and plan view [m].
    half_head : float, optional
        Half of the working length of the pan head [m]; None if it is not known.
    marks : sequence of Mark, optional
        What is to be seen besides, such as defects.
    """
    marks = sorted(mark for mark in marks if stretch[0] <= mark.x <= stretch[1])
    below = _LINE * len(marks[:_MOST_NAMED])
    figure = Figure(figsize=(_WIDTH, _HEIGHT + below), dpi=130)
    FigureCanvasAgg(figure)

    def panel(left: float, low: float, width: float, height: float) -> Axes:
        whole = _HEIGHT + below
        return figure.add_axes(
            (left / _WIDTH, (low + below) / whole, width / _WIDTH, height / whole), facecolor="none"
        )

    side = panel(_LEFT, _LOW + _PLAN + _GAP, _LONG, _SIDE)
    plan = panel(_LEFT, _LOW, _LONG, _PLAN)
    cross = panel(_LEFT + _LONG + _GAP, _LOW, _CROSS, _PLAN + _GAP + _SIDE)
    points = mesh.points.copy()
    points[:, 2] = form.height
    if form.lateral is not None:
        points[:, 1] = form.lateral.y
    _side_view(side, line, mesh, points, form, stretch)
    _marks(side, mesh, points, marks)
    for number, mark in enumerate(marks[:_MOST_NAMED]):
        high = (below - _LINE * (number + 0.5)) / (_HEIGHT + below)
        figure.text(_LEFT / _WIDTH, high, f"{number + 1}  {mark.text}", fontsize=9)
    _plan_view(plan, line, mesh, points, stretch, half_head)
    _cross_section(cross, line, mesh, points, form, stretch, half_head)
    names: dict[Role, str] = {}
    for wire in reversed(line.wires):
        alone = wire.role not in names
        names[wire.role] = wire_words(wire.name) if alone else f"{wire.role.value} wires"
    handles = [Line2D([], [], color=_COLOUR[role], label=name) for role, name in names.items()]
    figure.legend(handles=handles, loc="upper right", ncols=len(handles), frameon=False)
    return figure


def _side_view(
    axes: Axes,
    line: Line,
    mesh: LineMesh,
    points: np.ndarray,
    form: Equilibrium,
    stretch: tuple[float, float],
) -> None:
    """From the side; droppers that carry nothing are dotted."""
    for which, style in ((form.dropper_force > 0.0, "-"), (form.dropper_force <= 0.0, ":")):
        gap = np.full((np.count_nonzero(which), 1), np.nan)
        ends = mesh.droppers[which]
        x, z = (np.hstack([points[ends, axis], gap]).ravel() for axis in (0, 2))
        axes.plot(x, z, style, color=GREY, lw=0.7)
    for upper, lower in mesh.clamps:
        axes.plot(points[[upper, lower], 0], points[[upper, lower], 2], color=GREY, lw=1.5)
    _wires(axes, line, mesh, points, 2)
    for nodes, marker in ((mesh.steady_arms, "<"), (mesh.supports, "^")):
        axes.plot(points[nodes, 0], points[nodes, 2], marker, color=GREY, ms=4, ls="none")
    factor = _to_scale(axes, points, stretch, 2, _SIDE)
    _masts(axes, line, stretch)
    axes.set_ylabel("height above rail [m]")
    axes.set_title(f"{line.topology}: side view, heights {_times(factor)}", loc="left", fontsize=10)


def _plan_view(
    axes: Axes,
    line: Line,
    mesh: LineMesh,
    points: np.ndarray,
    stretch: tuple[float, float],
    half_head: float | None,
) -> None:
    reach = 0.0 if half_head is None else half_head
    if half_head is not None:
        axes.axhspan(-half_head, half_head, color=LIGHT, alpha=0.35, lw=0)
    axes.axhline(0.0, color=GREY, lw=0.5, ls="--")
    _wires(axes, line, mesh, points, 1)
    factor = _to_scale(axes, points, stretch, 1, _PLAN, reach)
    _masts(axes, line, stretch)
    axes.set_xlabel("position along the track [m]")
    axes.set_ylabel("to the left [m]")
    width = "" if half_head is None else "; shaded: working length of the pan head"
    axes.set_title(f"plan view, lateral positions {_times(factor)}{width}", loc="left", fontsize=10)


def _cross_section(
    axes: Axes,
    line: Line,
    mesh: LineMesh,
    points: np.ndarray,
    form: Equilibrium,
    stretch: tuple[float, float],
    half_head: float | None,
) -> None:
    """Wires at the support nearest to the middle (full) and half a span further (hollow); of one
    span at its first anchor."""
    masts = line.support_positions
    first = 1 if line.n_spans > 1 else 0
    number = int(np.argmin(np.abs(masts[first:-1] - 0.5 * sum(stretch)))) + first
    at, between = masts[number], 0.5 * (masts[number] + masts[number + 1])
    for wire in line.wires:
        for x, face in ((at, _COLOUR[wire.role]), (between, "none")):
            for nodes in mesh.pieces(wire.name):
                own = points[nodes]
                if own[0, 0] <= x <= own[-1, 0]:
                    y, z = (np.interp(x, own[:, 0], own[:, k]) for k in (1, 2))
                    axes.plot(y, z, "o", mec=_COLOUR[wire.role], mfc=face, ms=6)
    lowest = min(
        float(np.interp(at, points[mesh.wires[wire.name], 0], points[mesh.wires[wire.name], 2]))
        for wire in line.wires_of(Role.CONTACT)
        if mesh.x(mesh.wires[wire.name])[0] <= at <= mesh.x(mesh.wires[wire.name])[-1]
    )
    arms = ""
    for group in line.steady_arms:
        for node in mesh.steady_arms[np.abs(mesh.x(mesh.steady_arms) - at) < 1e-6]:
            if node in mesh.wires[group.wire] and group.kind.length > 0.0:
                (_, y, z), length = points[node], group.kind.length
                across, up = (1.0 if y >= 0.0 else -1.0) * length, 0.15
                if form.lateral is not None:
                    number = int(np.flatnonzero(mesh.steady_arms == node)[0])
                    across, up, _ = length * form.lateral.arm_direction[number]
                axes.plot([y, y + across], [z, z + up], color=GREY, lw=1.2)
                arms = f"\narms {'sketched' if form.lateral is None else 'at rest'},"
    if half_head is not None:
        axes.plot([-half_head, half_head], [lowest, lowest], color="black", lw=2.0)
    axes.axvline(0.0, color=GREY, lw=0.5, ls="--")
    axes.margins(0.15)
    # A single wire in the middle of the track is a point.
    for axis in ("x", "y"):
        low, high = getattr(axes, f"get_{axis}lim")()
        spare = max(0.5 * (_LEAST - (high - low)), 0.0)
        getattr(axes, f"set_{axis}lim")(low - spare, high + spare)
    axes.set_aspect("equal", adjustable="box", anchor="N")
    axes.set_xlabel("to the left [m]")
    title = f"cross-section at {at:g} m,{arms}\nhollow: at {between:g} m"
    axes.set_title(title, loc="left", fontsize=10)


def _wires(axes: Axes, line: Line, mesh: LineMesh, points: np.ndarray, axis: int) -> None:
    for wire in reversed(line.wires):
        for nodes in mesh.pieces(wire.name):
            axes.plot(points[nodes, 0], points[nodes, axis], color=_COLOUR[wire.role], lw=1.3)


def _marks(axes: Axes, mesh: LineMesh, points: np.ndarray, marks: Sequence[Mark]) -> None:
    """Numbers, or crosses where there are many, below the wire at their places."""
    for number, mark in enumerate(marks, start=1):
        own = points[mesh.wires[mark.wire]]
        z = float(np.interp(mark.x, own[:, 0], own[:, 2]))
        axes.plot(mark.x, z, "x", color="black", ms=5, mew=1.3, zorder=5)
        if number <= _MOST_NAMED:
            axes.annotate(
                str(number),
                (mark.x, z),
                xytext=(0, -13),
                textcoords="offset points",
                ha="center",
                fontsize=9,
            )


def _masts(axes: Axes, line: Line, stretch: tuple[float, float]) -> None:
    for x in line.support_positions.tolist():
        if stretch[0] <= x <= stretch[1]:
            axes.axvline(x, color=LIGHT, lw=0.8, zorder=0)


def _to_scale(
    axes: Axes,
    points: np.ndarray,
    stretch: tuple[float, float],
    axis: int,
    height: float,
    reach: float = 0.0,
) -> int:
    """Limit the axes to a stretch, with the largest exaggeration that shows all of it."""
    seen = points[(points[:, 0] >= stretch[0]) & (points[:, 0] <= stretch[1]), axis]
    low, high = min(seen.min(), -reach or np.inf), max(seen.max(), reach or -np.inf)
    needed = max((high - low) * (1.0 + 2.0 * _MARGIN), _LEAST)
    shown = (stretch[1] - stretch[0]) * height / _LONG
    factor = max(one for one in _FACTORS if one == 1 or shown / one >= needed)
    middle, half = 0.5 * (low + high), 0.5 * shown / factor
    axes.set_xlim(*stretch)
    axes.set_ylim(middle - half, middle + half)
    return factor


def _times(factor: int) -> str:
    return "to scale" if factor == 1 else f"{factor} times as large"
