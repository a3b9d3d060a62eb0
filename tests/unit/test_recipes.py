"""Recipes for other package managers, against the project's own declarations."""

from __future__ import annotations

import ast
import re
import tomllib
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]
RECIPES = ROOT / "docs" / "packaging"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
# Names of the package index that conda-forge and Spack spell in another way.
OF_CONDA = {"matplotlib": "matplotlib-base", "gmsh": "python-gmsh"}
OF_SPACK = {"gmsh": "gmsh"}


def wanted() -> dict[str, str]:
    """Bounds of the versions of each package that the project needs."""
    pairs = (re.fullmatch(r"([\w-]+)(.*)", one) for one in PROJECT["dependencies"])
    return {pair[1]: pair[2] for pair in pairs if pair}


def test_the_recipe_of_conda_has_the_same_dependencies() -> None:
    recipe = yaml.safe_load((RECIPES / "recipe.yaml").read_text(encoding="utf-8"))
    needs = dict(one.split(" ", 1) for one in recipe["requirements"]["run"])
    assert needs.pop("python") == PROJECT["requires-python"]
    assert needs == {OF_CONDA.get(name, name): bounds for name, bounds in wanted().items()}


def test_the_package_of_spack_has_the_same_dependencies() -> None:
    tree = ast.parse((RECIPES / "package.py").read_text(encoding="utf-8"))
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    specs = [
        str(ast.literal_eval(call.args[0])).split(" ")[0]
        for call in calls
        if ast.unparse(call.func) == "depends_on"
    ]
    needs = {name: bounds for name, _, bounds in (spec.partition("@") for spec in specs)}
    for name, bounds in wanted().items():
        found = needs[OF_SPACK.get(name, f"py-{name}")]
        least, below = re.fullmatch(r">=([\d.]+),<([\d.]+)", bounds).groups()
        first, _, last = found.partition(":")
        assert first == least, name
        # The last version in a range of Spack stands for all that begin with it.
        *upper, end = (int(part) for part in below.split("."))
        assert last == ".".join(map(str, (*upper, end - 1))), name


def test_all_name_one_version() -> None:
    version = PROJECT["version"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    recipe = yaml.safe_load((RECIPES / "recipe.yaml").read_text(encoding="utf-8"))
    module = (RECIPES / "catenary.lua").read_text(encoding="utf-8")
    assert citation["version"] == recipe["context"]["version"] == version
    assert set(re.findall(r"\d+\.\d+\.\d+", module)) == {version}
