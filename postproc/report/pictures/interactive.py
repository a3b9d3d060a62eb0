"""Figures of matplotlib as pictures of Plotly, which a reader zooms and reads off.

What is drawn once by matplotlib is translated: curves, bars, ranges, lines and stripes across a
panel, and texts. Plotly's own translation, ``plotly.tools.mpl_to_plotly``, leaves out stripes,
ranges and what is placed by an axis alone, which every picture along the track has.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex, to_rgba
from matplotlib.container import BarContainer
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import FixedLocator
from matplotlib.transforms import Transform

from catenary.base.errors import InputError

_DASHES = {"-": "solid", "--": "dash", ":": "dot", "-.": "dashdot"}
_SYMBOLS = {"o": "circle", "v": "triangle-down", "^": "triangle-up", "x": "x", "_": "line-ew-open",
            "<": "triangle-left", ".": "circle"}  # fmt: skip
# Size of a figure's inch, and of room above the panels for Plotly's buttons and two rows of the
# legend below them [px].
_INCH, _ABOVE = 96, 30 + 60


def script() -> str:
    """The program of Plotly, some 5 MB, for a page that works from disk. Not collective.

    Raises
    ------
    InputError
        If the package is missing.
    """
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise InputError(
            "--interactive needs the package plotly: pip install 'catenary[report]'"
        ) from error
    return str(get_plotlyjs())


def as_json(figure: Figure) -> str:
    """``{"data", "layout"}`` of a figure as text; empty if it has parts that are not translated."""
    panels = [axes for axes in figure.axes if axes.get_label() != "<colorbar>"]
    if any(not _is_known(axes) for axes in panels):
        return ""
    width, height = figure.get_size_inches()
    layout: dict[str, Any] = {
        "height": int(_INCH * height) + _ABOVE,
        "margin": {"l": 5, "r": 5, "t": _ABOVE, "b": 5},
        "template": "none",
        "hovermode": "closest",
        "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0.0},
        "shapes": [],
        "annotations": [],
        "barmode": "overlay",
    }
    data: list[dict[str, Any]] = []
    named: set[str] = set()
    if figure.legends:  # of all panels: an entry each, without points
        layout["legend"]["y"] = 1.0
    for legend in figure.legends:
        for line, text in zip(legend.get_lines(), legend.get_texts(), strict=True):
            entry = {"type": "scatter", "mode": "lines", "x": [None], "y": [None]}
            look = {"color": to_hex(line.get_color())}
            data.append(entry | {"name": text.get_text(), "line": look, "showlegend": True})
    for number, axes in enumerate(panels, start=1):
        own = "" if number == 1 else str(number)
        layout |= _axes(axes, own, panels)
        for trace in (*_bars(axes), *_curves(axes), *_ranges(axes)):
            name = trace.get("name", "")
            trace["showlegend"] = bool(name) and name not in named
            named.add(name)
            data.append(trace | {"xaxis": f"x{own}", "yaxis": f"y{own}", "legendgroup": name})
        for shape in _shapes(axes, own):
            # One entry of the legend shows and hides all shapes of a name.
            name = shape.get("name", "")
            shape |= {"showlegend": bool(name) and name not in named, "legendgroup": name}
            named.add(name)
            layout["shapes"].append(shape)
        layout["annotations"] += list(_annotations(axes, own))
    return json.dumps({"data": data, "layout": layout}, separators=(",", ":"))


def _is_known(axes: Axes) -> bool:
    """Whether all parts of a panel are translated."""
    return all(isinstance(one, LineCollection) for one in axes.collections) and not axes.images


def _axes(axes: Axes, own: str, panels: Sequence[Axes]) -> dict[str, Any]:
    """Layout of the axes of a panel and of its title."""
    box = axes.get_position()
    x: dict[str, Any] = {"domain": [box.x0, box.x1], "anchor": f"y{own}"}
    y: dict[str, Any] = {"domain": [box.y0, box.y1], "anchor": f"x{own}"}
    for axis, limits, entry in ((axes.xaxis, axes.get_xlim(), x), (axes.yaxis, axes.get_ylim(), y)):
        is_log = axis.get_scale() == "log"
        ends = np.log10(limits) if is_log else np.asarray(limits)
        entry |= {
            "title": {"text": axis.label.get_text()},
            "type": "log" if is_log else "linear",
            "range": _numbers(ends),
            "showgrid": True,
            "zeroline": False,
            # Powers of ten, not letters such as n for 1e-9.
            "exponentformat": "power",
        }
        if isinstance(axis.get_major_locator(), FixedLocator):
            entry["tickvals"] = _numbers(axis.get_majorticklocs())
            texts = axis.get_major_formatter().format_ticks(list(axis.get_majorticklocs()))
            entry["ticktext"] = [text.replace("\n", "<br>") for text in texts]
    # Near its ticks, away from what stands below: a caption, or the title of a panel.
    x["title"]["standoff"] = 4
    if axes.get_aspect() == 1.0:
        y["scaleanchor"] = f"x{own}"
    alike = [
        k
        for k, one in enumerate(panels, start=1)
        if one in axes.get_shared_x_axes().get_siblings(axes)
    ]
    if len(alike) > 1 and own:
        x["matches"] = "x" if alike[0] == 1 else f"x{alike[0]}"
    return {f"xaxis{own}": x, f"yaxis{own}": y}


def _bars(axes: Axes) -> Iterator[dict[str, Any]]:
    for bars in axes.containers:
        if isinstance(bars, BarContainer):
            yield {
                "type": "bar",
                "x": _numbers([bar.get_x() + 0.5 * bar.get_width() for bar in bars]),
                "y": _numbers([bar.get_height() for bar in bars]),
                "width": _numbers([bar.get_width() for bar in bars]),
                "marker": {"color": to_hex(bars[0].get_facecolor())},
                **_named(bars.get_label()),
            }


def _curves(axes: Axes) -> Iterator[dict[str, Any]]:
    """Lines and points whose places are data."""
    for line in axes.lines:
        if line.get_transform() != axes.transData:
            continue
        marker, style = str(line.get_marker()), line.get_linestyle()
        drawn = str(style) in _DASHES
        modes = [*(["lines"] if drawn else []), *(["markers"] if marker in _SYMBOLS else [])]
        if not modes:
            continue
        symbol = _SYMBOLS.get(marker, "circle")
        is_open = str(line.get_markerfacecolor()) == "none" and not symbol.endswith("-open")
        yield {
            "type": "scatter",
            "mode": "+".join(modes),
            # Plotly names nothing without a point in its legend.
            "x": _numbers(line.get_xdata()) or [None],
            "y": _numbers(line.get_ydata()) or [None],
            "opacity": line.get_alpha() or 1.0,
            "line": _look(line),
            "marker": {"color": to_hex(line.get_markeredgecolor()),
                       "size": line.get_markersize() + 1.0,
                       "symbol": f"{symbol}-open" if is_open else symbol},
            **_named(line.get_label()),
        }  # fmt: skip


def _ranges(axes: Axes) -> Iterator[dict[str, Any]]:
    for ranges in axes.collections:
        if isinstance(ranges, LineCollection) and ranges.get_transform() == axes.transData:
            gap = np.full((1, 2), np.nan)
            points = [part for own in ranges.get_segments() for part in (own, gap)]
            x, y = np.concatenate(points).T if points else np.zeros((2, 0))
            yield {
                "type": "scatter",
                "mode": "lines",
                "x": _numbers(x),
                "y": _numbers(y),
                "line": {"color": _colour_of(ranges), "width": 1.6},
                **_named(ranges.get_label()),
            }


def _shapes(axes: Axes, own: str) -> Iterator[dict[str, Any]]:
    """Lines and stripes that run across a panel."""
    of_bars = {bar for bars in axes.containers if isinstance(bars, BarContainer) for bar in bars}
    for patch in axes.patches:
        if patch in of_bars or not isinstance(patch, Rectangle):
            continue
        low, high = patch.get_xy(), (
            patch.get_x() + patch.get_width(), patch.get_y() + patch.get_height()
        )  # fmt: skip
        ends = _ends(axes, own, patch.get_data_transform(), low, high)
        face, name = to_rgba(patch.get_facecolor()), _named(patch.get_label())
        look = {"fillcolor": to_hex(face), "opacity": face[3], "line": {"width": 0}}
        yield {"type": "rect", "layer": "below", **look, **name, **ends}
    for line in axes.lines:
        across = line.get_transform() in (axes.get_xaxis_transform(), axes.get_yaxis_transform())
        if across and np.size(line.get_xdata()) == 2 and line.get_linestyle() != "None":
            (x0, y0), (x1, y1) = np.asarray(line.get_xydata())[[0, -1]].tolist()
            ends = _ends(axes, own, line.get_transform(), (x0, y0), (x1, y1))
            yield {"type": "line", "line": _look(line), **ends, **_named(line.get_label())}
    for ranges in axes.collections:
        if isinstance(ranges, LineCollection) and ranges.get_transform() != axes.transData:
            colour = _colour_of(ranges)
            for low, high in ranges.get_segments():
                ends = _ends(axes, own, ranges.get_transform(), low, high)
                look, name = {"color": colour, "width": 1.0}, _named(ranges.get_label())
                yield {"type": "line", "layer": "below", "line": look, **ends, **name}


def _look(line: Line2D) -> dict[str, Any]:
    dash = _DASHES.get(str(line.get_linestyle()), "solid")
    return {"color": to_hex(line.get_color()), "width": line.get_linewidth(), "dash": dash}


def _colour_of(lines: LineCollection) -> str:
    return to_hex(np.atleast_2d(lines.get_edgecolor())[0])


def _ends(axes: Axes, own: str, transform: Transform, low: Any, high: Any) -> dict[str, Any]:
    """Corners of a shape whose x or y counts along its panel from 0 to 1."""
    by_x = transform == axes.get_xaxis_transform()
    by_y = transform == axes.get_yaxis_transform()
    (x0, y0), (x1, y1) = _numbers(low), _numbers(high)
    refs = {"xref": f"x{own} domain" if by_y else f"x{own}"}
    refs["yref"] = f"y{own} domain" if by_x else f"y{own}"
    return {**refs, "x0": x0, "x1": x1, "y0": y0, "y1": y1}


def _annotations(axes: Axes, own: str) -> Iterator[dict[str, Any]]:
    """Texts at places of a panel, and its title."""
    font = {"size": 11}
    for text in axes.texts:
        x, y = _numbers(getattr(text, "xy", text.get_position()))
        above = getattr(text, "xyann", (0.0, 0.0))[1] >= 0.0
        yield {"text": text.get_text(), "x": x, "y": y, "xref": f"x{own}", "yref": f"y{own}",
               "showarrow": False, "yshift": 10 if above else -10, "font": font}  # fmt: skip
    title = axes.get_title(loc="left")
    if title:
        # That of a narrow panel at the right may be longer than the panel.
        side, x = ("right", 1.0) if axes.get_position().x0 > 0.5 else ("left", 0.0)
        yield {"text": title.replace("\n", "<br>"), "x": x, "y": 1.0, "xref": f"x{own} domain",
               "xanchor": side, "yref": f"y{own} domain", "yanchor": "bottom",
               "showarrow": False, "align": side}  # fmt: skip


def _named(label: object) -> dict[str, str]:
    text = str(label)
    return {} if label is None or text.startswith("_") else {"name": text}


def _numbers(values: Any) -> list[float | None]:
    """Numbers with six digits; None, a gap, where they are not finite."""
    known = np.asarray(values, dtype=float).tolist()
    return [float(f"{value:.6g}") if np.isfinite(value) else None for value in known]
