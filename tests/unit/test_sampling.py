"""Samples of uncertain keys: distributions, rank correlations, fields along the line, bad files."""

from __future__ import annotations

import copy
import json
import math
import time
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import Scene, line_of, load_scene, read_draft
from scipy import stats

from catenary import InputError
from catenary.cases.scene.input.case_files import parse_assignment
from catenary.cases.studies.sweep.jobs import scene_of
from catenary.cases.studies.sweep.variants import Variant
from catenary.cases.studies.uncertainty.samples import sample_name, samples
from catenary.cases.studies.uncertainty.sampling import SamplingTable, read_sampling, sampling_of

CASE = "en50318_2002"
FILE = "uncertain.toml"
SPEED, TENSION = "train.speed_km_h", "line.contact_wire.tension_N"
MASSES = "pantographs.reference.masses_kg"
LENGTHS = "irregularities.dropper_lengths.by_dropper"
HEIGHTS = "irregularities.contact_wire_height.by_place"


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene(CASE)


def table(**raw: Any) -> SamplingTable:
    return sampling_of(copy.deepcopy(raw), FILE)


def drawn(scene: Scene, **raw: Any) -> list[Variant]:
    return samples(table(**raw), scene, FILE)


def numbers(variants: list[Variant], key: str) -> np.ndarray:
    return np.array([float(one.varied[key]) for one in variants])


# Closed forms, each by SciPy's own parameters and none by the code under test.
KNOWN: dict[str, tuple[dict[str, Any], Any]] = {
    "normal": ({"mean": 250.0, "standard_deviation": 5.0}, stats.norm(250.0, 5.0)),
    "lognormal": (
        # exp of N(mu, s^2) has mean exp(mu + s^2/2) and variance (exp(s^2) - 1) mean^2.
        {
            "mean": math.exp(5.5 + 0.02),
            "standard_deviation": math.exp(5.52) * math.sqrt(math.expm1(0.04)),
        },
        stats.lognorm(0.2, scale=math.exp(5.5)),
    ),
    "uniform": ({"least": 200.0, "most": 300.0}, stats.uniform(200.0, 100.0)),
    "truncated_normal": (
        {"mean": 250.0, "standard_deviation": 20.0, "least": 240.0},
        stats.truncnorm(-0.5, np.inf, 250.0, 20.0),
    ),
}


@pytest.mark.parametrize("method", ["random", "latin_hypercube", "sobol"])
@pytest.mark.parametrize("kind", KNOWN)
def test_samples_have_the_distribution(kind: str, method: str, scene: Scene) -> None:
    given, known = KNOWN[kind]
    found = drawn(scene, n=2048, method=method, keys={SPEED: {"type": kind, **given}})
    x = numbers(found, SPEED)
    # Independent values: exceeded once in 1000 samplings (Smirnov). The other methods are nearer:
    # with one value in each of 2048 cells no distance is above 1/2048.
    distance = stats.kstest(x, known.cdf).statistic
    assert distance < (1.95 / math.sqrt(2048) if method == "random" else 1.0 / 2048 + 1e-9)
    assert found[0].assignments == (f"{SPEED}={found[0].varied[SPEED]}",)
    assert [one.name for one in found[:2]] == ["sample_000001", "sample_000002"]


def test_a_mean_that_is_left_out_is_the_scenes_own(scene: Scene) -> None:
    key = {"type": "normal", "standard_deviation": 100.0}
    x = numbers(drawn(scene, n=1024, keys={TENSION: key}), TENSION)
    # Sobol points give the mean to a few hundredths of 100/sqrt(1024) = 3 N.
    assert scene.line.contact_wire is not None
    assert abs(x.mean() - scene.line.contact_wire.tension_N) < 1.0


def test_choices_come_by_their_weights_and_keep_their_types(scene: Scene) -> None:
    key = {"type": "choices", "values": ["hertz", 3, True, [1.5, "a"]], "weights": [1, 2, 0, 1]}
    found = drawn(scene, n=1024, keys={"contact.law": key})
    texts = [one.varied["contact.law"] for one in found]
    # Sobol points hit each interval of a multiple of 1/1024 exactly.
    counts = {text: texts.count(text) for text in texts}
    assert counts == {"hertz": 256, "3": 512, '[1.5, "a"]': 256}


def test_seeds_differ_from_sample_to_sample(scene: Scene) -> None:
    key = "irregularities.dropper_lengths.seed"
    found = drawn(scene, n=500, keys={key: {"type": "seed"}})
    seeds = {int(one.varied[key]) for one in found}
    assert len(seeds) == 500 and min(seeds) >= 0 and max(seeds) < 2**31 - 1


@pytest.mark.parametrize("method", ["random", "latin_hypercube", "sobol"])
@pytest.mark.parametrize("rank", [0.6, -0.8])
def test_keys_have_the_rank_correlation(rank: float, method: str, scene: Scene) -> None:
    found = drawn(
        scene,
        n=4000,
        method=method,
        keys={
            SPEED: {"type": "uniform", "least": 200, "most": 300},
            TENSION: {"type": "lognormal", "standard_deviation": 4000.0},
            "contact.stiffness_N_per_m": {"type": "normal", "standard_deviation": 1e3},
        },
        correlations=[{"keys": [SPEED, TENSION], "rank": rank}],
    )
    x = np.array([numbers(found, key) for key in (SPEED, TENSION, "contact.stiffness_N_per_m")])
    seen = stats.spearmanr(x.T).statistic
    # Standard error of Spearman's coefficient below 1/sqrt(n): four of them.
    assert abs(seen[0, 1] - rank) < 4 / math.sqrt(4000)
    assert abs(seen[0, 2]) < 4 / math.sqrt(4000) and abs(seen[1, 2]) < 4 / math.sqrt(4000)
    # The distributions of the keys stay.
    assert stats.kstest(x[0], stats.uniform(200, 100).cdf).statistic < 1.95 / math.sqrt(4000)


def by_dropper(variants: list[Variant]) -> np.ndarray:
    """Errors of each sample, shape (n, droppers) [mm]."""
    values = (one.assignments[-1].partition("=")[2] for one in variants)
    return np.array([json.loads(text) for text in values])[:, :, 2]


@pytest.mark.parametrize("form", ["exponential", "gaussian"])
def test_a_field_has_its_correlation_length(form: str, scene: Scene) -> None:
    n, length = 2000, 25.0
    field = {
        "type": "normal",
        "standard_deviation": 10.0,
        "correlation_length_m": length,
        "correlation": form,
    }
    errors = by_dropper(drawn(scene, n=n, fields={LENGTHS: field}))
    x = line_of(scene).dropper_x
    assert errors.shape == (n, len(x))
    # Standard error of a correlation (1 - r^2)/sqrt(n), of a standard deviation s/sqrt(2 n): five.
    distance = np.abs(x[:, None] - x) / length
    wanted = np.exp(-distance if form == "exponential" else -(distance**2))
    seen = np.corrcoef(errors.T)
    assert np.abs(seen - wanted).max() < 5.5 / math.sqrt(n)
    assert np.abs(errors.std(axis=0) - 10.0).max() < 5 * 10.0 / math.sqrt(2 * n)
    # Samples are independent of each other.
    assert abs(np.corrcoef(errors[1:, 0], errors[:-1, 0])[0, 1]) < 4 / math.sqrt(n)


def test_an_independent_field_has_its_distribution_at_every_place(scene: Scene) -> None:
    field = {"type": "truncated_normal", "mean": 0.0, "standard_deviation": 10.0, "least": -5.0,
             "most": 25.0}  # fmt: skip
    errors = by_dropper(drawn(scene, n=200, fields={LENGTHS: field}))
    known = stats.truncnorm(-0.5, 2.5, 0.0, 10.0)
    # Once in 1000 samplings further off (Smirnov).
    assert stats.kstest(errors.ravel(), known.cdf).statistic < 1.95 / math.sqrt(errors.size)
    seen = np.corrcoef(errors.T) - np.eye(errors.shape[1])
    assert np.abs(seen).max() < 5.5 / math.sqrt(200)


def test_a_field_is_added_to_what_the_scene_has() -> None:
    changed = load_scene(
        CASE,
        [
            "irregularities.dropper_lengths.by_dropper=[[2, 3, 40.0]]",
            "line.stagger_m=0.2",
            "effects.lateral_motion=true",
        ],
    )
    tiny = {"type": "normal", "standard_deviation": 1e-6}
    found = drawn(changed, n=2, fields={"line.stagger_m": tiny, LENGTHS: tiny})[0]
    stagger, lengths = (
        tomllib.loads(f"v = {one.partition('=')[2]}")["v"] for one in found.assignments
    )
    by_place = {(span, dropper): error for span, dropper, error in lengths}
    assert by_place.pop((2, 3)) == pytest.approx(40.0, abs=1e-3)
    assert max(map(abs, by_place.values())) < 1e-3
    # A single stagger alternates from support to support.
    signs = [(-1) ** i for i in range(changed.line.n_spans + 1)]
    assert stagger == pytest.approx(
        [0.2 * stagger[0] / abs(stagger[0]) * s for s in signs], abs=1e-4
    )


def test_a_field_is_added_to_a_survey_from_a_file(tmp_path: Path) -> None:
    """As to the same errors written into the scene."""
    survey = tmp_path / "droppers.csv"
    survey.write_text("span,dropper,error_mm\n2,3,40\n")
    key = "irregularities.dropper_lengths.by_dropper"
    found = []
    for own in (f'{key}_file="{survey}"', f"{key}=[[2, 3, 40.0]]"):
        given = read_draft("en50318_2002").assigned([(*parse_assignment(own), "in the test")])
        field = {"type": "normal", "standard_deviation": 5.0}
        first = drawn(given.scene(), n=2, fields={LENGTHS: field})[0]
        lengths = scene_of(given, first, several=True).irregularities.dropper_lengths
        assert lengths is not None
        found.append(lengths.by_dropper)
    assert found[0] == found[1]
    assert dict(((s, d), e) for s, d, e in found[0])[2, 3] == pytest.approx(40.0, abs=25.0)


def test_entries_of_spans_from_a_file_vary(tmp_path: Path) -> None:
    """The others are the file's, and so is their number."""
    (tmp_path / "spans.csv").write_text("span_m\n" + "60\n" * 20)
    given = read_draft("en50318_2002").assigned(
        (*parse_assignment(one), "in the test")
        for one in (
            *("line.dropper.positions_m=", "line.dropper.count=7", "line.dropper.spacing_m=7"),
            *("line.span_m=", "line.n_spans=", f'line.spans_file="{tmp_path}/spans.csv"'),
        )
    )
    vary = {"type": "uniform", "least": 59.0, "most": 59.5}
    first = drawn(given.scene(), n=2, keys={"line.span_m.6": vary})[0]
    line = scene_of(given, first, several=True).line
    assert line.n_spans == 20
    assert [x == 60.0 for x in line.span_m] == [i != 6 for i in range(20)]


def test_defects_by_chance_come_as_often_as_they_should() -> None:
    scene = load_scene(CASE, ['defects=[{type="loose_clamp", span=1, dropper=1}]'])
    n, p = 400, 0.02
    found = drawn(scene, n=n, fields={"defects": {"type": "chance", "probability": p}})
    lists = [tomllib.loads(f"v = {one.assignments[0].partition('=')[2]}")["v"] for one in found]
    assert all(one[0] == {"type": "loose_clamp", "span": 1, "dropper": 1} for one in lists)
    assert all(defect["type"] == "missing_dropper" for one in lists for defect in one[1:])
    assert all((defect["span"], defect["dropper"]) != (1, 1) for one in lists for defect in one[1:])
    count, sites = sum(len(one) - 1 for one in lists), n * (len(line_of(scene).dropper_x) - 1)
    assert abs(count - p * sites) < 4 * math.sqrt(sites * p * (1 - p))


@pytest.mark.parametrize(
    ("fields", "keys"),
    [
        ({LENGTHS: {"type": "normal", "standard_deviation": 5.0}}, {}),
        ({HEIGHTS: {"type": "normal", "standard_deviation": 0.01}}, {}),
        ({HEIGHTS: {"type": "uniform", "least": -0.01, "most": 0.01, "at": "droppers"}}, {}),
        ({"irregularities.running_surface.by_place": {"type": "normal",
          "standard_deviation": 1e-4}}, {}),
        ({"line.stagger_m": {"type": "normal", "standard_deviation": 0.02}}, {}),
        ({"defects": {"type": "chance", "probability": 0.01, "defect": "loose_clamp"}}, {}),
        ({}, {"irregularities.contact_wire_height.seed": {"type": "seed"}}),
        ({}, {"pantographs.reference.masses_kg.0": {"type": "normal", "standard_deviation": 0.1}}),
    ],
)  # fmt: skip
def test_samples_are_scenes(fields: Any, keys: Any) -> None:
    overrides = ["irregularities.contact_wire_height.standard_deviation_mm=5"] if (
        "irregularities.contact_wire_height.seed" in keys
    ) else []  # fmt: skip
    overrides += ["effects.lateral_motion=true"] if "line.stagger_m" in fields else []
    scene = load_scene(CASE, overrides)
    for variant in drawn(scene, n=2, fields=fields, keys=keys):
        load_scene(CASE, [*overrides, *variant.assignments])


def test_spans_vary_where_droppers_are_placed_by_a_rule() -> None:
    overrides = ["line.dropper.positions_m=", "line.dropper.count=7", "line.dropper.spacing_m=7"]
    scene = load_scene(CASE, overrides)
    field = {"type": "uniform", "least": -1.0, "most": 1.0}
    variant = drawn(scene, n=2, fields={"line.span_m": field})[1]
    changed = load_scene(CASE, [*overrides, *variant.assignments])
    spans = np.array(changed.line.span_m)
    assert len(spans) == 22 and np.all(np.abs(spans - 60.0) <= 1.0) and np.ptp(spans) > 0.5


def test_entries_of_a_list_vary_by_their_numbers(scene: Scene) -> None:
    mass, spring = (
        "pantographs.reference.masses_kg.0",
        "pantographs.reference.stiffnesses_N_per_m.1",
    )
    key = {"type": "normal", "standard_deviation": 0.5}
    found = drawn(scene, n=8, keys={mass: key, SPEED: {**key}, spring: key})
    for one in found:
        assert set(one.assignments) == {
            f"pantographs.reference.masses_kg=[{one.varied[mass]}, 15.0]",
            f"train.speed_km_h={one.varied[SPEED]}",
            f"pantographs.reference.stiffnesses_N_per_m=[4200.0, {one.varied[spring]}]",
        }
    # The means are the list's own entries: within the half width of 8 cells of one deviation.
    assert abs(numbers(found, mass).mean() - 7.2) < 0.25
    beyond = {"pantographs.reference.masses_kg.2": {"type": "uniform", "least": 1, "most": 2}}
    with pytest.raises(InputError, match="the list has 2 entries, numbered from 0"):
        drawn(scene, n=2, keys=beyond)


@pytest.mark.parametrize("key", [SPEED, "pantographs.reference.masses_kg.0"])
def test_a_sample_out_of_bounds_is_told_with_its_file(key: str, scene: Scene) -> None:
    found = drawn(scene, n=2, keys={key: {"type": "uniform", "least": 1e6, "most": 2e6}})
    with pytest.raises(
        InputError, match=rf"^variant sample_000001: {key} is .* in {FILE}; it must"
    ):
        scene_of(read_draft(CASE), found[0], several=True)


def test_more_samples_begin_with_the_same_ones(scene: Scene) -> None:
    raw = {
        "keys": {SPEED: {"type": "normal", "standard_deviation": 5.0}},
        "fields": {LENGTHS: {"type": "normal", "standard_deviation": 5.0}},
    }
    for method in ("sobol", "random"):
        few, many = (drawn(scene, n=n, method=method, **raw) for n in (20, 300))
        assert many[:20] == few
        assert drawn(scene, n=20, method=method, seed=2, **raw) != few


def test_saltellis_blocks_change_one_input_at_a_time(scene: Scene) -> None:
    found = drawn(
        scene,
        n=4,
        method="saltelli",
        keys={
            SPEED: {"type": "normal", "standard_deviation": 5.0},
            TENSION: {"type": "normal", "standard_deviation": 50.0},
        },
        fields={LENGTHS: {"type": "normal", "standard_deviation": 5.0}},
    )
    assert len(found) == 4 * (3 + 2)
    for i in range(0, len(found), 5):
        first, *mixed, last = (one.assignments for one in found[i : i + 5])
        for place, one in enumerate(mixed):
            assert one == (*first[:place], last[place], *first[place + 1 :])


@pytest.mark.study
def test_thirty_thousand_samples_take_seconds(scene: Scene) -> None:
    begin = time.process_time()
    found = drawn(
        scene,
        n=30_000,
        keys={SPEED: {"type": "normal", "standard_deviation": 5.0}},
        fields={LENGTHS: {"type": "normal", "standard_deviation": 5.0,
                          "correlation_length_m": 20.0}},
    )  # fmt: skip
    assert len(found) == 30_000 and found[-1].name == sample_name(30_000)
    # Three seconds on one core of 2026; a text made number by number would take a minute.
    assert time.process_time() - begin < 20.0


GOOD = {SPEED: {"type": "normal", "standard_deviation": 5.0}}
WRONG: list[tuple[dict[str, Any], str]] = [
    ({"keys": GOOD}, r"n \(number of samples.*\) is missing in uncertain.toml"),
    ({"n": 1, "keys": GOOD}, "n is 1 in uncertain.toml; it must be at least 2"),
    ({"n": 200_000, "keys": GOOD}, "it must be at most 100000"),
    ({"n": 4}, "^uncertain.toml needs keys or fields"),
    ({"n": 4, "keys": GOOD, "sede": 3}, "sede in uncertain.toml is unknown; did you mean seed"),
    ({"n": 4, "keys": GOOD, "method": "halton"}, "must be sobol, latin_hypercube"),
    (
        {"n": 4, "keys": {"train.sped_km_h": GOOD[SPEED]}},
        "train.sped_km_h in uncertain.toml is unknown; did you mean train.speed_km_h",
    ),
    ({"n": 4, "keys": {SPEED: {"mean": 3.0}}}, "keys.train.speed_km_h.* must have a type"),
    ({"n": 4, "keys": {SPEED: {"type": "gaussian"}}}, "must be of type normal, lognormal"),
    (
        {"n": 4, "keys": {SPEED: {"type": "normal", "standard_deviation": -1.0}}},
        "keys.train.speed_km_h.standard_deviation is -1.0 .*must be greater than 0",
    ),
    (
        {"n": 4, "keys": {SPEED: {"type": "uniform", "least": 3.0, "most": 2.0}}},
        "must have most greater than least",
    ),
    (
        {"n": 4, "keys": {"petsc.ksp_type": {"type": "choices", "values": ["cg"]}}},
        "PETSc takes its options once",
    ),
    (
        {"n": 4, "keys": {SPEED: {"type": "choices", "values": [1, 2], "weights": [1]}}},
        "must give one of weights per value",
    ),
    ({"n": 5, "method": "saltelli", "keys": GOOD}, "such as 4 or 8, but n is 5"),
    ({"n": 4, "second_order": True, "keys": GOOD}, "takes second_order with"),
    (
        {"n": 65536, "method": "saltelli", "keys": GOOD},
        "at most 100000 samples, but n and 1 inputs make 196608",
    ),
    (
        {"n": 4, "keys": GOOD, "correlations": [{"keys": [SPEED, TENSION], "rank": 0.5}]},
        f"has not {TENSION}",
    ),
    (
        {"n": 4, "keys": GOOD, "correlations": [{"keys": [SPEED, SPEED], "rank": 0.5}]},
        "must have one correlation of two keys",
    ),
    ({"n": 4, "keys": GOOD, "fields": {SPEED: GOOD[SPEED]}}, "is in keys and in fields"),
]


@pytest.mark.parametrize(("raw", "sentence"), WRONG)
def test_a_wrong_file_is_one_sentence(raw: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence) as error:
        sampling_of(raw, FILE)
    assert "\n" not in str(error.value)


FIELD = {"type": "normal", "standard_deviation": 5.0}
UNFIT: list[tuple[dict[str, Any], str]] = [
    (
        {"keys": {SPEED: {"type": "lognormal", "mean": 1e-3, "standard_deviation": 1.0}}},
        "must have a standard_deviation of at most 100 times the mean",
    ),
    (
        {"keys": {SPEED: {"type": "truncated_normal", "mean": 1e9, "standard_deviation": 1e-9,
                          "least": 0.0, "most": 1.0}}},
        "must have bounds within 8 standard deviations of the mean",
    ),
    ({"fields": {"line.contact_height_m": FIELD}}, "takes no field; there are irregularities"),
    (
        {"fields": {LENGTHS: FIELD}, "keys": {"line.n_spans": {"type": "choices", "values": [9]}}},
        "cannot stand beside line.n_spans",
    ),
    (
        {
            "keys": {
                MASSES: {"type": "choices", "values": [[7, 15], [8, 15]]},
                f"{MASSES}.1": {**FIELD, "mean": 15.0},
            }
        },
        "masses_kg.1 in uncertain.toml sets the value of pantographs.reference.masses_kg again",
    ),
    (
        {"keys": {"line.stagger_m.0": FIELD}, "fields": {"line.stagger_m": FIELD}},
        "line.stagger_m in uncertain.toml sets the value of line.stagger_m.0 again",
    ),
    ({"fields": {"defects": FIELD}}, 'cannot be of type normal; "chance" is for defects'),
    ({"fields": {LENGTHS: {**FIELD, "at": "supports"}}}, "for courses along the line"),
    (
        {"keys": {"line.encumbrance_m": {"type": "lognormal", "mean": 1.2,
                                         "standard_deviation": 0.1},
                  "train.end_m": {"type": "seed"},
                  "line.fittings.0.mass_kg": FIELD}},
        "needs a mean: the scene has no number of its own there",
    ),
    (
        {
            "keys": {
                key: {"type": "normal", "standard_deviation": 1.0}
                for key in (SPEED, TENSION, "contact.stiffness_N_per_m")
            },
            "correlations": [
                {"keys": [SPEED, TENSION], "rank": 0.9},
                {"keys": [TENSION, "contact.stiffness_N_per_m"], "rank": 0.9},
                {"keys": [SPEED, "contact.stiffness_N_per_m"], "rank": -0.9},
            ],
        },
        "the correlations of the sampling contradict each other",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("raw", "sentence"), UNFIT)
def test_what_a_scene_cannot_sample_is_one_sentence(
    raw: dict[str, Any], sentence: str, scene: Scene
) -> None:
    with pytest.raises(InputError, match=sentence) as error:
        drawn(scene, n=4, **raw)
    assert "\n" not in str(error.value)


def test_keys_are_nested_or_dotted(tmp_path: Path) -> None:
    nested, dotted = tmp_path / "a.toml", tmp_path / "b.toml"
    nested.write_text('n = 4\n[keys.train.speed_km_h]\ntype = "normal"\nstandard_deviation = 5.0\n')
    dotted.write_text(
        'n = 4\n[keys."train.speed_km_h"]\ntype = "normal"\nstandard_deviation = 5.0\n'
    )
    assert read_sampling(nested) == read_sampling(dotted)
    with pytest.raises(InputError, match="cannot be read"):
        read_sampling(tmp_path / "nowhere.toml")


def test_fields_that_are_switched_off_are_refused() -> None:
    off = load_scene(CASE, ["effects.dropper_lengths=false"])
    field = {LENGTHS: FIELD}
    says = f"{LENGTHS} in uncertain.toml would change nothing: effects.dropper_lengths"
    with pytest.raises(InputError, match=says):
        drawn(off, n=4, fields=field)
    effect = {"effects.dropper_lengths": {"type": "choices", "values": [True, False]}}
    assert len(drawn(off, n=4, keys=effect, fields=field)) == 4
