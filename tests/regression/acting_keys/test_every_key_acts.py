"""Every key of a scene acts: another value of it changes what is computed, somewhere.

`acting.toml` has small scenes, each with changes of single keys. A key that is read and changes
nothing is a defect; one that acts nowhere in the table has its own test, listed in ``ELSEWHERE``.
"""

from __future__ import annotations

import re

import numpy as np
import pytest
from acting_scenes import SCENES, acting_scene
from mpi4py import MPI
from scenes import Scene

from catenary.cases.scene.keys.keys import known_keys
from catenary.cases.studies.hard import runs

# What other tests look at, by why it is not here.
ELSEWHERE = re.compile(
    "|".join(
        (
            # Patterns by numbers of spans: test_planners_tables.
            r".*\.patterns\.\*\.spans$",
            # Words, files, what is written of a run: test_cases, test_own_mesh, test_petsc_options.
            r"case\b|test\b|petsc\b|output\b|evaluation\b|mesh\.file|.*_file$|.*\.name$",
            # What each effect adds: test_effects_counting.
            r"effects\b",
            # Mechanisms as data, and which of their bodies move: test_scene_pantographs,
            # test_scene_motion.
            r"pantographs\.\*\.(corrections|bodies|joints|forces|head|arm|actuator|calibrate)\b",
            r"pantographs\.\*\.(assembly_tolerance_m|constraint_handling|substeps|as_published)",
            # Kinds, and numbers that come with further keys: no change of one key alone.
            r".*\.(type|kind)$|wind\.profile|wind\.gusts\.spectrum|pantographs\.\*\.strips\.number",
            r".*\.patterns\.\*\.span_m|incidents\.\*\.pantograph",
            r"line\.links\.\*\.(residual_stiffness_ratio|slack_damping|lower)",
            # Tables of one kind, of which another one is changed here.
            r"line\.(stitch_wire|bridle)\.(section_mm2|youngs_modulus_GPa)",
            r"line\.auxiliary_wire\.(axial_stiffness_N|dropper\.(count|spacing_m|patterns|curve))",
            r"line\.links\.\*\.(count|spacing_m|curve)",
            # A stop that an end meets on its way: test_axial_motion.
            r"line\.tensioner\.stop_stiffness_N_per_m",
        )
    )
)


def answers(scene: Scene) -> list[np.ndarray]:
    """The line at rest and the histories of a run."""
    rest = runs.at_rest(scene, MPI.COMM_SELF)
    run = runs.run(rest, MPI.COMM_SELF)
    shape = [rest.model.dropper_lengths, rest.form.height, rest.form.dropper_force]
    outcome = np.frombuffer(run.outcome.encode(), dtype=np.uint8)
    moved = [run.force, run.height, run.wire, run.energy, run.on_wires, run.position]
    return [*shape, *moved, outcome]


@pytest.mark.study
@pytest.mark.parametrize("name", SCENES)
def test_another_value_changes_what_is_computed(name: str) -> None:
    table = SCENES[name]
    before = answers(acting_scene(name))
    idle = []
    for change in table["change"]:
        after = answers(acting_scene(name, [change]))
        if all(map(np.array_equal, before, after)):
            idle.append(change)
    assert not idle


def test_every_key_is_changed_or_left_to_a_test_of_its_own() -> None:
    changed = {change.partition("=")[0] for table in SCENES.values() for change in table["change"]}
    missing = [
        key
        for key in known_keys(Scene)
        if not ELSEWHERE.match(key) and not any(is_in(key, one) for one in changed)
    ]
    assert not missing, ", ".join(missing)


def is_in(key: str, changed: str) -> bool:
    """Whether a key is that one, or a table with it."""
    pattern = re.escape(key).replace(r"\*", r"[^.]+")
    return re.fullmatch(rf"{pattern}(\..*)?", changed) is not None
