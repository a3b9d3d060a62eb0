"""Bits flipped in result files: each is told, or changes nothing that is read from the file.

`make fuzz` flips many; FUZZ_SEED and FUZZ_FLIPS say where seeds begin and how many there are of
each kind. Every file is first examined in a process of its own, as the program does.
"""

from __future__ import annotations

import os
import random
import shutil
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from damaging import as_json, flip, raw_ranges, spoil_chunk, unseal
from program import catenary, short_run
from studies import few
from verb_runner import invoke

from catenary import InputError
from catenary.postproc.evaluate import statistics as stats
from catenary.postproc.evaluate import verdict
from catenary.postproc.evaluate.compare import compare
from catenary.postproc.read import guard
from catenary.postproc.read.guard import examined
from catenary.postproc.read.results import Results
from catenary.postproc.report import summary

FIRST = int(os.environ.get("FUZZ_SEED", "1"))
FLIPS = int(os.environ.get("FUZZ_FLIPS", "3"))
# A test of the program as a process, one flip each.
VERBS = min(20, int(os.environ.get("FUZZ_FLIPS", "1")))
# No file of these sizes takes longer to be examined, and no flip makes it [s].
LIMIT = 60.0


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A run that is done and one that was interrupted in the middle of a chunk."""
    folder = tmp_path_factory.mktemp("runs")
    flush = "output.flush_every_steps=100"
    done = catenary(*short_run(folder / "finished", flush), cwd=folder)
    assert done.code == 0, done.stderr
    words = [*short_run(folder / "interrupted", flush), "--", "-march_ts_max_steps", "1050"]
    assert catenary(*words, cwd=folder).code == 1
    return {name: folder / name for name in ("finished", "interrupted")}


def figures(folder: Path, records: Any = None) -> dict[str, Any]:
    """All that is read of a run: figures, histories, the state to continue from."""
    with Results(folder, records) as results:
        statistics = stats.evaluate(results)
        told = summary.summarise(results, statistics, verdict.criteria_of(results, statistics))
        told["complaints"] = statistics.complaints
        sums = {
            name: results.channel(name).sum()
            for name in ("contact_position", "contact_force", "arm_uplift", "dropper_force")
        }
        energies = {name: values.sum() for name, values in results.energies().items()}
        points = results.line("node_points").sum(), results.static("contact_height").sum()
        state = {k: np.sum(v) if k != "kind" else v for k, v in results.checkpoint.items()}
        return {
            "summary": told,
            "sums": sums,
            "energies": energies,
            "points": points,
            "config": results.attributes["config"],
            "state": state,
            "damage": results.damage,
        }


def ends(folder: Path, before: dict[str, Any], caplog: pytest.LogCaptureFixture) -> str:
    """How reading a damaged file ends: refused, told, the same or SILENT."""
    caplog.clear()
    try:
        records = examined(folder)
        found = figures(folder, records)
        compare(folder, folder, records=(records, records))
    except InputError as error:
        assert "\n" not in str(error) and str(error).startswith(str(folder / "run.h5"))
        return "refused"
    if found["damage"] or caplog.records:
        return "told"
    return "same" if as_json(found) == as_json(before) else "SILENT"


@pytest.mark.parametrize("where", ["tables", pytest.param("anywhere", marks=pytest.mark.study)])
@pytest.mark.parametrize(
    "which", [pytest.param("finished", marks=pytest.mark.study), "interrupted"]
)
def test_a_flipped_bit_is_told_or_changes_nothing(
    which: str,
    where: str,
    runs: dict[str, Path],
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
) -> None:
    before = figures(runs[which])
    found: Counter[str] = Counter()
    for seed in range(FIRST, FIRST + FLIPS):
        shutil.copy(runs[which] / "run.h5", tmp_path / "run.h5")
        rng = random.Random(f"{which} {where} {seed}")
        at = flip(tmp_path / "run.h5", rng, tables=where == "tables")
        begin = time.monotonic()
        try:
            end = ends(tmp_path, before, caplog)
        except Exception as error:
            raise AssertionError(f"FUZZ_SEED={seed} FUZZ_FLIPS=1 replays it, byte {at}") from error
        assert time.monotonic() - begin < LIMIT
        assert end != "SILENT", f"FUZZ_SEED={seed} FUZZ_FLIPS=1 replays it, byte {at}"
        found[end] += 1
    print(dict(found))


@pytest.mark.parametrize("verb", ["report", "compare", "restart"])
@pytest.mark.parametrize("seed", range(FIRST, FIRST + VERBS))
def test_verbs_end_in_a_sentence_or_do_their_work(
    seed: int, verb: str, runs: dict[str, Path], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    shutil.copytree(runs["interrupted"], out)
    at = flip(out / "run.h5", random.Random(f"{verb} {seed}"), tables=True)
    words = [verb, str(out), *([str(runs["finished"])] if verb == "compare" else [])]
    done = catenary(*words, cwd=tmp_path)
    assert done.code in (0, 2), (seed, at, done)
    assert "Traceback" not in done.stderr and done.left == [], (seed, at, done)
    if done.code == 2:
        assert done.sentences[-1].startswith(f"catenary: {out / 'run.h5'} "), (seed, at, done)


def in_both_states(name: str, number: float) -> Callable[[h5py.File], None]:
    def apply(file: h5py.File) -> None:
        for slot in file["checkpoint"].values():
            slot[name][...] = number

    return apply


# What a restart refuses before it computes, in files whose checksums have gone.
NOT_CONTINUED: dict[str, tuple[Callable[[h5py.File], None], str]] = {
    "edition 2099": (
        lambda file: file.attrs.__setitem__("rules", '["en50367:2099"]'),
        '"rules" is not a list of rule books',
    ),
    "state NaN": (in_both_states("displacement", np.nan), "displacement holds NaN or infinity"),
    "state of other nodes": (in_both_states("row_of_node", 3), "row_of_node puts node 0 in row 3"),
    "state of other forces": (
        in_both_states("contact_force", 99.0),
        "its contact_force is up to",
    ),
    "state of other motion": (
        in_both_states("displacement", 0.1),
        "its arm_uplift is up to",
    ),
    "a channel gone": (
        lambda file: file.__delitem__("channels/head_height"),
        "channels/head_height is missing",
    ),
    "a line channel gone": (
        lambda file: file.__delitem__("line_channels/arm_uplift"),
        "line_channels/arm_uplift is missing",
    ),
    "a short line channel": (
        lambda file: file["line_channels/arm_uplift"].resize(300, axis=0),
        "line_channels/arm_uplift ends after 300 of",
    ),
    "times without end": (
        lambda file: file["time"].resize(10**15, axis=0),
        "time has 1000000000000000 rows, of 2017 that the run plans",
    ),
    "states that are none": (
        lambda file: file.create_group("checkpoint/0/more"),
        "checkpoint/0 does not hold tables alone",
    ),
    "no rows": (lambda file: file["complete_rows"].__setitem__(0, 0), "none of its records"),
    "other line": (lambda file: file.attrs.__setitem__("n_dofs", 12), "n_dofs is 12, its scene"),
}


@pytest.mark.parametrize(
    "how",
    few(
        NOT_CONTINUED,
        "a line channel gone",
        "state of other motion",
        "other line",
        "state NaN",
        "no rows",
        "times without end",
    ),
)
def test_what_cannot_be_is_not_continued(how: str, runs: dict[str, Path], tmp_path: Path) -> None:
    out = tmp_path / "out"
    shutil.copytree(runs["interrupted"], out)
    damage, words = NOT_CONTINUED[how]
    with h5py.File(out / "run.h5", "r+") as file:
        unseal(file)
        damage(file)
    before = (out / "run.h5").read_bytes()
    done = invoke("restart", str(out))
    assert done.exit_code == 2, done.output
    assert words in done.stderr.splitlines()[-1] and "Traceback" not in done.stderr
    assert (out / "run.h5").read_bytes() == before


def test_counts_of_rows_that_cannot_be_are_replaced(runs: dict[str, Path], tmp_path: Path) -> None:
    """The length of the tables counts in their place, as for a report."""
    out = tmp_path / "out"
    shutil.copytree(runs["interrupted"], out)
    with h5py.File(out / "run.h5", "r+") as file:
        file["complete_rows"][...] = 10**15
    done = catenary("restart", str(out), cwd=tmp_path)
    assert done.code == 0, done
    with h5py.File(out / "run.h5") as found, h5py.File(runs["finished"] / "run.h5") as whole:
        assert found["complete_rows"][...].tolist() == whole["complete_rows"][...].tolist()
        force = "channels/contact_force"
        assert np.allclose(found[force][...], whole[force][...], rtol=1e-9, atol=1e-9)


LINE = "line_channels/dropper_force"


def end_of(path: Path, table: str) -> tuple[int, ...]:
    """Where the last chunk of a table begins."""
    with h5py.File(path) as file:
        rows, chunks = file[table].shape[0], file[table].chunks
    return (rows - 1 - (rows - 1) % chunks[0], *[0] * (len(chunks) - 1))


def test_a_run_goes_on_behind_a_damaged_end_of_a_line_channel(
    runs: dict[str, Path], tmp_path: Path
) -> None:
    """Its records there are lost, and that is told; all others are those of a run in one piece."""
    out = tmp_path / "out"
    shutil.copytree(runs["interrupted"], out)
    first = end_of(out / "run.h5", LINE)
    spoil_chunk(out / "run.h5", LINE, first)
    done = catenary("restart", str(out), cwd=tmp_path)
    assert done.code == 0, done.stderr
    assert f"{LINE} is damaged: its records {first[0]} to " in done.stderr
    with h5py.File(out / "run.h5") as found, h5py.File(runs["finished"] / "run.h5") as whole:
        lost = np.isnan(found[LINE][...])
        rows = np.flatnonzero(lost.any(axis=1))
        assert rows[0] == first[0] and rows.size < found[LINE].chunks[0]
        assert np.allclose(found[LINE][...][~lost], whole[LINE][...][~lost], rtol=1e-9, atol=1e-9)
        force = "channels/contact_force"
        assert np.allclose(found[force][...], whole[force][...], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("clock", ["line_channels/time", "energy/time"])
def test_a_run_does_not_go_on_behind_times_that_are_lost(
    clock: str, runs: dict[str, Path], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    shutil.copytree(runs["interrupted"], out)
    spoil_chunk(out / "run.h5", clock, end_of(out / "run.h5", clock))
    before = (out / "run.h5").read_bytes()
    done = catenary("restart", str(out), cwd=tmp_path)
    assert done.code == 2
    (sentence,) = done.stderr.splitlines()
    assert f"run.h5 cannot be continued: {clock} is damaged" in sentence
    assert (out / "run.h5").read_bytes() == before


def test_a_crash_and_an_endless_loop_of_hdf5_end_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What examines a file is replaced by what dies, and by what does not end."""
    path = tmp_path / "run.h5"
    path.write_bytes(b"")
    crash = "import ctypes; ctypes.string_at(0)"
    endless = "import time; time.sleep(1e3)"
    for script, words in ((crash, "HDF5 crashes at its tables (SIGSEGV)"), (endless, "within 1 s")):
        (tmp_path / "made_up_guard.py").write_text(script)
        monkeypatch.setenv("PYTHONPATH", str(tmp_path))
        monkeypatch.setattr(guard, "__name__", "made_up_guard")
        monkeypatch.setattr(guard, "LIMIT", 1.0)
        with pytest.raises(InputError) as refused:
            examined(path)
        assert words in str(refused.value)


def test_tables_lie_where_numbers_do_not(runs: dict[str, Path]) -> None:
    path = runs["finished"] / "run.h5"
    covered = sum(end - begin for begin, end in raw_ranges(path))
    print(f"{path.stat().st_size - covered} bytes of tables in {path.stat().st_size}")
    assert 0.5 < covered / path.stat().st_size < 0.99
