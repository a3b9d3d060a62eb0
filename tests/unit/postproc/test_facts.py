"""Facts of a run: derived once in SI units, stored with the run, read without its scene."""

from __future__ import annotations

import ast
import math
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scenes import Scene

from catenary import InputError
from catenary.cases.scene.keys.keys import known_keys
from catenary.cases.scene.keys.units import unit_of
from catenary.mbs.head.strips import Strips, Suspension
from catenary.mbs.lumped import LumpedData
from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.postproc.evaluate.error_indicators import as_table, indicate
from catenary.postproc.evaluate.statistics import evaluate
from catenary.postproc.files.facts import FACTS, WIRE, facts_of
from catenary.postproc.files.hdf5 import seal_arrays
from catenary.postproc.read.results import Results
from catenary.solver.problem.contact_laws import HertzLaw, KinematicLaw
from catenary.solver.problem.problem import Damping, Placement, Problem
from catenary.solver.time_loop.views.channels import PANTOGRAPH, RUN

ROOT = Path(__file__).parents[3]
# Keys of tables that the head of a result file has itself: when an incident happens, and where;
# where the arrivals of reflections at a pantograph begin to count.
OWN_KEYS = {"time_s", "at_m", "start_m"}


@pytest.fixture
def problem(make_problem: Any, march: Any) -> Problem:
    found: Problem = make_problem(march.line, 2, dt=1e-3)
    return found


@pytest.fixture
def derived(march: Any) -> Any:
    lengths = np.full(march.mesh.droppers.shape[0], 0.8)
    lengths[7] = 0.5
    return lambda problem: facts_of(problem, march.mesh, lengths)


def test_every_fact_has_a_unit_a_meaning_and_a_value_within_its_bounds(
    problem: Problem, derived: Any
) -> None:
    facts = derived(problem)
    assert list(facts) == list(FACTS)
    for name, fact in FACTS.items():
        assert fact.unit and fact.meaning
        values = facts[name]
        assert values.shape == {RUN: (), PANTOGRAPH: (2,), WIRE: (1,)}[fact.per]
        known = ~np.isnan(values)
        assert known.all() or fact.may_be_nan
        assert ((values >= fact.low) & (values <= fact.high))[known].all()


def test_facts_are_stored_with_unit_and_meaning_and_read_again(
    run_folder: Path, problem: Problem, march: Any
) -> None:
    with h5py.File(run_folder / "run.h5", locking=False) as file, Results(run_folder) as results:
        assert set(file["facts"]) == set(FACTS)
        for name, fact in FACTS.items():
            assert file[f"facts/{name}"].attrs["unit"].decode() == fact.unit
            assert file[f"facts/{name}"].attrs["meaning"].decode() == fact.meaning
            stored = file[f"facts/{name}"][()]
            if fact.per == WIRE:
                assert list(results.facts_of_wires(name)) == [CONTACT_WIRE]
                np.testing.assert_equal(results.facts_of_wires(name)[CONTACT_WIRE], stored.item())
            else:
                np.testing.assert_array_equal(results.facts_of(name), stored)
        assert results.dt == results.fact("time_step") == march.dt
        assert results.fact("speed") == problem.train.speed


def test_hertz_s_spring_counts_with_its_tangent(problem: Problem, derived: Any) -> None:
    """Of K d^1.5 with the secant 5e4 N/m at 150 N: 1.5 times the secant; at F, F^(1/3) as much."""
    law = HertzLaw(150.0 / (150.0 / 5e4) ** 1.5, 1.5, 0.0, 0.01)
    first, second = problem.train.placements
    train = replace(problem.train, placements=(first, replace(second, static_force=1200.0)))
    found = derived(replace(problem, contact=law, train=train))["contact_stiffness"]
    np.testing.assert_allclose(found, [7.5e4, 1.5e5], rtol=1e-12)


def test_a_kinematic_contact_has_an_infinite_stiffness(problem: Problem, derived: Any) -> None:
    found = derived(replace(problem, contact=KinematicLaw()))
    assert np.isinf(found["contact_stiffness"]).all()


def test_droppers_with_an_axial_stiffness_count_with_the_shortest(
    problem: Problem, derived: Any
) -> None:
    """EA / l = 1e5 N / 0.5 m."""
    (group,) = problem.line.droppers
    kind = replace(group.kind, stiffness=None, axial_stiffness=1e5)
    line = replace(problem.line, droppers=(replace(group, kind=kind),))
    assert derived(replace(problem, line=line))["stiffest_dropper"] == 2e5
    assert derived(problem)["stiffest_dropper"] == 1e5


def test_damping_of_a_component_goes_before_that_of_the_line(
    problem: Problem, derived: Any
) -> None:
    damping = Damping(1e-4, 0.0125, {"droppers": (3e-3, 0.0)})
    found = derived(replace(problem, damping=damping))
    assert found["dropper_stiffness_damping"] == 3e-3
    assert found["contact_wire_stiffness_damping"] == 1e-4
    assert found["contact_wire_mass_damping"] == 0.0125


def test_the_most_worn_place_of_the_evaluation_stretch_is_a_fact(
    problem: Problem, derived: Any
) -> None:
    low, high = problem.evaluation
    worn = (
        (low - 50.0, low - 1.0, 0.3),
        (low + 5.0, low + 9.0, 0.1),
        (high - 2.0, high + 9.0, 0.2),
    )
    wires = tuple(
        replace(wire, worn=worn) if wire.name == CONTACT_WIRE else wire
        for wire in problem.line.wires
    )
    line = replace(problem.line, wires=wires)
    assert derived(problem)["contact_wire_lost_section"] == 0.0
    assert derived(replace(problem, line=line))["contact_wire_lost_section"] == 0.2


def test_what_is_not_simulated_is_no_fact(problem: Problem, derived: Any) -> None:
    """Neither damping nor the stiffness of slack droppers that the scene leaves out."""
    assert derived(problem)["slack_stiffness_share"] == 0.0
    keeping = problem.effects | {"residual_dropper_stiffness"}
    kept = replace(problem, effects=keeping, residual_stiffness_ratio=0.01)
    assert derived(kept)["slack_stiffness_share"] == 0.01
    found = derived(replace(problem, effects=frozenset()))
    assert found["slack_stiffness_share"] == 1.0
    damping = "contact_wire_stiffness_damping", "contact_wire_mass_damping"
    for name in (*damping, "dropper_stiffness_damping"):
        assert derived(problem)[name] > found[name] == 0.0


def test_the_shortest_step_is_a_power_of_two_of_the_record_s(
    problem: Problem, derived: Any
) -> None:
    adapted = replace(problem.numerics, adaptive_tolerance=0.5, smallest_dt=1.2e-4)
    found = derived(replace(problem, numerics=adapted))
    assert found["shortest_step"] == 1.25e-4 and found["step_tolerance"] == 0.5
    fixed = derived(problem)
    assert fixed["shortest_step"] == 1e-3 and math.isnan(fixed["step_tolerance"])


def test_weights_are_those_of_the_integrator(problem: Problem, derived: Any) -> None:
    """HHT with a spectral radius of 1/2: a_f = 1/3, beta = 4/9, gamma = 5/6."""
    found = derived(
        replace(problem, numerics=replace(problem.numerics, integrator="hht", spectral_radius=0.5))
    )
    weights = [found[n] for n in ("newmark_beta", "newmark_gamma", "mass_weight", "force_weight")]
    np.testing.assert_allclose(weights, [4 / 9, 5 / 6, 0.0, 1 / 3], rtol=1e-12)


def test_a_strip_on_a_suspension_is_what_a_contact_meets_first(
    problem: Problem, derived: Any
) -> None:
    chain = (7.2, 15.0), (4.2e3, 50.0), (10.0, 90.0)
    stiff, soft = Strips(2, 0.4), Strips(2, 0.4, suspension=Suspension(1.1, 1e4, 0.0))
    places = tuple(Placement(LumpedData(*chain, own), 150.0, 0.0) for own in (stiff, soft))
    found = derived(replace(problem, train=replace(problem.train, placements=places)))
    np.testing.assert_allclose(found["touching_mass"], [3.6, 1.1])
    assert np.isnan(found["actuator_force"]).all()


def test_a_file_of_an_earlier_format_is_refused(run_folder: Path, tmp_path: Path) -> None:
    path = Path(shutil.copy(run_folder / "run.h5", tmp_path))
    with h5py.File(path, "r+") as file:
        file.attrs["format"] = "catenary-run-2"
    with pytest.raises(InputError, match="no result file of this version .* 'catenary-run-2'"):
        Results(path)


def test_droppers_of_a_file_without_their_share_slacken_by_its_effects(
    run_folder: Path, tmp_path: Path
) -> None:
    path = Path(shutil.copy(run_folder / "run.h5", tmp_path))
    with h5py.File(path, "r+") as file:
        del file["facts/slack_stiffness_share"]
        seal_arrays(file["facts"], {own: values[()] for own, values in file["facts"].items()})
    with Results(path) as results, Results(run_folder) as before:
        slackened = evaluate(before).droppers.n_slackened
        assert evaluate(results).droppers.n_slackened == slackened > 0


@pytest.mark.parametrize("name", ["stiffest_dropper", "mass_weight"])
def test_a_file_from_before_a_fact_was_declared_is_read_without_it(
    name: str, run_folder: Path, tmp_path: Path
) -> None:
    """Its checksum covers what was there. Only what needs the fact is missing."""
    path = Path(shutil.copy(run_folder / "run.h5", tmp_path))
    with h5py.File(path, "r+") as file:
        del file["facts"][name]
        seal_arrays(file["facts"], {own: values[()] for own, values in file["facts"].items()})
    with Results(path) as results, Results(run_folder) as before:
        assert results.damage == [] and np.isnan(results.fact(name))
        found, known = indicate(results), indicate(before)
        if name == "stiffest_dropper":
            assert as_table(found)["warnings"] == as_table(known)["warnings"]
            assert found.resolved_frequency == known.resolved_frequency
        else:
            assert np.isnan(found.resolved_frequency) and "run the case again" in found.warnings[0]


def test_a_flipped_fact_is_told(run_folder: Path, tmp_path: Path) -> None:
    path = Path(shutil.copy(run_folder / "run.h5", tmp_path))
    with h5py.File(path, "r+") as file:
        file["facts/speed"][()] = 80.0
    with pytest.raises(InputError, match="its facts differ from their checksum"):
        Results(path)


def lookups(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Every literal key with which something is read: ``a["key"]``, ``a.get("key")``."""
    for node in ast.walk(tree):
        key: ast.AST | None = None
        if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Load):
            key = node.slice
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            key = node.args[0] if node.func.attr in ("get", "pop") and node.args else None
        if isinstance(key, ast.Constant) and isinstance(key.value, str):
            yield key.value, node.lineno


def scene_keys() -> set[str]:
    """Last parts of all keys of a scene whose name ends in a unit."""
    names = {key.rsplit(".", 1)[-1] for key in known_keys(Scene)}
    return {name for name in names if unit_of(name)} - OWN_KEYS


def reads_scene(source: str, shows: bool) -> list[tuple[str, int]]:
    """Where a source reads a key of a scene; ``shows`` if it may take the scene as a whole."""
    forbidden = scene_keys() | (set() if shows else {"config"})
    return [found for found in lookups(ast.parse(source)) if found[0] in forbidden]


def test_the_check_finds_what_it_is_for() -> None:
    source = 'c = about["config"]\nx = c["line"].get("tension_N") + c["dt_s"]\nsum["dt_s"] = 1\n'
    assert sorted(reads_scene(source, False)) == [("config", 1), ("dt_s", 2), ("tension_N", 2)]


@pytest.mark.parametrize(
    "path",
    sorted((ROOT / "postproc").rglob("*.py")),
    ids=lambda path: str(path.relative_to(ROOT)),
)
def test_postproc_reads_no_keys_of_scenes(path: Path) -> None:
    """The report prints the scene as a whole; nothing else of postproc may open it."""
    assert reads_scene(path.read_text(encoding="utf-8"), path.match("sections/run_facts.py")) == []
