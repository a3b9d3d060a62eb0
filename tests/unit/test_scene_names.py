"""Names of parts of the line in other tables: damping by component, wires that lose tension."""

from __future__ import annotations

import numpy as np
import pytest

from catenary.cases.scene.input.faults import SceneError
from catenary.cases.scene.load import load_scene
from catenary.cases.scene.problem import line_of, problem_of
from catenary.meshgen.wires import Role
from catenary.solver.problem.incidents import TensionLoss

CASES = ("ac_simple", "re330_stitched", "shinkansen_compound", "dc_twin", "tramway")
# What befalls a single part moves twin wires relative to each other.
MORE = {"dc_twin": ["effects.relative_motion=true"]}


def damped(name: str) -> str:
    return f"line.damping.per_component.{name}={{alpha_s=1e-3,beta_per_s=0.02}}"


def lost(wire: str, share: float = 0.9) -> str:
    return f"incidents=[{{type='tension_loss',at_s=1.0,wire='{wire}',share={share}}}]"


@pytest.mark.parametrize("case", CASES)
def test_any_part_of_the_line_may_have_damping_of_its_own(case: str) -> None:
    for name in line_of(load_scene(case, [])).components:
        words = [damped(name), *MORE.get(case, ())]
        found = problem_of(load_scene(case, words)).damping.per_component
        assert found[name] == (1e-3, 0.02)


@pytest.mark.parametrize("case", CASES)
def test_any_wire_of_the_line_may_lose_tension(case: str) -> None:
    for wire in line_of(load_scene(case, [])).wires:
        problem = problem_of(load_scene(case, [lost(wire.name), *MORE.get(case, ())]))
        assert problem.incidents == (TensionLoss(1.0, wire.name, 0.9),)


@pytest.mark.parametrize(
    "change, words",
    [
        (damped("stich_wire"), "did you mean stitch_wire? the line has contact_wire, stitch_wire"),
        (damped("auxiliary_wire"), "the line has contact_wire, stitch_wire, messenger_wire"),
        (lost("messenger"), "did you mean messenger_wire?"),
        (lost("droppers"), "the line has contact_wire, stitch_wire, messenger_wire"),
    ],
)
def test_a_name_that_no_part_has_is_refused(change: str, words: str) -> None:
    with pytest.raises(SceneError) as refused:
        load_scene("re330_stitched", [change])
    sentence = str(refused.value)
    assert words in sentence and "\n" not in sentence


def test_a_wire_keeps_more_tension_than_those_clamped_to_it_take() -> None:
    line = line_of(load_scene("re330_stitched", []))
    (messenger,), (stitch,) = line.wires_of(Role.MESSENGER), line.wires_of(Role.STITCH)
    least = stitch.tension / messenger.tension
    load_scene("re330_stitched", [lost("messenger_wire", least + 0.01)])
    with pytest.raises(SceneError, match=f"it must be greater than {least:.3g}"):
        load_scene("re330_stitched", [lost("messenger_wire", least - 0.01)])


def test_a_second_contact_wire_is_as_slow_as_the_first() -> None:
    """The train may be no faster than waves on any of them."""
    for wire in ("contact_wire", "contact_wire_2"):
        with pytest.raises(SceneError, match="the wave speed of the contact wire would fall to"):
            load_scene("dc_twin", [lost(wire, 0.02)])


def test_tensions_at_clamps_stay_in_balance() -> None:
    """What a stitch wire takes of the messenger wire's tension falls with its own; outside of the
    clamps the messenger wire keeps all of it."""
    line = line_of(load_scene("re330_stitched", []))
    (stitch,) = line.wires_of(Role.STITCH)
    middle = np.array([0.5 * (piece.x[0] + piece.x[-1]) for piece in stitch.pieces])
    outside = np.array([piece.x[0] - 1.0 for piece in stitch.pieces])
    own, other = {stitch.name: 0.6}, {"messenger_wire": 0.8}
    for shares in (own, other, own | other):
        after = line.with_shares(shares)
        messenger, tension = after.wire("messenger_wire"), after.wire(stitch.name).tension
        assert tension == pytest.approx(shares.get(stitch.name, 1.0) * stitch.tension)
        np.testing.assert_allclose(messenger.tension_at(outside), messenger.tension, rtol=1e-12)
        both = messenger.tension_at(middle) + tension
        np.testing.assert_allclose(both, messenger.tension, rtol=1e-12)
