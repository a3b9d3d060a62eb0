"""The arrows between the layers, read from the imports of the code itself."""

from __future__ import annotations

import ast
import functools
import graphlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

import pytest

import catenary

ROOT = Path(__file__).parents[2]
PARTS = ("meshgen", "mbs", "solver", "postproc", "cases")

# meshgen, mbs <- solver <- postproc <- cases
MAY_IMPORT = {
    "base": {"base"},
    "meshgen": {"base", "meshgen"},
    "mbs": {"base", "mbs"},
    "solver": {"base", "meshgen", "mbs", "solver"},
    "postproc": {"base", "meshgen", "mbs", "solver", "postproc"},
    "cases": {"base", *PARTS},
}
# The package itself, installed as ``catenary``, stands above all: only the command line imports it.
FACE, PROGRAM = "api", "cli"
# What every part imports; it stands in solver/base and imports only itself.
BASE = "base"
# Compiled kernels, and what goes with them, are no part of the order.
LEAVES = {"catenary.solver.kernels"}


def table_below(title: str) -> list[tuple[str, str]]:
    """Rows of the table of folders and files below a title of the architecture page."""
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    section = page.split(f"\n### {title}", 1)[1].split("\n#", 1)[0]
    rows = [line.strip("| ").split(" | ", 1) for line in section.splitlines() if "| `" in line]
    return [(name.strip("`"), text) for name, text in rows]


def rooms_of(part: str) -> tuple[str, ...]:
    """The rooms of a part from below to above, as the architecture page lists them upwards.

    A file beside sub-packages is a room of its own. Cases with a ``study.py`` stand below ``cli``.
    """
    rows = reversed(table_below(f"{part}: "))
    rooms = [name.rstrip("/").removesuffix(".py").replace("/", ".") for name, _ in rows]
    if part == "cases":
        at = rooms.index("cli")
        rooms[at:at] = sorted(path.parent.name for path in (ROOT / part).glob("*/study.py"))
    return tuple(rooms)


# Each room imports only itself and those before it.
ROOMS = {part: rooms_of(part) for part in PARTS}
FILES = sorted(path for part in PARTS for path in (ROOT / part).rglob("*.py"))
FACE_FILES = {path.stem for path in (ROOT / "cases" / FACE).glob("*.py")} - {"__init__"}


def imports_in(tree: ast.AST) -> Iterator[str]:
    """Every module that is imported anywhere in a file, ``from a import b`` as ``a.b``."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            # relative imports would hide an arrow; none is allowed
            assert node.level == 0, f"relative import in line {node.lineno}"
            yield from (f"{node.module}.{name.name}" for name in node.names)


def is_within(module: str, package: str) -> bool:
    return module == package or module.startswith(package + ".")


def broken_arrows(part: str, modules: list[str], room: str = "") -> list[str]:
    """Imports that a file of ``part``, in a ``room`` of cases, must not make."""
    wrong = []
    for module in modules:
        top, *rest = module.split(".")
        if room == PROGRAM and module == "catenary":
            continue
        if room in (FACE, PROGRAM) and top == "catenary" and rest and rest[0] in FACE_FILES:
            continue
        if top in PARTS or (top == "catenary" and not rest):
            wrong.append(f"{module} (import catenary.<part>.<module>)")
        elif top == "catenary" and rest[0] not in MAY_IMPORT[part]:
            if not any(is_within(module, leaf) for leaf in LEAVES):
                wrong.append(module)
    return wrong


@functools.cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


@functools.cache
def imports_of(path: Path) -> list[str]:
    return list(imports_in(tree_of(path)))


def test_the_checks_find_what_they_are_for() -> None:
    tree = ast.parse(
        "import catenary.solver.time_loop.march\n"
        "def late():\n    from catenary.base.errors import InputError\n    import solver\n"
    )
    found = list(imports_in(tree))
    assert broken_arrows("meshgen", found) == [
        "catenary.solver.time_loop.march",
        "solver (import catenary.<part>.<module>)",
    ]
    assert broken_arrows(
        "solver", ["catenary.postproc.record.recorder", "catenary.mbs.lumped"]
    ) == ["catenary.postproc.record.recorder"]
    assert broken_arrows("cases", ["catenary.scenes.load"]) == ["catenary.scenes.load"]
    for room in (FACE, PROGRAM):
        assert broken_arrows("cases", ["catenary.scenes.load"], room) == []
    assert broken_arrows("cases", ["catenary"], PROGRAM) == []
    assert broken_arrows("cases", ["catenary"], FACE) != []
    assert {"scenes", "runs"} <= FACE_FILES
    loose = ast.parse("from mpi4py import MPI\ndef f(comm=MPI.COMM_WORLD):\n    pass\n")
    inside = ast.parse("from mpi4py import MPI\ndef f():\n    return MPI.COMM_WORLD\n")
    assert list(world_at_import(loose)) == [2]
    assert list(world_at_import(inside)) == []
    assert len(FILES) > len(PARTS)


def wrong_in(files: Iterable[Path], find: Callable[[Path], Sequence[object]]) -> dict[str, object]:
    """What ``find`` finds wrong, by the file that has it."""
    return {str(path.relative_to(ROOT)): found for path in files if (found := find(path))}


def test_files_import_only_layers_before_their_own() -> None:
    def broken(path: Path) -> list[str]:
        part, *rest = path.relative_to(ROOT).parts
        if rest[0] == BASE:
            part = BASE
        return broken_arrows(part, imports_of(path), rest[0])

    assert wrong_in(FILES, broken) == {}


@pytest.mark.parametrize("leaf", sorted(LEAVES))
def test_a_leaf_imports_nothing_but_leaves(leaf: str) -> None:
    path = ROOT.joinpath(*leaf.split(".")[1:])
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    ours = [name for name in imports_of(path) if is_within(name, "catenary")]
    assert all(any(is_within(name, other) for other in LEAVES) for name in ours)


@pytest.mark.parametrize(
    ("module", "only"), [("gmsh", "meshgen/gmsh_lines.py"), ("meshio", "meshgen/reader.py")]
)
def test_a_mesh_library_is_imported_in_one_file(module: str, only: str) -> None:
    users = {
        str(path.relative_to(ROOT))
        for path in FILES
        if any(is_within(name, module) for name in imports_of(path))
    }
    assert users == {only}


def test_mpi_starts_in_one_way() -> None:
    """What imports it from mpi4py itself starts a lone process as one of a job."""
    start = {"solver/base/mpi.py", "solver/base/process.py", "solver/base/parallel.py"}
    users = {str(path.relative_to(ROOT)) for path in FILES if "mpi4py.MPI" in imports_of(path)}
    assert users == start


FILE_WRITERS = ("h5py", "meshio", "gmsh", "catenary.postproc", "matplotlib", "jinja2")


def test_the_solver_never_writes_results() -> None:
    def writers(path: Path) -> list[str]:
        names = imports_of(path)
        return [name for name in names if any(is_within(name, one) for one in FILE_WRITERS)]

    assert wrong_in((ROOT / "solver").rglob("*.py"), writers) == {}


# Public functions whose verbs have other names.
NAMED_OTHERWISE = {"list": "shipped_cases", "speed": "highest_speeds", "separation": "separations"}
# What both the face and the command line take from runs and studies: wishes as data, and what verbs
# without a counterpart in the face need. All other work of these verbs is that of the face.
TAKEN_BY_BOTH = {
    "catenary.cases.studies.asked.Speeds",
    "catenary.cases.studies.asked.Distances",
    "catenary.cases.studies.sweep.jobs.RunOptions",
    "catenary.cases.studies.sweep.together.Marching",
    "catenary.cases.studies.sweep.variants.check_keys",
    "catenary.cases.studies.sweep.variants.product",
    "catenary.cases.run.plan.make_plan",  # submit: two figures, no table
    "catenary.cases.studies.sweeps.plan_sweep",  # checked scenes, of which none is run
    "catenary.cases.studies.records.held_study",  # numerics: studies that the face has not
}


def verbs() -> dict[str, ast.FunctionDef]:
    """The function of each verb of the command line."""
    found = {}
    for path in (ROOT / "cases" / PROGRAM).rglob("*.py"):
        for node in tree_of(path).body:
            for mark in node.decorator_list if isinstance(node, ast.FunctionDef) else []:
                if isinstance(mark, ast.Call) and ast.unparse(mark.func).endswith("verb"):
                    found[ast.literal_eval(mark.args[0])] = node
    return found


def face_used_in(tree: ast.AST) -> set[str]:
    """Files of the face whose names are used: ``catenary.NAME``, or imported from the file."""
    files = {name.split(".")[1] for name in imports_in(tree) if name.startswith("catenary.")}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "catenary":
            files.add(catenary._FILE_OF[node.attr])
    return files & FACE_FILES


def test_a_verb_with_a_counterpart_in_python_calls_that() -> None:
    checked = set()
    for verb, function in verbs().items():
        name = NAMED_OTHERWISE.get(verb, verb)
        if name in catenary._FILE_OF:
            assert catenary._FILE_OF[name] in face_used_in(function), verb
            checked.add(name)
    functions = {name for name in catenary.__all__ if name.islower() and name[0] != "_"}
    assert functions - checked == {"load", "open"}  # no verbs


def work_taken_by(room: str) -> set[str]:
    """What files of a room import from runs and studies, but for types."""
    parts = ("catenary.cases.run.", "catenary.cases.studies.")
    trees = [without_types(tree_of(path)) for path in (ROOT / "cases" / room).rglob("*.py")]
    return {name for tree in trees for name in imports_in(tree) if name.startswith(parts)}


def test_the_command_line_does_no_work_that_the_face_does() -> None:
    assert work_taken_by(FACE) & work_taken_by(PROGRAM) == TAKEN_BY_BOTH


def world_at_import(tree: ast.Module) -> Iterator[int]:
    """Lines that use COMM_WORLD when the module is imported, default arguments included."""
    pending: list[ast.AST] = list(tree.body)
    while pending:
        node = pending.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            # the body runs later, defaults and decorators run now
            pending += [d for d in (*node.args.defaults, *node.args.kw_defaults) if d is not None]
            pending += getattr(node, "decorator_list", [])
            continue
        if isinstance(node, ast.Attribute) and node.attr == "COMM_WORLD":
            yield node.lineno
        if isinstance(node, ast.ImportFrom) and any(n.name == "COMM_WORLD" for n in node.names):
            yield node.lineno
        pending += ast.iter_child_nodes(node)


def test_no_module_holds_the_world_communicator() -> None:
    below = [path for path in FILES if path.relative_to(ROOT).parts[0] != "cases"]
    assert wrong_in(below, lambda path: list(world_at_import(tree_of(path)))) == {}


def room_of(module: str) -> str | None:
    """The room of a part that holds a module, None if none is declared for it."""
    _, part, *rest = module.split(".")
    name = ".".join(rest)
    return next((room for room in ROOMS[part] if is_within(name, room)), None)


def arrows_up(path: Path) -> list[str]:
    """What a file imports from rooms above its own."""
    part, *rest = path.relative_to(ROOT).with_suffix("").parts
    own = room_of(".".join(("catenary", part, *rest)))
    if own is None or rest[0] == BASE:
        return []
    order = ROOMS[part]
    found = []
    for module in imports_of(path):
        if is_within(module, f"catenary.{part}"):
            room = room_of(module)
            if room is not None and order.index(room) > order.index(own):
                found.append(module)
    return found


def test_the_order_of_rooms_names_each_of_them() -> None:
    for path in FILES:
        part, *rest = path.relative_to(ROOT).with_suffix("").parts
        if rest[0] != BASE and rest[-1] != "__init__":
            assert room_of(".".join(("catenary", part, *rest))), path


def test_files_import_only_rooms_below_their_own() -> None:
    assert wrong_in(FILES, arrows_up) == {}


def first_line(path: Path) -> str:
    """What a file, or a folder by its ``__init__.py``, says that it is for."""
    text = ast.get_docstring(tree_of(path / "__init__.py" if path.is_dir() else path))
    assert text is not None, path
    return text.split("\n\n")[0].replace("\n", " ").replace("``", "`").rstrip(".")


def inner_rooms(part: str) -> list[Path]:
    """Folders within the rooms of a part."""
    rooms = {ROOT / part / room.replace(".", "/") for room in ROOMS[part]} | {ROOT / part / BASE}
    folders = {path.parent for path in FILES if path.is_relative_to(ROOT / part)}
    return sorted(
        folder for folder in folders if folder not in rooms and rooms & set(folder.parents)
    )


def without_types(tree: ast.Module) -> ast.Module:
    """A file without what it imports for type checkers."""
    kept = [
        node
        for node in tree.body
        if not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
    ]
    return ast.Module(kept, [])


def circles_in(folder: Path) -> list[str]:
    """Files and sub-packages of a folder that import each other in a circle, none if none do.

    What only type checkers import does not count.
    """
    arrows: dict[str, set[str]] = {}
    place = module_of(folder)
    depth = place.count(".") + 1
    for path in folder.rglob("*.py"):
        own = path.relative_to(folder).with_suffix("").parts[0]
        for module in imports_in(without_types(tree_of(path))):
            if is_within(module, place) and module != place:
                other = module.split(".")[depth]
                if own != other:
                    arrows.setdefault(own, set()).add(other)
    try:
        graphlib.TopologicalSorter(arrows).prepare()
    except graphlib.CycleError as error:
        return list(error.args[1])
    return []


def test_files_and_folders_of_a_folder_import_each_other_one_way() -> None:
    folders = {path.parent.parent for path in FILES if path.name == "__init__.py"} - {ROOT}
    assert wrong_in(sorted(folders), circles_in) == {}


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    name = ".".join(("catenary", *parts)).removesuffix(".__init__")
    name = name.replace(f"catenary.solver.{BASE}", f"catenary.{BASE}")
    return name.replace(f"catenary.cases.{FACE}", "catenary")


def test_no_files_import_each_other_in_a_circle_even_for_types() -> None:
    modules = {module_of(path) for path in FILES}
    arrows = {
        module_of(path): {
            name if name in modules else name.rpartition(".")[0] for name in imports_of(path)
        }
        & modules - {module_of(path)}
        for path in FILES
    }
    assert sum(map(len, arrows.values())) > len(FILES)
    graphlib.TopologicalSorter(arrows).prepare()  # names a circle that it finds


@pytest.mark.process
def test_benchmarks_can_be_collected() -> None:
    """No other run of tests imports them."""
    words = [sys.executable, "-m", "pytest", "--collect-only", "-q", "tests/benchmarks"]
    own = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    found = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, env=own)
    assert found.returncode == 0, found.stdout


def test_the_architecture_page_lists_folders_within_rooms() -> None:
    inner = [folder for part in PARTS for folder in inner_rooms(part)]
    expected = [(f"{path.relative_to(ROOT)}/", first_line(path)) for path in inner]
    assert table_below("Folders within these") == expected


@pytest.mark.parametrize("part", PARTS)
def test_the_architecture_page_says_what_rooms_are_for(part: str) -> None:
    for name, text in table_below(f"{part}: "):
        assert text == first_line(ROOT / part / name)
