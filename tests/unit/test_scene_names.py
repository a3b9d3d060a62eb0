"""Names of parts of the line in other tables: damping by component, wires that lose tension."""

from __future__ import annotations

import numpy as np
import pytest
from measuring import matrix_of
from scenes import line_of, load_scene, mesh_of, problem_of

from catenary.cases.scene.input.faults import SceneError
from catenary.meshgen.wires import Role
from catenary.solver.model.switching_links import switching_links
from catenary.solver.problem.defects import TensionLoss
from catenary.solver.problem.watched_links import UPLIFT_STOPS
from catenary.solver.statics.form_finding import find_form

CASES = ("ac_simple", "re330_stitched", "shinkansen_compound", "dc_twin", "tramway")
# What befalls a single part moves twin wires relative to each other.
MORE = {"dc_twin": ["effects.relative_motion=true"]}


def damped(name: str) -> str:
    return f"line.damping.per_component.{name}={{alpha_s=1e-3,beta_per_s=0.02}}"


def lost(wire: str, share: float = 0.9) -> str:
    return f"incidents=[{{type='tension_loss',at_s=1.0,wire='{wire}',share={share}}}]"


def wrong(*factors: tuple[str, float]) -> str:
    listed = (f"{{type='wrong_tension',wire='{wire}',factor={factor}}}" for wire, factor in factors)
    return f"defects=[{','.join(listed)}]"


@pytest.mark.parametrize("case", CASES)
def test_any_part_of_the_line_may_have_damping_of_its_own(case: str) -> None:
    for name in line_of(load_scene(case, [])).components:
        words = [damped(name), *MORE.get(case, ())]
        found = problem_of(load_scene(case, words)).damping.per_component
        assert found[name] == (1e-3, 0.02)


STOPPED = ("line.steady_arm.uplift_stop_m=0.05",)


def test_what_an_effect_adds_may_have_damping_of_its_own() -> None:
    """Stops above arms are open links, whose damper is alpha times their stiffness."""
    mesh = mesh_of(load_scene("ac_simple", STOPPED))
    for words, alpha in (((), None), ((damped("arm_stops"),), 1e-3)):
        problem = problem_of(load_scene("ac_simple", [*STOPPED, *words]))
        model, form = find_form(problem, mesh)
        (stops,) = (links for links in model.links if links.component == UPLIFT_STOPS)
        followed = switching_links(model, form.dropper_force).arrays.law
        own = followed[followed["carried"] == 0.0]  # the stops, open at rest
        assert own.size == stops.law.size > 0
        expected = problem.damping.alpha if alpha is None else alpha
        np.testing.assert_allclose(
            np.abs(own["damping"]), expected * np.abs(own["stiffness"]), rtol=1e-12
        )


def test_tensioners_may_have_damping_of_their_own() -> None:
    """beta times the inertia of the weights stands in C at the ends of the wires."""
    words = (
        "effects.axial_motion=true", "line.contact_wire.axial_stiffness_N=1.5e7",
        "line.messenger_wire.axial_stiffness_N=1.2e7", "line.ends.start.along=tensioner",
    )  # fmt: skip
    problem = problem_of(load_scene("ac_simple", words))
    own = problem_of(load_scene("ac_simple", [*words, damped("tensioners")]))
    mesh = mesh_of(load_scene("ac_simple", words))
    usual, other = (find_form(one, mesh)[0] for one in (problem, own))
    more = (matrix_of(other, damping=1.0) - matrix_of(usual, damping=1.0)).diagonal()
    tensioner = problem.along.tensioner
    inertia = [tensioner.inertia(w.name, w, problem.gravity) for w in problem.line.wires]
    changed = more[np.abs(more) > 1e-9 * max(inertia)]
    expected = (0.02 - problem.damping.beta) * np.array(inertia)
    np.testing.assert_allclose(np.sort(changed), np.sort(expected), rtol=1e-9)


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
        (damped("arm_stops"), "the line has contact_wire, stitch_wire, messenger_wire"),
        (damped("tensioners"), "the line has contact_wire, stitch_wire, messenger_wire"),
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


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ([wrong(("stitch_wire", 2.0))], r"defects.0.factor is 2 .*would then take 22000 N of its"),
        (
            [wrong(("stitch_wire", 1.5), ("messenger_wire", 0.6))],
            r"defects.1.factor is 0.6 .*would then take 16500 N of its 12600 N",
        ),
        (
            [wrong(("messenger_wire", 0.6)), lost("messenger_wire", 0.7)],
            r"incidents.0.share is 0.7 .*would then take 11000 N of its 8820 N",
        ),
        ([wrong(("stitch_wire", 0.8), ("messenger_wire", 0.6)), lost("stitch_wire", 0.5)], None),
    ],
)
def test_a_wire_keeps_more_than_clamped_ones_take_whatever_befalls_both(
    changes: list[str], sentence: str | None
) -> None:
    changes = ["line.stitch_wire.tension_N=11000", *changes]
    if sentence is None:
        load_scene("re330_stitched", changes)
        return
    with pytest.raises(SceneError, match=sentence) as refused:
        load_scene("re330_stitched", changes)
    assert len(refused.value.faults) == 1


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


def test_sections_side_by_side_lose_tension_each_by_itself() -> None:
    """In an overlap stitch wires of both sections take as much over the same stretches."""
    changes = ["line.overlap.first_span=12", "line.overlap.rise_m=0.6"]
    line = line_of(load_scene("re330_stitched", changes))
    for own, other in (("", "_next"), ("_next", "")):
        name, carrier = f"stitch_wire{own}", f"messenger_wire{own}"
        after = line.with_shares({name: 0.6})
        stitch, messenger = after.wire(name), after.wire(carrier)
        middle = np.array([0.5 * (piece.x[0] + piece.x[-1]) for piece in stitch.pieces])
        both = messenger.tension_at(middle) + stitch.tension
        np.testing.assert_allclose(both, messenger.tension, rtol=1e-12)
        unchanged = after.wire(f"messenger_wire{other}"), line.wire(f"messenger_wire{other}")
        np.testing.assert_array_equal(*(wire.tension_at(middle) for wire in unchanged))
