"""Parts of a line in a scene: their names in other tables, and curves of droppers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from measuring import matrix_of
from scenes import Scene, find_case, line_of, load_scene, mesh_of, problem_of, recorded

from catenary import InputError
from catenary.cases.scene.input.csv_files import file_key_of
from catenary.cases.scene.input.faults import SceneError
from catenary.meshgen.wires import Role
from catenary.solver.model.switching_links import switching_links
from catenary.solver.problem.defects import TensionLoss
from catenary.solver.problem.watched_links import UPLIFT_STOPS
from catenary.solver.statics.form_finding import find_form

# --- names of parts of the line in other tables ---------------------------------------------------


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


# --- measured curves of droppers ------------------------------------------------------------------


NO_STIFFNESS = "line.dropper.stiffness_N_per_m="
POINTS = [[0.0, 0.0], [5e-4, 15.0], [1e-3, 60.0], [3e-3, 400.0]]
FILE = "strain, tension_N\n# at 20 degrees\n" + "\n".join(f"{e}, {n}" for e, n in POINTS) + "\n"


def load(*overrides: str) -> Scene:
    return load_scene("ac_simple", [NO_STIFFNESS, *overrides])


def test_a_curve_says_what_droppers_pull() -> None:
    (group,) = problem_of(load(f"line.dropper.curve={POINTS}")).line.droppers
    assert group.kind.curve == tuple(map(tuple, POINTS))
    slopes = group.kind.slopes_at(np.array([1.0, 0.5]))
    strain, tension = np.array(POINTS).T
    for stretch in (2e-4, 7e-4, 2.5e-3):
        at = np.array([stretch, 0.5 * stretch])
        assert slopes.force_at(at) == pytest.approx(np.interp(stretch, strain, tension), rel=1e-14)
        assert slopes.stretch_under(slopes.force_at(at)) == pytest.approx(at, rel=1e-14)
    # The last slope goes on, and the first one below.
    assert slopes.force_at(np.array([5e-3, -5e-4])) == pytest.approx([740.0, -30.0], rel=1e-14)


def test_a_file_is_taken_in_and_the_resolved_scene_needs_it_no_more(tmp_path: Path) -> None:
    (tmp_path / "dropper.csv").write_text(FILE)
    case = find_case("ac_simple").read_text()
    key = next(line for line in case.splitlines() if line.startswith("stiffness_N_per_m = 1e5"))
    (tmp_path / "case.toml").write_text(case.replace(key, 'curve_file = "dropper.csv"'))
    scene = load_scene(tmp_path / "case.toml")
    assert problem_of(scene) == problem_of(load(f"line.dropper.curve={POINTS}"))
    (tmp_path / "dropper.csv").unlink()
    again = recorded(scene)
    assert problem_of(again) == problem_of(scene)


def test_all_tables_of_droppers_take_a_file(tmp_path: Path) -> None:
    file = tmp_path / "dropper.csv"
    file.write_text(FILE)
    own = "line.auxiliary_wire.dropper"
    scene = load_scene(
        "shinkansen_compound", [f"{own}.stiffness_N_per_m=", f"{own}.curve_file={file}"]
    )
    kinds = {group.name: group.kind.curve for group in problem_of(scene).line.droppers}
    assert list(kinds.values()).count(tuple(map(tuple, POINTS))) == 1
    free = Path(__file__).parents[2] / "docs/examples/two_messengers.toml"
    links = list(enumerate(load_scene(free).line.links or []))
    number, first = next((i, link) for i, link in links if link.type == "droppers")
    key = f"line.links.{number}"
    words = [f"{key}.stiffness_N_per_m=", f"{key}.axial_stiffness_N=", f"{key}.curve_file={file}"]
    of_links = load_scene(free, words)
    assert file_key_of(f"{key}.curve", of_links.origin) == f"{key}.curve_file"
    found = problem_of(of_links)
    assert next(g for g in found.line.droppers if g.name == first.name).kind.curve is not None


@pytest.mark.parametrize(
    ("curve", "sentence"),
    [
        ("[[0, 0]]", "at least 2"),
        ("[[0, 0], [1e-3]]", "at least 2"),
        (f"{[[1e-3 * i, 10.0 * i] for i in range(21)]}", "at most 20"),
        ("[[0, 5], [1e-3, 50]]", "must begin with strain 0 and tension 0, but begins with 0, 5"),
        ("[[1e-4, 0], [1e-3, 50]]", "but begins with 0.0001, 0"),
        ("[[0, 0], [2e-3, 50], [1e-3, 60]]", "its strains in ascending order, but 0.001 follows"),
        ("[[0, 0], [1e-3, 50], [1e-3, 60]]", "its strains in ascending order, but 0.001 follows"),
        ("[[0, 0], [1e-3, -5]]", "its tensions in ascending order, but -5 follows 0"),
        ("[[0, 0], [1e-3, 50], [2e-3, 40]]", "its tensions in ascending order, but 40 follows 50"),
        ("[[0, 0], [1e-3, 50], [2e-3, 50]]", "its tensions in ascending order, but 50 follows 50"),
        ("[[0, 0], [1e-12, 50]]", "must have slopes of 1 to 1e+09 N, but has 5e+13 N between"),
        ("[[0, 0], [1e-3, 50], [1, 50.1]]", "but has 0.1 N between strains 0.001 and 1"),
        ("[[0, 0], [1e-3, nan]]", "finite"),
    ],
)
def test_what_is_no_curve_is_refused_in_a_sentence(curve: str, sentence: str) -> None:
    with pytest.raises(InputError) as refused:
        load(f"line.dropper.curve={curve}")
    told = str(refused.value)
    assert sentence in told and "line.dropper.curve" in told and "\n" not in told


def test_one_of_stiffness_and_curve_is_given() -> None:
    for words, sentence in (
        ([f"line.dropper.curve={POINTS}"], "stiffness_N_per_m and curve are given"),
        ([NO_STIFFNESS], "axial_stiffness_N, curve, but none is given"),
    ):
        with pytest.raises(InputError, match=sentence):
            load_scene("ac_simple", words)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "it holds no pairs of numbers"),
        ("0, 0\n1e-3; 50\n", "its line 2 must hold two numbers and a comma between"),
        ("0, 0\n1e-3, 50\n2e-3, 40\n", "its tensions in ascending order, but 40 follows 50"),
    ],
)
def test_files_that_are_no_curve_are_refused(tmp_path: Path, text: str, sentence: str) -> None:
    file = tmp_path / "dropper.csv"
    file.write_text(text)
    with pytest.raises(InputError, match=sentence) as refused:
        load(f"line.dropper.curve_file={file}")
    assert "line.dropper.curve" in str(refused.value) and "\n" not in str(refused.value)


def test_a_file_that_is_none_is_refused_and_nothing_else_is_told() -> None:
    for words, sentence in (
        (["line.dropper.curve_file=/dev/zero"], "it is no regular file"),
        (["line.dropper.curve_file=none.csv"], "cannot be read: no such file"),
        (["line.dropper.curve_file=a.csv", f"line.dropper.curve={POINTS}"], "is given too"),
    ):
        with pytest.raises(InputError) as refused:
            load(*words)
        told = str(refused.value)
        assert told.startswith("line.dropper.curve_file is") and sentence in told
        assert "\n" not in told
