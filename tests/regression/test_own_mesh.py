"""A user's own mesh gives the forces of the mesh it equals; one that lacks a group is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from program import assert_sound, catenary, short_run

from catenary.postproc.read.results import Results

# The key that makes a mesh, which a scene with a mesh of its own must not have.
GIVEN = "mesh.elements_per_gap="
# What another program may round coordinates to [m].
ROUNDING = 1e-9
# Places of nodes that Gmsh writes are off by up to this; wires divided without it are not [m].
GMSH = 2e-9


@pytest.fixture(scope="module")
def line(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The mesh of the short scene's line."""
    folder = tmp_path_factory.mktemp("mesh")
    out = folder / "line.msh"
    words = ["mesh", "en50318_2002", "-o", str(out), "--set", "line.n_spans=10"]
    done = catenary(*words, cwd=folder)
    assert done.code == 0, done.stderr
    return out


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results on the mesh that the scene makes."""
    folder = tmp_path_factory.mktemp("made")
    done = catenary(*short_run(folder / "out"), cwd=folder)
    assert done.code == 0, done.stderr
    return folder / "out"


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


def largest_differences(out: Path, reference: Path) -> dict[str, float]:
    """Largest relative difference of each history."""
    assert assert_sound(out / "run.h5") == assert_sound(reference / "run.h5")
    found = {}
    with Results(out) as results, Results(reference) as expected:
        for name in ("contact_force", "arm_uplift", "dropper_force"):
            values = expected.channel(name)
            found[name] = np.abs(results.channel(name) - values).max() / np.abs(values).max()
    return found


def test_a_mesh_given_back_gives_the_same_forces(line: Path, made: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = catenary(*short_run(out, f"mesh.file={line}", GIVEN), cwd=tmp_path)
    assert done.code == 0, done.stderr
    differences = largest_differences(out, made)
    # Gmsh writes places that are off by 1.1e-9 m (``GMSH``), and elements are 0.6 m long: their
    # matrices differ by 6e-10 of the largest number, and forces by a part of that.
    print(f"{differences}, allowed 2e-10")
    assert max(differences.values()) < 2e-10


def test_a_mesh_of_another_program_gives_nearly_the_same_forces(
    line: Path, made: Path, tmp_path: Path
) -> None:
    file, out = tmp_path / "other.msh", tmp_path / "out"
    file.write_text(from_another_program(line.read_text()))
    done = catenary(*short_run(out, f"mesh.file={file}", GIVEN), cwd=tmp_path)
    assert done.code == 0, done.stderr
    with Results(out) as results, Results(made) as expected:
        x, reference = results.line("node_points")[:, 0], expected.line("node_points")[:, 0]
        moved = np.abs(np.sort(x) - np.sort(reference)).max()
    assert 0.5 * ROUNDING < moved <= 1.1 * ROUNDING + GMSH
    differences = largest_differences(out, made)
    # The shortest element, 0.625 m, is wrong by two roundings, its bending stiffness (1 / length^3)
    # by 6 / 0.625 times each: 3e-8. Forces and uplifts answer in proportion, by no more than about
    # ten times as much.
    allowed = 10 * 6 / 0.625 * (ROUNDING + GMSH)
    print(f"{differences}, allowed {allowed:.0e}")
    assert max(differences.values()) < allowed


@pytest.mark.parametrize("group", ["contact_wire", "supports"])
def test_a_mesh_that_lacks_a_group_is_refused(group: str, line: Path, tmp_path: Path) -> None:
    file, out = tmp_path / "poor.msh", tmp_path / "out"
    file.write_text(line.read_text().replace(f'"{group}"', '"something_else"'))
    done = catenary(*short_run(out, f"mesh.file={file}", GIVEN), cwd=tmp_path)
    assert done.code == 2
    (sentence,) = done.sentences
    assert group in sentence and str(file) in sentence
    assert list(tmp_path.iterdir()) == [file]
