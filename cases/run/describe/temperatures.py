"""What a line does over temperatures, as text: tensions, ends that move, limits that it keeps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from catenary.solver.statics.tension_along import LineAtTemperature, WireAtRest

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
