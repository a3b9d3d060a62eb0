"""Lines that go on beyond their ends, with something that has changed all along them: they rest as
the middle of a long line does, which is as warm, as worn and as windy beyond."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from measuring import check
from small_lines import WHOLE, ac_simple_line, mesh_of, problem_of

from catenary import InputError
from catenary.meshgen.line import Curve, DropperPlace
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.solver.problem.defects import Defect, MissingDropper, WornWire, WrongTension
from catenary.solver.problem.ends import Fixed, Periodic
from catenary.solver.problem.wind import Wind
from catenary.solver.statics.form_finding import find_form

SPAN, SHORT, BESIDE = 55.0, 6, 6
DEFECTS = frozenset({"worn_wire", "wrong_tension", "missing_dropper", "wind", "periodic_ends"})
HELD, GOES_ON = (Fixed(), Fixed()), (Periodic(), Periodic())


def line(n_spans: int, lateral: str = "") -> Any:
    own = ac_simple_line(n_spans)
    # To the outside of a curve to the left everywhere; or a zig-zag.
    if lateral == "curve":
        stagger = (-0.2,) * (n_spans + 1)
        own = replace(own, stagger=stagger, messenger_stagger=stagger, curve=Curve(1 / 700, 0.07))
    wires = own.contact_wire, own.messenger_wire
    assert wires[1] is not None
    return replace(
        own,
        contact_wire=replace(wires[0], diameter=0.0144),
        messenger_wire=replace(wires[1], diameter=0.014),
    )


def resting(lateral: str, ends: Any, before: int, *defects: Defect, windy: bool) -> Any:
    """Heights and lateral positions of the six spans after ``before`` others, (n,) [m] each."""
    n_spans = SHORT + 2 * before
    own = line(n_spans, lateral)
    effects = (WHOLE | DEFECTS | {"lateral_motion"}) if lateral else WHOLE | DEFECTS
    wind = Wind(25.0, height=10.0) if windy else None
    problem = problem_of(own, effects, ends=ends, defects=defects, wind=wind)
    mesh = mesh_of(own, 2)
    _, form = find_form(problem, mesh)
    x = mesh.x(np.arange(mesh.n_nodes)) - SPAN * before
    # Nodes of both lines stand in one order along the track.
    wires = [mesh.wires[name] for name in (CONTACT_WIRE, MESSENGER_WIRE)]
    there = np.concatenate([w[(x[w] > -1e-6) & (x[w] < SPAN * SHORT + 1e-6)] for w in wires])
    y = form.lateral.y[there] if form.lateral is not None else np.zeros(there.size)
    return form.height[there], y


def worn(n_spans: int) -> WornWire:
    return WornWire(CONTACT_WIRE, 0.0, SPAN * n_spans, 0.2)


@pytest.mark.parametrize(
    ("lateral", "what"),
    [
        ("", "tension"),
        ("zig-zag", "tension"),
        ("zig-zag", "wear"),
        ("curve", "wind"),
        ("", "a dropper"),
        ("zig-zag", "a dropper"),
    ],
)
def test_a_short_line_rests_as_the_middle_of_a_long_one(lateral: str, what: str) -> None:
    """What an end does fades by a hundred a span: 1e-12 over six spans, of some 0.1 m; Newton's
    method ends at 1e-9 m. An end before a line that stays as it was moves half as far as a mast."""

    def found(before: int, ends: Any, *, changed: bool = True) -> Any:
        defects: tuple[Defect, ...] = ()
        if what == "tension":
            defects = (WrongTension(MESSENGER_WIRE, 0.9),)
        elif what == "wear":
            defects = (worn(SHORT + 2 * before),)
        elif what == "a dropper":
            defects = (MissingDropper(DropperPlace(SPAN * (before + 2) + 44.75)),)
        windy = what == "wind" and changed
        return resting(lateral, ends, before, *(defects if changed else ()), windy=windy)

    height, y = found(0, GOES_ON)
    expected_height, expected_y = found(BESIDE, HELD)
    sound = found(0, GOES_ON, changed=False)
    assert max(np.abs(height - sound[0]).max(), np.abs(y - sound[1]).max()) > 5e-3
    check("height [m]", height, expected_height, within=1e-9)
    check("to the left [m]", y, expected_y, within=1e-9)


def test_a_zig_zag_in_the_wind_is_refused_and_the_wind_named() -> None:
    with pytest.raises(InputError, match=r"another kind, as the mean wind \(wind\) makes spans"):
        resting("zig-zag", GOES_ON, 0, windy=True)
