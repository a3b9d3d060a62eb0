"""``catenary new`` and ``catenary doctor``: a case to begin with, and whether the program works."""

from __future__ import annotations

import contextlib
import os
import pty
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from program import ENTRY, MPIRUN, catenary
from scenes import line_data_of, load_scene, shipped
from verb_runner import invoke

from catenary import InputError
from catenary.cases.process import installation
from catenary.cases.process.installation import BROKEN, MISSING, OK, Finding
from catenary.cases.scene.starter import BEGINNINGS, write_case


@pytest.mark.parametrize("kind", BEGINNINGS)
def test_a_new_case_is_checked_and_named_after_its_folder(tmp_path: Path, kind: str) -> None:
    done = invoke("new", str(tmp_path / "my_line"), "--topology", kind)
    assert done.exit_code == 0, done.output
    checked = invoke("check", str(tmp_path / "my_line"))
    assert checked.exit_code == 0, checked.output
    scene = load_scene(tmp_path / "my_line")
    assert scene.case.name == scene.case.title == "my_line"
    assert BEGINNINGS[kind].case in scene.case.source
    begun = load_scene(BEGINNINGS[kind].case)
    if not BEGINNINGS[kind].changes:
        assert scene.model_dump(exclude={"case"}) == begun.model_dump(exclude={"case"})


def test_two_messenger_wires_share_what_one_had(tmp_path: Path) -> None:
    scene, twin = load_scene(write_case(tmp_path / "a", "twin_messenger")), load_scene("dc_twin")
    own, whole = scene.line.messenger_wire, twin.line.messenger_wire
    assert own is not None and whole is not None
    for key in ("tension_N", "mass_kg_per_m", "bending_stiffness_N_m2"):
        assert 2 * getattr(own, key) == getattr(whole, key)


def test_a_new_case_names_usual_values_of_the_key_below(tmp_path: Path) -> None:
    lines = write_case(tmp_path / "a", "simple").read_text().splitlines()
    at = lines.index("tension_N = 22000.0")
    assert lines[at - 1] == "# usual: 10000 to 20000, high speed 20000 to 31500"
    rail = write_case(tmp_path / "b", "conductor_rail").read_text().splitlines()
    for value in ("tension_N = 100.0", "mass_kg_per_m = 7.1", "span_m = 8.5"):
        at = next(i for i, line in enumerate(rail) if line.startswith(value))
        assert not rail[at - 1].startswith("# usual"), "what wires have is not usual of a rail"


@pytest.mark.parametrize("case", shipped())
def test_every_shipped_case_may_be_a_beginning(tmp_path: Path, case: str) -> None:
    path = write_case(tmp_path / "a", case)
    assert tomllib.loads(path.read_text())["case"]["title"] == "a"


def tables(folder: Path, n: int) -> tuple[Path, Path]:
    """A planner's tables of ``n`` spans of three lengths with seven droppers each."""
    lengths = [(50.0, 55.0, 60.0)[i % 3] for i in range(n)]
    rows = [
        f"{i};{4.5 + k * (length - 9) / 6:.2f};{(0, 12, 20, 24, 20, 12, 0)[k]}"
        for i, length in enumerate(lengths, start=1)
        for k in range(7)
    ]
    spans, droppers = folder / "line 7.csv", folder / "hung.csv"
    spans.write_text("span_m\n" + "".join(f"{length}\n" for length in lengths))
    droppers.write_text("\n".join(["span;position_m;pre_sag_mm", *rows]).replace(".", ",") + "\n")
    return spans, droppers


@pytest.mark.parametrize("kind", ["simple", "stitched", "compound", "twin"])
@pytest.mark.parametrize("n", [16, 31])
def test_tables_of_a_planner_make_a_case(tmp_path: Path, kind: str, n: int) -> None:
    spans, droppers = tables(tmp_path, n)
    path = write_case(tmp_path / "deep" / "my_line", kind, spans, droppers)
    spans.unlink()
    droppers.unlink()
    for shortened in (False, True):
        scene = load_scene(path, shortened=shortened)
        data = line_data_of(scene)
        assert data.span_lengths[:4] == (50.0, 55.0, 60.0, 50.0)
        assert data.dropper_positions[2][3] == 30.0 and data.pre_sag[2][3] == 0.024
        assert len(data.span_lengths) == (12 if shortened else n)
    assert sorted(p.name for p in path.parent.iterdir()) == [
        "case.toml",
        "droppers.csv",
        "spans.csv",
    ]


@pytest.mark.process
def test_a_terminal_is_asked_for_the_kind_of_line(tmp_path: Path) -> None:
    own, other = pty.openpty()
    words = [sys.executable, "-c", ENTRY, "new", "a"]
    with subprocess.Popen(words, cwd=tmp_path, stdin=other, stdout=other, stderr=other) as asked:
        os.close(other)
        os.write(own, b"tramway\n")
        said = b""
        with contextlib.suppress(OSError):  # the end of a terminal that its program has left
            while chunk := os.read(own, 4096):
                said += chunk
        assert asked.wait(240) == 0, said
    os.close(own)
    assert b"conductor_rail" in said and b"Which kind of line [simple]: " in said
    assert load_scene(tmp_path / "a").line.topology == "single"


def test_a_case_of_ones_own_may_be_a_beginning(tmp_path: Path) -> None:
    spans, droppers = tables(tmp_path, 20)
    wires = write_case(tmp_path / "wires", "windy_viaduct")
    wires.write_text(wires.read_text().replace("tension_N = 22000.0", "tension_N = 21000.0"))
    path = write_case(tmp_path / "line", str(wires.parent), spans, droppers)
    text = path.read_text()
    assert text.count("# usual: 10000 to 20000, high speed 20000") == 1  # not once more
    scene = load_scene(path)
    assert scene.line.contact_wire is not None and scene.line.contact_wire.tension_N == 21000.0
    # The places of the evaluated stretch are changed, and none of another table.
    assert scene.wind == load_scene("windy_viaduct").wind
    again = write_case(tmp_path / "next", str(tmp_path / "line"), spans, droppers)
    assert load_scene(again).line == scene.line


def test_spans_of_a_table_are_those_of_transitions_too(tmp_path: Path) -> None:
    """Of ``ambrosio2012`` the end spans have a length of their own."""
    spans, droppers = tables(tmp_path, 20)
    scene = load_scene(write_case(tmp_path / "a", "ambrosio2012", spans, droppers))
    assert scene.line.transition.n_spans_start > 0
    lengths = tuple(map(float, spans.read_text().splitlines()[1:]))
    assert line_data_of(scene).span_lengths == lengths


def test_two_pantographs_and_an_overlap_find_room_in_the_spans_of_a_table(tmp_path: Path) -> None:
    """The last pantograph starts behind two spans, and --short keeps an overlap where it judges."""
    spans, droppers = tables(tmp_path, 31)
    path = write_case(tmp_path / "a", "overlap", spans, droppers)
    for shortened in (False, True):
        scene = load_scene(path, shortened=shortened)
        masts = line_data_of(scene).support_positions
        behind = max(place.behind_m for place in scene.train.pantographs)
        assert behind > 0.0
        assert masts[2] <= scene.train.start_m - behind < masts[3]
        assert scene.line.overlap is not None
        first = masts[scene.line.overlap.first_span[0] - 1]
        assert scene.train.start_m < first < scene.evaluation.to_m


def test_a_case_of_another_file_is_named_by_it(tmp_path: Path) -> None:
    example = Path(__file__).parents[2] / "docs/examples/two_messengers.toml"
    text = write_case(tmp_path / "a", str(example)).read_text()
    assert "begun from two_messengers." in text and "values of two_messengers: assumed" in text


def test_a_line_without_droppers_takes_spans_alone(tmp_path: Path) -> None:
    spans, _ = tables(tmp_path, 20)
    assert load_scene(write_case(tmp_path / "a", "tramway", spans)).line.n_spans == 20


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--topology", "simpel"], "there is no kind of line named simpel: name one of simple,"),
        (["--droppers", "hung.csv"], "--droppers needs --spans too"),
        (["--spans", "none.csv"], "none.csv cannot be read: no such file"),
        (["--spans", "few.csv", "--droppers", "hung.csv"], "a new case needs 12, to run in"),
        (["--spans", "line 7.csv"], "spacing_m, or a planner's table by --droppers"),
        (["--spans", "hung.csv"], "the table of spans is"),
        (
            ["--spans", "short.csv"],
            "line.span_m.19 is 3.0 in short.csv; it must be at least 5 [m]; usual",
        ),
        (
            ["--spans", "line 7.csv", "--topology", "stitched"],
            "line.dropper.positions_m in the new case begun from stitched holds for one span",
        ),
        (["--topology", "half"], "is missing in the new case begun from half (and 4 more)\n"),
        (["--spans", "line 7.csv", "--droppers", "typed.csv"], "droppers is typed.csv; its line 5"),
        (
            ["--spans", "line 7.csv", "--droppers", "part.csv"],
            "part.csv has no entry for span 3",
        ),
    ],
)
def test_what_makes_no_case_writes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], sentence: str
) -> None:
    monkeypatch.chdir(tmp_path)
    tables(tmp_path, 20)
    (tmp_path / "few.csv").write_text("span_m\n55\n55\n")
    (tmp_path / "short.csv").write_text("span_m\n" + 19 * "55\n" + "3\n")
    (tmp_path / "half").mkdir()
    (tmp_path / "half/case.toml").write_text("[line]\nn_spans = 3\n")
    hung = (tmp_path / "hung.csv").read_text().splitlines(keepends=True)
    (tmp_path / "typed.csv").write_text("".join([*hung[:4], "1;x;0\n", *hung[5:]]))
    (tmp_path / "part.csv").write_text("".join(hung[:15]))
    before = sorted(tmp_path.iterdir())
    done = invoke("new", "a", *words)
    assert done.exit_code == 2 and sentence in done.output, done.output
    assert sorted(tmp_path.iterdir()) == before
    # A file that is named from the root is named so, once.
    absolute = [str(tmp_path / word) if word.endswith(".csv") else word for word in words]
    done = invoke("new", "deep/a", *absolute)
    assert done.exit_code == 2 and f"{tmp_path}/{tmp_path}" not in done.output, done.output
    assert sorted(tmp_path.iterdir()) == before


def test_a_folder_that_is_there_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    with pytest.raises(InputError, match="is there already"):
        write_case(tmp_path / "a", "simple")
    assert list((tmp_path / "a").iterdir()) == []
    file = tmp_path / "file"
    file.write_text("")
    done = invoke("new", str(file / "a"))
    assert done.exit_code == 2 and "cannot be made" in done.output


@pytest.mark.parametrize("name", ['q"uote', "back\\slash", "ümläut", "two words"])
def test_any_name_of_a_folder_may_be_that_of_a_case(tmp_path: Path, name: str) -> None:
    assert load_scene(write_case(tmp_path / name, "simple")).case.title == name


def test_commands_that_are_told_may_be_pasted(tmp_path: Path) -> None:
    lines = invoke("new", str(tmp_path / "Straße 9")).output.splitlines()
    (checked,) = [words for line in lines if (words := shlex.split(line))[1:2] == ["check"]]
    assert invoke(*checked[1:]).exit_code == 0


@pytest.mark.study
@pytest.mark.process
def test_the_doctor_finds_that_runs_are_possible_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = invoke("doctor")
    assert done.exit_code == 0, done.output
    lines = done.output.splitlines()
    assert lines[-1] == "runs are possible"
    assert {line.split()[0] for line in lines[:-1]} <= {OK, MISSING, BROKEN}
    said = {line[9:24].strip(): line for line in lines[:-1]}
    for part in ("Python", "compiled kernels", "PETSc", "HDF5", "MPI", "results folder"):
        assert any(line.startswith(f"{OK:8} {part}") for line in lines), said
    assert list(tmp_path.iterdir()) == []


def test_what_is_broken_is_told_with_a_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    found = [
        Finding("PETSc", BROKEN, "ended by signal 11", "install another", needed=True),
        Finding("films", MISSING, "no imageio_ffmpeg", "pip install it"),
    ]
    monkeypatch.setattr(installation, "examined", lambda folder: iter(found))
    done = invoke("doctor")
    assert done.exit_code == 1
    assert "broken   PETSc           ended by signal 11; to mend it: install another" in done.output
    assert "no run is possible before these work: PETSc" in done.output
    monkeypatch.setattr(installation, "examined", lambda folder: iter(found[1:]))
    assert invoke("doctor").exit_code == 0


@pytest.mark.study
@pytest.mark.process
@pytest.mark.skipif(MPIRUN is None, reason="needs mpirun")
def test_the_doctor_is_no_verb_of_several_ranks(tmp_path: Path) -> None:
    done = catenary("doctor", cwd=tmp_path, ranks=2)
    assert done.code == 2
    assert done.sentences == ["catenary: doctor starts two ranks itself: call it without mpirun"]


@pytest.mark.process
def test_what_runs_do_without_is_not_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Open MPI starts a daemon out of PATH in processes of others; runs start without it."""
    monkeypatch.setenv("PATH", "/nonexistent")
    solved = installation._tried("PETSc", installation._PETSC, "mend it", needed=True)
    assert solved.state == OK and "solves a small system" in solved.facts
    mpi = installation._mpi()
    assert mpi.state == MISSING and mpi.facts == "there is no mpirun in PATH"
    assert not mpi.prevents_runs


@pytest.mark.process
@pytest.mark.parametrize(
    ("program", "facts", "state"),
    [
        ("import no_such_module_at_all", "No module named", MISSING),
        ("raise ValueError('it is old')", "ValueError: it is old", BROKEN),
        ("import os; os.kill(os.getpid(), 11)", "ended by signal 11", BROKEN),
        ("import os; os.kill(os.getpid(), 1)", "ended by signal 1", BROKEN),
        ("import time; time.sleep(60)", "no answer within 1 s", BROKEN),
        ("print('7.1', '\\n----')", "7.1", OK),
    ],
)
def test_a_part_that_fails_is_a_finding(
    monkeypatch: pytest.MonkeyPatch, program: str, facts: str, state: str
) -> None:
    monkeypatch.setattr(installation, "LIMIT", 30.0 if state == OK else 1.0)
    found = installation._tried("a part", program, "mend it", needed=True)
    assert found.state == state and facts in found.facts
    assert found.prevents_runs == (state != OK)


def test_without_mpirun_one_rank_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(installation, "_answer", lambda command, **how: (0, "ranks 1 An MPI"))
    monkeypatch.setenv("PATH", str(tmp_path))
    found = installation._mpi()
    assert found.state == MISSING and not found.prevents_runs
    launcher = tmp_path / "mpirun"
    launcher.write_text("")
    launcher.chmod(0o755)
    # Two processes that do not know each other: mpirun is that of another library.
    found = installation._mpi()
    assert found.state == BROKEN and "different MPI libraries" in found.facts


def test_a_folder_that_cannot_be_written_to_is_told(tmp_path: Path) -> None:
    assert installation._folder(tmp_path).state == OK
    found = installation._folder(tmp_path / "none")
    assert found.state == BROKEN and "-o FOLDER" in found.remedy


def test_several_threads_a_rank_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    assert installation._threads().state == OK
    monkeypatch.setenv("OMP_NUM_THREADS", "8")
    assert "OMP_NUM_THREADS=8" in installation._threads().facts


@pytest.mark.parametrize(
    ("version", "bounds", "fits"),
    [
        ("1.24.2", ">=1.24,<3", True),
        ("3.0", "<3,>=1.24", False),
        ("1.9", ">=1.24", False),
        ("3.11.2", ">=3.11", True),
        ("2.0rc1", ">=1", True),
        ("0.1", "", True),
    ],
)
def test_versions_are_compared_part_by_part(version: str, bounds: str, fits: bool) -> None:
    assert installation._fits(version, bounds) is fits


def test_memory_is_that_of_the_system() -> None:
    assert 1e8 < installation._available() < 1e14
    assert f"{len(os.sched_getaffinity(0))} cores" in installation._memory().facts
