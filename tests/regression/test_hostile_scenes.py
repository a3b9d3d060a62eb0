"""Scenes by people who mean harm, and by people who had bad luck: each is refused in a sentence.

None of them may run anything (what it would run leaves a file ``canary``), write anything, take
long, or reach the terminal with a control character. Each is the sound scene with one change, or a
file of its own.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest
from program import catenary
from refusals import SOUND
from verb_runner import invoke

LIMIT = 5.0  # for a refusal [s]
VERBS = {"check": [], "plan": [], "run": ["-o", "out"]}
END = ""  # of the scene: what is added there

TITLE = 'title = "Reference model, to be broken"'
TENSION = "tension_N = 20000.0"
SPANS = "n_spans = 22"
ENCUMBRANCE = "encumbrance_m = 1.2"
GAPS = "elements_per_gap = 5"
DROPPERS = "positions_m = [5.0, 10.5, 17.0, 23.5, 30.0, 36.5, 43.0, 49.5, 55.0]"
REFERENCE = "[pantographs.reference]"
SPEED = "speed_km_h = 250.0"
STEP = "dt_s = 1e-3"

CRITERION = 'id = "a", title = "a", quantity = "mean_force", relation = "<="'
BREAK = '[[incidents]]\ntype = "dropper_break"\nat_s = 3.0\nspan = 9\ndropper = 2\n'


def course(file: str, key: str = "by_time_file") -> tuple[str, str]:
    """A course of the vehicle in this file."""
    return END, f'[vehicle.vertical]\n{key} = "{file}"\n[effects]\nvehicle_motion = true'


def mesh(file: str) -> tuple[str, str]:
    return GAPS, f'file = "{file}"'


def petsc(options: str) -> tuple[str, str]:
    return END, f"[petsc]\n{options}"


# What is replaced in the sound scene, and by what, by what it does.
CHANGES = {
    # Bad luck.
    "writes a decimal comma": (ENCUMBRANCE, "encumbrance_m = 1,2"),
    "writes the unit behind the number": (ENCUMBRANCE, "encumbrance_m = 1.2 m"),
    "gives the mass in grams": ("mass_kg_per_m = 1.35", "mass_kg_per_m = 1350"),
    "gives the tension in kilonewtons": (TENSION, "tension_N = 20"),
    "gives heights in millimetres": ("contact_height_m = 5.08", "contact_height_m = 5080"),
    "gives the step in milliseconds": (STEP, "dt_s = 1"),
    "hangs two droppers at one place": (DROPPERS, DROPPERS.replace("10.5", "5.0000001, 10.5")),
    "holds the marks of a merge": (
        SPANS,
        f"<<<<<<< HEAD\n{SPANS}\n=======\nn_spans = 23\n>>>>>>> other",
    ),
    "gives a table twice": (END, "[line]"),
    "was cut off while it was copied": (SOUND.read_text().partition("[numer")[2], ""),
    # Depth and size.
    "nests arrays": (SPANS, "n_spans = " + "[" * 300 + "]" * 300),
    "nests inline tables": (SPANS, "n_spans = " + "{a=" * 60 + "1" + "}" * 60),
    "nests tables by a header": (END, f"[line{'.a' * 300}]"),
    "nests tables by quoted keys": (END, " . ".join(['"a b"'] * 300) + " = 1"),
    "sets a key of a thousand parts in the test table": (END, f'[test]\n"{"line." * 999}line" = 1'),
    "writes an integer too long to be read": (SPANS, "n_spans = " + "9" * 5000),
    "writes an integer of ten thousand digits": (SPANS, "n_spans = 0x" + "f" * 10000),
    "asks for more spans than there are": (SPANS, f"n_spans = {2**63 - 1}"),
    "writes a number beyond all": (TENSION, "tension_N = 1e400"),
    "writes a number next to nothing": (TENSION, "tension_N = 5e-324"),
    "writes no number as the time step": (STEP, "dt_s = nan"),
    "takes steps of a nanosecond": (STEP, "dt_s = 1e-9"),
    "asks for four million droppers": (DROPPERS, "count = 200\nspacing_m = 0.25"),
    "asks for twenty-five million nodes": (GAPS, "elements_per_gap = 64"),
    "asks for nodes by refinement": (GAPS, "elements_per_gap = 60\nsupport_refinement = 16"),
    "breaks the same dropper two hundred times": (END, BREAK * 200),
    "puts a hundred pantographs on the train": (
        "[contact]",
        "".join(
            f'[[train.pantographs]]\nname = "reference"\nbehind_m = {5.0 * n}\n'
            for n in range(1, 100)
        )
        + "[contact]",
    ),
    "holds five hundred tables of its own": (END, "\n".join(f"[x{n}]" for n in range(500))),
    "gives a thousand options that do not exist": petsc(
        "\n".join(f"x{n} = {n}" for n in range(1000))
    ),
    "has a polynomial of a thousand powers": (
        END,
        f'own_rules = {{ name = "x", title = "x", criteria = [{{ {CRITERION}, limit = '
        f"{{ polynomial = [{', '.join(['1e9'] * 1000)}] }} }}] }}",
    ),
    "has ten thousand criteria": (
        END,
        f'own_rules = {{ name = "x", title = "x", criteria = [{",".join(["{}"] * 10000)}] }}',
    ),
    # Files that are none of a scene's business.
    "names a command for a shell": course("|touch canary", "by_place_file"),
    "reads a course from a device without end": course("/dev/zero"),
    "shows the environment": course("/proc/self/environ"),
    "names a folder as a course": course(".", "by_place_file"),
    "names a key in somebody's home": course("~/.ssh/id_rsa"),
    "waits for a course of the kernel": course("/proc/kmsg"),
    "shows the first lines of a file": course("/etc/passwd"),
    "waits for a course on the terminal": course("/dev/stdin"),
    "climbs out of its folder": course("../../../../../../../../etc/hostname"),
    "reads a mesh from a device without end": mesh("/dev/zero"),
    "names a folder as the mesh": mesh("/etc"),
    "waits for a mesh of the kernel": mesh("/proc/kmsg"),
    "reads the memory of the process": mesh("/proc/self/mem"),
    "names a mesh by a web address": mesh("https://example.org/line.msh"),
    "shows a file as a mesh": mesh("/etc/passwd"),
    "names a script of Gmsh as the mesh": mesh("script.geo"),
    "names a script of Gmsh that looks like a mesh": mesh("script.msh"),
    "waits for a mesh on the terminal": mesh("/dev/stdin"),
    "names a rule book that never ends": (END, 'rules_file = "/dev/zero"'),
    "names the file of passwords as a rule book": (END, 'rules_file = "/etc/passwd"'),
    "names a rule book far above its folder": (END, f'rules_file = "{"../" * 8}etc/hostname"'),
    # Values of another kind.
    "corrects what is no number of the pantograph": (
        "[train]",
        '[[pantographs.reference.corrections]]\nkey = "__init__.__globals__"\npublished = 1.0\n'
        'reason = "x"\n[train]',
    ),
    "gives a date where a speed stands": (SPEED, "speed_km_h = 2026-01-01T00:00:00Z"),
    "sets what Python keeps for itself": (
        STEP,
        f'{STEP}\n__class__ = "x"\nmodel_config = {{strict = false}}',
    ),
    "sets a private part of the scene": (END, '[_origin]\nfile = "x"'),
    "gives texts where effects are on or off": (
        END,
        '[effects]\ngravity = "false"\ncontact_loss = 1',
    ),
    "gives a format where a word stands": (END, 'edition = "{0.__class__}%n%s"'),
    "gives a template where a word stands": (END, 'system = "{{ 7 * 7 }}"'),
    "gives a shell's variable where a word stands": (STEP, f'{STEP}\nscheme = "$(touch canary)"'),
    "gives a text where the line stands": ("[line]", '[case.line]'),
    "gives a list where pantographs are named": (REFERENCE, "[[pantographs]]"),
    "gives one table where the train has a list": ("[[train.pantographs]]", "[train.pantographs]"),
    "names a kind of pantograph by a path of Python": ('type = "lumped"', 'type = "os.system"'),
    "gives a program where a number stands": (
        TENSION,
        "tension_N = \"__import__('os').system('touch canary')\"",
    ),
    "gives true where a tension stands": (TENSION, "tension_N = true"),
    "has a limit that would be code": (
        END,
        f'own_rules = {{ name = "x", title = "x", criteria = [{{ {CRITERION}, limit = '
        "{ value = \"__import__('os').system('touch canary')\" } }] }",
    ),
    # Options of PETSc; those of test_hostile_input.py come by the command line.
    "opens a window on somebody's display": petsc('march_ksp_view = "draw:x"'),
    "names the file of PETSc's binary viewer": petsc('viewer_binary_filename = "canary"'),
    "starts a debugger at the first error": petsc('on_error_attach_debugger = "sh"'),
    "asks for iterations without end": petsc(f"march_ksp_max_it = {2**63 - 1}"),
    "puts a line of options into a value": petsc('march_ksp_type = "cg\\n-log_view :canary"'),
    "gives a list where one word stands": petsc('march_pc_type = ["lu", "python"]'),
    "gives a table where one word stands": petsc('march_pc_type = {type = "lu", file = "canary"}'),
    "fills the terminal with PETSc's memory": petsc("malloc_dump = true"),
    "writes a monitor into a file": petsc('march_ksp_monitor = "ascii:canary"'),
    "moves an option below another prefix": petsc('prefix_push = "march_"\nksp_type = "python"'),
    "runs a function of Python as a monitor": petsc('march_ts_monitor_python = "canary.monitor"'),
    "puts more options into a key": petsc('"march_pc_type lu -log_view :canary" = true'),
    "puts more options into a value": petsc('march_pc_type = "lu -log_view :canary"'),
    "sends the matrix over the network": petsc('march_mat_view = "socket:192.0.2.1:5000"'),
    "gives a tolerance that no solver meets": petsc("march_ksp_rtol = nan"),
    # Texts that steer a terminal or a reader.
    "takes back letters of the output": (TITLE, r'source = "bad\b\b\bgood"'),
    "reverses the reading of what follows": (
        'name = "sound"',
        r'name = "line\u202Egnp.exe"',
    ),
    "steers the terminal by a control character of eight bits": (TITLE, r'title = "\u009b2J"'),
    "holds a deletion": (TITLE, r'source = "x\u007F"'),
    "names a pantograph with nothing": (REFERENCE, '[pantographs.""]'),
    "names a pantograph with five thousand letters": (REFERENCE, f"[pantographs.{'x' * 5000}]"),
    "overwrites the line of output": (REFERENCE, r'[pantographs."reference\rsafe"]'),
    "forges a second line of output": (TITLE, r'title = "fine\ncatenary: all is valid"'),
    "holds a separator of lines that is none in ASCII": (TITLE, r'title = "a\u2028b"'),
    "gives a title of two thousand letters": (TITLE, f'title = "{"y" * 2000}"'),
    "hides words in letters that nobody sees": (TITLE, r'title = "fine\U000E0072\U000E006D"'),
    "sets the title of the terminal": (TITLE, r'title = "\u001b]0;owned\u0007"'),
    "writes a key with a Cyrillic letter": ("[train]", '["tr\u0430in"]'),
    "hides a letter in a key": (SPEED, r'"speed\u200B_km_h" = 250.0'),
    "steers the terminal by the title of a rule book": (
        END,
        r'own_rules = { name = "x", title = "\u001b[2J", criteria = [] }',
    ),
}  # fmt: skip
# Changes that need another one, as of names or of the length of the line.
ALSO = {
    "asks for four million droppers": (SPANS, "n_spans = 20000"),
    "asks for twenty-five million nodes": (SPANS, "n_spans = 20000"),
    "asks for nodes by refinement": (SPANS, "n_spans = 20000"),
    "names a pantograph with nothing": ('name = "reference"', 'name = ""'),
    "names a pantograph with five thousand letters": ('"reference"', f'"{"x" * 5000}"'),
    "overwrites the line of output": ('"reference"', r'"reference\rsafe"'),
}
# Files that are no such scene at all.
FILES = {
    "is a program": b"\x7fELF\2\1\1\0\0\0\0\0",
    "holds nothing": b"\n",
    "is written in JSON": b'{"line": {"n_spans": 22}}\n',
    "is written in Latin-1": b'[case]\nname = "R\xf6merberg"\n',
    "is written in UTF-16": SOUND.read_text().encode("utf-16"),
    "is a page of a web server": b"<!DOCTYPE html>\n<html><title>404</title></html>\n",
    "is a pointer to a file": b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n",
    "is written in YAML": b"line:\n  n_spans: 22\n",
}
SCRIPTS = {
    "script.geo": 'SystemCall "touch canary";\nPoint(1) = {0, 0, 0};\n',
    "script.msh": '$MeshFormat\n2.2 0 8\n$EndMeshFormat\nSystemCall "touch canary";\n$Nodes\n'
    "99999999999999\n$EndNodes\n",
}
# Some of each kind are told to the program as a user starts it, without a terminal.
PROCESSES = (
    "puts a line of options into a value",
    "steers the terminal by a control character of eight bits",
    "waits for a mesh on the terminal",
    "waits for a course of the kernel",
    "asks for twenty-five million nodes",
    "nests tables by quoted keys",
    "gives a template where a word stands",
)


def content(name: str) -> bytes:
    """The file of a scene."""
    if name in FILES:
        return FILES[name]
    text = SOUND.read_text(encoding="utf-8")
    for changes in (CHANGES, ALSO):
        old, new = changes.get(name, (END, END))
        assert old in text
        text = text.replace(old, new) if old else text + new + "\n"
    return text.encode()


@pytest.fixture
def folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """That of the scene; the program runs in an empty one beside it."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    scenes = tmp_path / "scenes"
    scenes.mkdir()
    for name, text in SCRIPTS.items():
        (scenes / name).write_text(text)
    return scenes


def assert_refused(output: str, several: bool) -> None:
    sentences = output.rstrip("\n").split("\n")
    assert several or len(sentences) == 1, output
    for sentence in sentences:
        assert sentence.startswith("catenary: ") and 20 < len(sentence) < 2000, sentence
        assert all(letter.isprintable() for letter in sentence), ascii(sentence)
        for word in ("Traceback", "Error", "codec", "pydantic", "<class", "root:", "None"):
            assert word not in sentence, sentence


def assert_nothing_written(scene: Path) -> None:
    assert os.listdir() == []
    assert sorted(os.listdir(scene.parent)) == sorted([scene.name, *SCRIPTS])


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("name", [*CHANGES, *FILES])
def test_a_hostile_scene_is_refused(name: str, verb: str, folder: Path) -> None:
    scene = folder / "scene.toml"
    scene.write_bytes(content(name))
    begin = time.perf_counter(), time.process_time()
    result = invoke(verb, str(scene), *VERBS[verb])
    waited, worked = time.perf_counter() - begin[0], time.process_time() - begin[1]
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert_refused(result.stderr, several=verb == "check")
    assert_nothing_written(scene)
    # On a loaded machine one waits for a core as well.
    assert worked < LIMIT and waited < 6 * LIMIT, f"{worked:.1f} s of work, {waited:.1f} s in all"


@pytest.mark.parametrize("name", PROCESSES)
def test_the_program_itself_refuses_a_hostile_scene(name: str, folder: Path) -> None:
    scene = folder / "scene.toml"
    scene.write_bytes(content(name))
    done = catenary("run", str(scene), "-o", "out", cwd=Path.cwd())
    assert done.code == 2 and done.stdout == "", done
    assert_refused(done.stderr, several=False)
    assert_nothing_written(scene)
