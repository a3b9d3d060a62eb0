"""A line over temperatures: tensions, ends that move, limits that it keeps, as text and drawn."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.problem import problem_of
from catenary.cases.scene.scene import Scene
from catenary.solver.statics.tension_along import LineAtTemperature, WireAtRest, over_temperatures

# Limits of the change of tension: share, of what, and who states it.
_LIMITS = (
    (0.10, "largest", "10 % of TB 10009-2016, 5.4.7"),
    (0.11, "largest", "11 % for a half section (Kiessling et al., section 6)"),
    (0.08, "along", "8 % for the line alone (Kiessling et al., section 6)"),
    (0.03, "at_tensioners", "3 % for the tensioner (Kiessling et al., section 6)"),
)
# Shares that differ by less are one: a tensioner keeps to the edge of its band.
_SAME = 1e-6
_OF = {"largest": "", "along": " along the wire", "at_tensioners": " at its tensioner"}


def temperature_text(rests: Sequence[LineAtTemperature], ratio: float) -> str:
    """The table over temperatures, and remarks on limits.

    Parameters
    ----------
    ratio : travel of the weights over that of the wire
    """
    lines = [
        f"{'dT [K]':>7} {'wire':22}{'least [N]':>10}{'most [N]':>10}{'along [%]':>10}"
        f"{'tensioner [%]':>14}{'end [mm]':>10}{'weights [mm]':>13}"
    ]
    for rest in rests:
        head = f"{rest.warmer:7g} "
        if rest.why_not:
            lines.append(f"{head}{rest.why_not}")
            continue
        for wire in rest.wires:
            if wire.ends:
                lines.append(head + _row(wire, ratio))
                head = " " * 8
    remarks = list(dict.fromkeys(_remarks(rests)))
    if remarks:
        return "\n".join([*lines, "", *remarks])
    return "\n".join([*lines, "", "All changes of tension are within 10 %, and 8 % along a wire."])


def _row(wire: WireAtRest, ratio: float) -> str:
    moved = wire.moved[abs(wire.moved).argmax()]
    tensioned = any(end.tensioned for end in wire.ends)
    weights = f"{1e3 * ratio * moved:13.0f}" if tensioned else f"{'-':>13}"
    own = f"{100 * wire.at_tensioners:14.2f}" if tensioned else f"{'-':>14}"
    return (
        f"{wire.name:22}{wire.tension.min():10.0f}{wire.tension.max():10.0f}"
        f"{100 * wire.along:10.2f}{own}{1e3 * moved + 0.0:10.0f}{weights}"
    )


def _remarks(rests: Sequence[LineAtTemperature]) -> Iterator[str]:
    """A sentence for each limit that a wire exceeds, at the temperature where it does so most."""
    names = dict.fromkeys(wire.name for rest in rests for wire in rest.wires)
    for name in names:
        own = [(rest.warmer, wire) for rest in rests for wire in rest.wires if wire.name == name]
        for limit, what, source in _LIMITS:
            warmer, worst = max(own, key=lambda at: getattr(at[1], what))
            value = getattr(worst, what)
            if value > limit + _SAME:
                yield (
                    f"{name}: at {warmer:+g} K the tension changes by {100 * value:.1f} %"
                    f"{_OF[what]}, more than {source}"
                )


# Steps between temperatures [K], of which a range has no more than so many.
_STEPS, _MOST_STEPS = (0.1, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0), 8
# Differences that a scene may have [K].
_LEAST, _MOST = -100.0, 150.0
_EFFECTS = ("axial_motion", "temperature")


def range_of(text: str) -> list[float]:
    """The temperatures of "LOW,HIGH", differences from the installation (n,) [K].

    Raises
    ------
    InputError
        If the text is no ascending pair of numbers within what a scene may have.
    """
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(
            f"--temperatures {text!r} must be two numbers, such as -20,40: the lowest and the "
            "highest difference from the installation in K"
        ) from None
    if not _LEAST <= low < high <= _MOST:
        raise InputError(
            f"--temperatures {text} must ascend and lie between {_LEAST:g} and {_MOST:g} K"
        )
    step = next(step for step in _STEPS if high - low <= _MOST_STEPS * step)
    between = step * np.arange(np.ceil(low / step), np.floor(high / step) + 1.0)
    found: list[float] = np.unique(np.concatenate([[low], between, [high]])).tolist()
    return found


def temperatures(scene: Scene, differences: Sequence[float], picture: Path | None) -> str:
    """The table of a line over temperatures. Not collective.

    ``differences`` are those from the installation [K]; ``picture`` is a new file, or None.

    Raises
    ------
    InputError
        If the scene does not let its wires move along the track.
    RunBroken
        If the picture cannot be written.
    """
    switches = scene.switches()
    for name in _EFFECTS:
        if not switches[name]:
            raise InputError(
                f"--temperatures needs effects.{name} = true, with what that needs of the scene; "
                f"it is off {scene.origin.of(f'effects.{name}')}"
            )
    problem, mesh = problem_of(scene), mesh_of(scene)
    rests = over_temperatures(problem, mesh, differences)
    if picture is not None:
        # Matplotlib takes long to import.
        from catenary.postproc.files.disk import write_into
        from catenary.postproc.report.pictures.figures import file_of
        from catenary.postproc.report.pictures.line_pictures import draw_temperatures

        drawn = file_of(draw_temperatures(rests), picture.name)
        write_into(picture.parent, {picture.name: drawn})
    return temperature_text(rests, problem.along.tensioner.ratio)
