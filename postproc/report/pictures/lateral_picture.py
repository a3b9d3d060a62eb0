"""Picture of where contact wires are on the strips under way."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from catenary.postproc.read.results import Results
from catenary.postproc.report.pictures.envelope import thinned
from catenary.postproc.report.pictures.figures import colour, legend_above, own_style, stacked, tidy
from catenary.postproc.report.pictures.marks import mark_line, travelled


@own_style()
def lateral_places(results: Results) -> Figure:
    """Lateral place of each contact wire on each strip along the track, and where strips end."""
    names = results.pantograph_names()
    start, end = travelled(results)
    figure, panels = stacked(0.7 + 2.7 * len(names), len(names), shared=True)
    half_lengths = results.facts_of("strip_half_length")
    columns, words = results.contact_columns(), results.contact_names()
    for p, axes in enumerate(panels):
        mark_line(axes, results, start, end)
        position = results.column("contact_position", p)
        for number, column in enumerate(range(columns[p].start, columns[p].stop)):
            place = results.column("lateral_place", column)
            chosen = thinned(place)
            label = words[p][number] or "contact wire"
            axes.plot(
                position[chosen], place[chosen], color=colour(number), linewidth=1.2, label=label
            )
        if np.isfinite(half_lengths[p]):
            for side, label in ((1.0, "end of the strips"), (-1.0, "")):
                at = side * float(half_lengths[p])
                axes.axhline(at, color="0.35", linestyle="--", linewidth=1.0, label=label or None)
        tidy(axes, "", "place on the strip, to the left [m]", names[p].capitalize())
        legend_above(axes)
    panels[-1].set_xlabel("position of the pantograph along the track [m]")
    return figure
