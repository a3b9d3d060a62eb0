"""A user's own mesh gives the forces of the mesh it equals; one that lacks a group is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from program import SHORT_SCENE
from scenes import with_words
from verb_runner import invoke

import catenary

# What another program may round coordinates to [m].
ROUNDING = 1e-9
# Places of nodes that Gmsh writes are off by up to this; wires divided without it are not [m].
GMSH = 2e-9
SCENE = with_words("en50318_2002", (*SHORT_SCENE, "output.field_every_s=0"))


@pytest.fixture(scope="module")
def line(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The mesh of the short scene's line."""
    out = tmp_path_factory.mktemp("mesh") / "line.msh"
    words = ["mesh", "en50318_2002", "-o", str(out), "--set", "line.n_spans=10"]
    done = invoke(*words)
    assert done.exit_code == 0, done.output
    return out


def on(mesh: Path) -> catenary.Scene:
    """The scene on a mesh in place of the one that it makes."""
    return SCENE.replace(mesh={"file": mesh, "elements_per_gap": None})


@pytest.fixture(scope="module")
def made() -> catenary.Run:
    """Results on the mesh that the scene makes."""
    return catenary.run(SCENE)


def from_another_program(text: str) -> str:
    """The same mesh with its nodes numbered backwards and moved by up to ``ROUNDING`` along x."""
    head, nodes = text.split("$Nodes\n")
    nodes, middle = nodes.split("$EndNodes\n")
    between, elements = middle.split("$Elements\n")
    count, *rows = nodes.splitlines()
    n = int(count)
    moved = []
    for row in reversed(rows):
        number, x, y, z = row.split()
        moved.append(
            f"{n + 1 - int(number)} {float(x) + ROUNDING * np.sin(int(number)):.17g} {y} {z}"
        )
    lines = []
    for row in elements.splitlines():
        words = row.split()
        if len(words) > 3:  # number, type, number of tags, tags, nodes
            first = 3 + int(words[2])
            words[first:] = [str(n + 1 - int(node)) for node in words[first:]]
        lines.append(" ".join(words))
    parts = [head, "$Nodes\n", "\n".join([count, *moved]), "\n$EndNodes\n", between]
    return "".join([*parts, "$Elements\n", "\n".join(lines), "\n"])


def largest_differences(found: catenary.Run, expected: catenary.Run) -> dict[str, float]:
    """Largest relative difference of each history."""
    differences = {}
    for name in ("contact_force", "arm_uplift", "dropper_force"):
        ours, theirs = (run.channel(name).values for run in (found, expected))
        differences[name] = float(np.abs(ours - theirs).max() / np.abs(theirs).max())
    return differences


def test_a_mesh_given_back_gives_the_same_forces(line: Path, made: catenary.Run) -> None:
    differences = largest_differences(catenary.run(on(line)), made)
    # Gmsh writes places that are off by 1.1e-9 m (``GMSH``), and elements are 0.6 m long: their
    # matrices differ by 6e-10 of the largest number, and forces by a part of that.
    print(f"{differences}, allowed 2e-10")
    assert max(differences.values()) < 2e-10


def test_a_mesh_of_another_program_gives_nearly_the_same_forces(
    line: Path, made: catenary.Run, tmp_path: Path
) -> None:
    file = tmp_path / "other.msh"
    file.write_text(from_another_program(line.read_text()))
    x, reference = (
        catenary.static(scene).contact_wires.x_m.to_numpy() for scene in (on(file), SCENE)
    )
    moved = np.abs(np.sort(x) - np.sort(reference)).max()
    assert 0.5 * ROUNDING < moved <= 1.1 * ROUNDING + GMSH
    differences = largest_differences(catenary.run(on(file)), made)
    # The shortest element, 0.625 m, is wrong by two roundings, its bending stiffness (1 / length^3)
    # by 6 / 0.625 times each: 3e-8. Forces and uplifts answer in proportion, by no more than about
    # ten times as much.
    allowed = 10 * 6 / 0.625 * (ROUNDING + GMSH)
    print(f"{differences}, allowed {allowed:.0e}")
    assert max(differences.values()) < allowed


@pytest.mark.parametrize("group", ["contact_wire", "supports"])
def test_a_mesh_that_lacks_a_group_is_refused(group: str, line: Path, tmp_path: Path) -> None:
    file = tmp_path / "poor.msh"
    file.write_text(line.read_text().replace(f'"{group}"', '"something_else"'))
    with pytest.raises(catenary.InputError) as caught:
        catenary.run(on(file), tmp_path / "out")
    assert group in str(caught.value) and str(file) in str(caught.value)
    assert list(tmp_path.iterdir()) == [file]
