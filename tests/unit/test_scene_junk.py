"""Whatever is typed, a scene loads or is refused in one sentence; nothing else ever happens."""

from __future__ import annotations

import string

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scenes import Scene, load_scene, resolved, scene_from
from verb_runner import invoke

from catenary import InputError
from catenary.cases.scene.input.faults import Origin
from catenary.cases.scene.keys.keys import known_keys

KEYS = [key.replace("*", "0") for key in known_keys(Scene)]
NUMBERS = st.one_of(
    st.integers(),
    st.floats(),
    st.sampled_from([0, -1, 1, 10**400, 1e308, 5e-324, float("nan"), float("-inf")]),
)
VALUES = st.recursive(
    st.one_of(st.none(), st.booleans(), NUMBERS, st.text(max_size=20)),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.dictionaries(st.text(string.ascii_letters + "_.[]", max_size=12), inner, max_size=3),
    ),
    max_leaves=8,
)
PLENTY = settings(
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)


def one_sentence(error: InputError) -> None:
    text = str(error)
    assert text and "\n" not in text
    assert len(text) < 1500


@PLENTY
@given(key=st.sampled_from(KEYS), value=st.one_of(VALUES.map(repr), st.text(max_size=40)))
def test_any_value_of_a_known_key(key: str, value: str) -> None:
    try:
        load_scene("en50318_2002", [f"{key}={value}"])
    except InputError as error:
        one_sentence(error)


@PLENTY
@given(text=st.text(max_size=60))
def test_any_assignment(text: str) -> None:
    try:
        load_scene("ambrosio2012", [text])
    except InputError as error:
        one_sentence(error)


@PLENTY
@given(key=st.sampled_from(KEYS), value=VALUES)
def test_any_content_of_a_table(key: str, value: object) -> None:
    raw = resolved(load_scene("ac_simple"))
    table, parts = raw, key.split(".")
    for part in parts[:-1]:
        table = table.setdefault(part, {}) if isinstance(table, dict) else raw
    if isinstance(table, dict):
        table[parts[-1]] = value
    try:
        scene_from(raw, Origin("case.toml", recorded=True))
    except InputError as error:
        one_sentence(error)


@PLENTY
@given(raw=VALUES)
def test_any_content_at_all(raw: object) -> None:
    with pytest.raises(InputError) as caught:
        scene_from(raw if isinstance(raw, dict) else {"line": raw}, Origin("case.toml"))
    one_sentence(caught.value)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(key=st.sampled_from(KEYS), value=NUMBERS)
def test_the_command_line_exits_with_0_or_with_2_and_one_line(key: str, value: float) -> None:
    # Sizes are bounded by the schema, but a mesh of the largest allowed line takes minutes.
    if key in ("line.n_spans", "mesh.elements_per_gap", "mesh.support_refinement"):
        value = -abs(value)
    result = invoke("check", "en50318_2002", "--set", f"{key}={value}")
    assert result.exit_code in (0, 2), result.output
    if result.exit_code == 2:
        assert all(line.startswith("catenary: ") for line in result.output.splitlines())
    else:
        # A line of the scene, one of each kind of pantograph, one of the ends, one of the waves
        # that each pantograph meets.
        sound = [line for line in result.output.splitlines() if not line.startswith("WARNING ")]
        assert sound[0].startswith("en50318_2002 is valid: ")
        assert len(sound) == 4, result.output
