"""Damaged result files: one sentence for what cannot be used, the rest is read."""

from __future__ import annotations

import os
import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from damaging import attribute_mutations, dataset_mutations, flip, raw_ranges, unseal

from catenary import InputError
from catenary.postproc.evaluate.compare import compare
from catenary.postproc.files.committed_rows import ROWS, drop_extremes, extremes_at, store_extremes
from catenary.postproc.files.hdf5 import ARRAYS_SUM, seal_arrays, sum_is_kept
from catenary.postproc.read.results import Results
from catenary.postproc.report import report

# --- damaged result files -------------------------------------------------------------------------


SEED = int(os.environ.get("FUZZ_SEED", "1"))
MUTATIONS = int(os.environ.get("FUZZ_DAMAGE", "15"))
FLUSH = 200


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory, make_march: Any, record_run: Any) -> Path:
    """A finished run of 1601 records, with statistics."""
    folder = tmp_path_factory.mktemp("sound")
    march = make_march(n_steps=1600, dt=5e-3)
    return Path(record_run(folder / "run.h5", march, energy_every=100, flush_every=FLUSH))


@pytest.fixture
def copy(sound: Path, tmp_path: Path) -> Path:
    return Path(shutil.copy(sound, tmp_path / "run.h5"))


def removed(name: str) -> Callable[[h5py.File], None]:
    return lambda file: file.attrs.__delitem__(name)


def put(name: str, value: Any) -> Callable[[h5py.File], None]:
    return lambda file: file.attrs.__setitem__(name, value)


def value(path: str, row: int, number: float) -> Callable[[h5py.File], None]:
    def apply(file: h5py.File) -> None:
        file[path][row] = number

    return apply


def gone(path: str) -> Callable[[h5py.File], None]:
    return lambda file: file.__delitem__(path)


def fact(name: str, value: Any) -> Callable[[h5py.File], None]:
    def apply(file: h5py.File) -> None:
        del file["facts"][name]
        file["facts"][name] = value

    return apply


def number(name: str, value: float) -> Callable[[h5py.File], None]:
    return lambda file: file["facts"][name].write_direct(np.array(value))


# Damage after which there is no report, and what is told. The checksums of attributes are taken
# away first, as in a file of an earlier version.
REFUSED: dict[str, tuple[Callable[[h5py.File], None], str]] = {
    "no case": (removed("case"), 'its attribute "case" is missing'),
    "edition 2099": (
        put("rules", '["en50367:2099"]'),
        'its attribute "rules" is not a list of rule books',
    ),
    "no rules": (removed("rules"), 'its attribute "rules" is missing'),
    "no step": (number("time_step", 0.0), "facts/time_step holds 0 in place of 1e-12 to 1000 s"),
    "step NaN": (number("time_step", np.nan), "facts/time_step holds nan"),
    "speed as text": (
        fact("speed", np.bytes_("fast")),
        "facts/speed holds |S4 where numbers belong",
    ),
    "two speeds": (fact("speed", [30.0, 40.0]), "facts/speed has 1 dimensions in place of 0"),
    "no tension": (gone("facts/contact_wire_tension"), "facts/contact_wire_tension is missing"),
    "no facts": (gone("facts"), "its facts are missing"),
    "half a scene": (put("config", '{"line": {'), '"config" is not a scene as JSON'),
    "a list for a scene": (put("config", "[3]"), '"config" is not a scene as JSON ([3])'),
    "unknowns": (put("n_dofs", np.arange(3)), '"n_dofs" is not a whole number'),
    "no times": (gone("time"), "time is missing or cannot be read"),
    "no forces": (gone("channels/contact_force"), "channels/contact_force is missing"),
    "no arms": (
        gone("line_channels/arm_uplift"),
        "line_channels/arm_uplift is missing or cannot be read",
    ),
    "facts": (put("pantographs", "[3]"), '"pantographs" is not a list of tables'),
    "no channels": (gone("channels"), "channels/contact_position is missing"),
    "masts": (value("line/support_x", 3, -1e3), "line/support_x does not ascend"),
    "node beyond": (value("line/droppers", 0, 10**7), "line/droppers names number 10000000"),
    "NaN at rest": (value("static/elasticity", 2, np.nan), "static/elasticity holds nan"),
    "two roles of one wire": (
        put("wires", '{"contact_wire": "contact", "twin": "contact"}'),
        "line/wires has no twin, whose role is contact",
    ),
    "no contact wire": (
        put("wires", '{"contact_wire": "messenger", "messenger_wire": "messenger"}'),
        "no wire has the role of a contact wire",
    ),
    "another contact wire": (
        put("wires", '{"contact_wire": "contact", "messenger_wire": "contact"}'),
        "its tables have 481 of contact_node in place of 962",
    ),
    "profile": (value("static/contact_x", 3, -1e3), "static/contact_x does not ascend"),
    "two tensions": (
        fact("contact_wire_tension", [1e4, 2e4]),
        "facts/contact_wire_mass has 1 entries in place of 2",
    ),
    "evaluation": (
        value("line/evaluation_range", 1, -5e6),
        "line/evaluation_range does not ascend",
    ),
}

# Those after which no records of the steps can be read, as a table of these is missing.
WITHOUT_RECORDS = {"no times", "no forces", "no channels"}


@pytest.mark.parametrize("how", REFUSED)
def test_what_no_report_can_be_made_of_is_refused(how: str, copy: Path) -> None:
    damage, words = REFUSED[how]
    with h5py.File(copy, "r+") as file:
        unseal(file)
        damage(file)
    with pytest.raises(InputError) as refused:
        Results(copy)
    sentence = str(refused.value)
    assert sentence.startswith(f"{copy} is damaged: ") and "\n" not in sentence
    assert words in sentence
    assert sentence.endswith("run the case again")
    whole = "; its records up to t = 8.000 s are valid and can be read with h5py; for a report"
    assert (whole in sentence) == (how not in WITHOUT_RECORDS)


# Damage after which there is a report: what is told, and how many records are used.
USED: dict[str, tuple[Callable[[h5py.File], None], str, int]] = {
    "force of 1e156 N": (
        value("channels/contact_force", 700, 1e156),
        "record 700 on; 700 of 1601 records are valid; its records up to t = 3.495 s are valid",
        700,
    ),
    "force NaN": (value("channels/contact_force", 40, np.nan), "from record 40 on", 40),
    "time that jumps": (value("time", 900, 1.0), "time is damaged from record 900 on", 900),
    "dropper NaN": (
        value("line_channels/dropper_force", 9, np.nan),
        "line_channels/dropper_force is damaged from record 9 on",
        1601,
    ),
    "energies": (value("energy/kinetic", 3, 1e300), "energy/kinetic is damaged from", 1601),
    "title": (put("title", np.arange(3)), 'its attribute "title" is not text', 1601),
    "wall time": (put("march_wall_s", "long"), '"march_wall_s" is not a number of zero or', 1601),
    "outcome": (put("outcome", np.arange(3)), 'its attribute "outcome" is not text', 1601),
    "no rows told": (value("complete_rows", 0, 0), "0 of 1601 records are valid", 0),
    "more rows": (value("complete_rows", 0, 10**9), "complete_rows is damaged", 1601),
}


@pytest.mark.parametrize("how", USED)
def test_what_is_valid_is_used_and_the_rest_told(how: str, copy: Path, sound: Path) -> None:
    damage, words, n_rows = USED[how]
    with h5py.File(copy, "r+") as file:
        unseal(file)
        damage(file)
    with Results(copy) as results, Results(sound) as before:
        (sentence,) = results.damage
        assert before.damage == []
        assert sentence.startswith("run.h5 is damaged: ") and words in sentence
        assert results.time.size == n_rows
        force = results.channel("contact_force")
        np.testing.assert_array_equal(force, before.channel("contact_force")[:n_rows])
    report.write_summary(copy, copy.parent)
    assert words in (copy.parent / "summary.json").read_text().replace('\\"', '"')
    assert words in compare(sound, copy)


@pytest.mark.parametrize(
    "how", ["dropper NaN", pytest.param("force of 1e156 N", marks=pytest.mark.study)]
)
def test_a_report_is_drawn_around_the_damage(how: str, copy: Path) -> None:
    with h5py.File(copy, "r+") as file:
        USED[how][0](file)
    report.write_report(copy, copy.parent)
    assert "run.h5 is damaged: " in (copy.parent / "report.html").read_text()


def test_a_damaged_chunk_ends_its_own_channel_of_the_line(copy: Path, sound: Path) -> None:
    with h5py.File(copy) as file:
        info = file["line_channels/dropper_force"].id.get_chunk_info(3)
    spoil(copy, info.byte_offset + 100)
    with Results(copy) as results, Results(sound) as before:
        (sentence,) = results.damage
        assert "line_channels/dropper_force is damaged from record 200 on" in sentence
        assert results.line_time.size == before.line_time.size
        found, expected = (r.channel("dropper_force") for r in (results, before))
        assert np.isnan(found[200:]).all()
        np.testing.assert_array_equal(found[:200], expected[:200])
        np.testing.assert_array_equal(results.column("dropper_force", 3), found[:, 3])
        written = sum(values.size for _, _, values in results.written_blocks("dropper_force"))
        assert written == found[:200].size
        np.testing.assert_array_equal(*(r.channel("arm_uplift") for r in (results, before)))
        np.testing.assert_array_equal(  # they are kept apart
            results.extremes("dropper_force"), before.extremes("dropper_force")
        )


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (put("title", "Another"), "differs from its checksum"),
        (put("title", np.bytes_(b"\xff")), "cannot be read"),
        (removed("title"), "is missing"),
    ],
)
def test_a_damaged_title_takes_its_default(
    damage: Callable[[h5py.File], None], words: str, copy: Path
) -> None:
    with h5py.File(copy, "r+") as file:
        damage(file)
    with Results(copy) as results:
        (sentence,) = results.damage
        assert f'its attribute "title" {words}; its records up to t = 8.000 s' in sentence
        assert results.attributes["title"] == ""


def test_damaged_forces_end_the_record_before_them(copy: Path) -> None:
    with h5py.File(copy) as file:
        table = file["channels/contact_force"].id
        info = next(
            table.get_chunk_info(n)
            for n in range(table.get_num_chunks())
            if table.get_chunk_info(n).chunk_offset[0] == 2 * FLUSH
        )
    spoil(copy, info.byte_offset)
    with Results(copy) as results:
        assert results.time.size == 2 * FLUSH
        assert "its records up to t = 1.995 s are valid" in results.damage[0]


def spoil(path: Path, at: int) -> None:
    """Flip a bit of the byte at a place of a file."""
    with path.open("r+b") as file:
        file.seek(at)
        byte = file.read(1)[0]
        file.seek(at)
        file.write(bytes([byte ^ 4]))


@pytest.mark.parametrize("slot", ["0", "1"])
def test_the_valid_one_of_two_states_is_taken(
    slot: str, copy: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with h5py.File(copy, "r+") as file:
        latest = file["checkpoint"].attrs["latest"].decode()
        file[f"checkpoint/{slot}/state"][3] = np.nan
        steps = {name: int(group["step"][()]) for name, group in file["checkpoint"].items()}
    other = "1" if slot == "0" else "0"
    with Results(copy) as results, caplog.at_level("WARNING", "catenary.results"):
        state = results.checkpoint
    assert state["step"] == steps[other]
    assert (slot == latest) == bool(caplog.records)
    if caplog.records:
        assert "differs from its checksum; the one of step" in caplog.records[0].getMessage()


# A state that cannot be continued from, in both slots.
STATES: dict[str, tuple[str, Any, str]] = {
    "NaN": ("state", np.nan, "state holds NaN or infinity"),
    "step": ("step", -3, "it has no step"),
    "step beyond": ("step", 10**6, "it is of step 1000000, and the records before it end"),
}


@pytest.mark.parametrize("how", STATES)
def test_a_state_that_cannot_be_is_refused(how: str, copy: Path) -> None:
    name, number, words = STATES[how]
    with h5py.File(copy, "r+") as file:
        unseal(file)
        for slot in file["checkpoint"].values():
            slot[name][...] = number
    with Results(copy) as results, pytest.raises(InputError) as refused:
        results.checkpoint  # noqa: B018
    assert words in str(refused.value) and "start the run anew" in str(refused.value)


def test_a_state_without_the_records_before_it_is_refused(copy: Path) -> None:
    with h5py.File(copy, "r+") as file:
        file["complete_rows"][0] = 0
    with Results(copy) as results, pytest.raises(InputError, match="none of its records"):
        results.checkpoint  # noqa: B018


# Damage that once ended without a sentence, and whether checksums stand beside it.
@pytest.mark.parametrize(
    ("name", "sealed"),
    [
        ("attribute_crc32 = bytes", True),  # what tables a line has is not known then
        ("facts/time_step is more dimensions", False),
    ],
)
def test_damage_that_hides_other_damage_is_told(
    name: str, sealed: bool, copy: Path, tmp_path: Path
) -> None:
    every = [*attribute_mutations(copy), *dataset_mutations(copy)]
    (mutation,) = [one for one in every if one.name == name]
    with h5py.File(copy, "r+") as file:
        mutation.apply(file)
        if not sealed:
            unseal(file)
    with pytest.raises(InputError) as refused:
        report.write_summary(copy, tmp_path)
    assert "is damaged" in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize("sealed", [True, pytest.param(False, marks=pytest.mark.study)])
@pytest.mark.parametrize("mutations", [attribute_mutations, dataset_mutations])
def test_random_damage_is_told_in_a_sentence(
    mutations: Any, sealed: bool, sound: Path, tmp_path: Path
) -> None:
    every = list(mutations(sound))
    chosen = random.Random(SEED).sample(every, min(MUTATIONS, len(every)))
    path = tmp_path / "run.h5"
    told = 0
    for mutation in chosen:
        shutil.copy(sound, path)
        with h5py.File(path, "r+") as file:
            mutation.apply(file)
            if not sealed:
                unseal(file)
        try:
            report.write_summary(path, tmp_path)
            with Results(path) as results:
                results.checkpoint  # noqa: B018
        except InputError as error:
            assert "\n" not in str(error) and len(str(error)) < 1500, mutation.name
            told += 1
        except Exception as error:
            raise AssertionError(f"{mutation.name}, sealed: {sealed}") from error
    print(f"{told} of {len(chosen)} refused")
    assert told


def test_numbers_cover_most_of_a_file_and_tables_the_rest(sound: Path, copy: Path) -> None:
    """What the bit flips of test_fuzz_damage rest on."""
    covered = sum(end - begin for begin, end in raw_ranges(sound))
    assert 0.5 < covered / sound.stat().st_size < 1.0
    at = flip(copy, random.Random(SEED), tables=True)
    assert all(not begin <= at < end for begin, end in raw_ranges(sound))
    assert copy.read_bytes() != sound.read_bytes()


# --- extremes and checksums whose numbers have the shape of an array are damaged ones -------------


CHANNELS = ("arm_uplift", "dropper_force")


@pytest.fixture
def file(tmp_path: Path) -> h5py.File:
    with h5py.File(tmp_path / "a.h5", "w") as opened:
        yield opened


def extremes(value: float) -> dict[str, np.ndarray]:
    return {name: np.full((2, 3), value) for name in CHANNELS}


@pytest.mark.parametrize(
    "rows", [np.array([20]), np.array([20, 20]), np.array(20.0), np.array(b"20")]
)
def test_a_count_that_is_no_single_whole_number_counts_as_not_kept(
    file: h5py.File, rows: np.ndarray
) -> None:
    store_extremes(file, 10, extremes(1.0))
    store_extremes(file, 20, extremes(2.0))
    assert extremes_at(file, 20) is not None
    slot = file["extremes/1"]
    del slot[ROWS]
    slot[ROWS] = rows
    assert extremes_at(file, 20) is None
    kept = extremes_at(file, 10)
    assert kept is not None
    assert {name: values.max() for name, values in kept.items()} == dict.fromkeys(CHANNELS, 1.0)
    drop_extremes(file, 10)
    assert extremes_at(file, 10) is not None


def test_those_of_the_first_row_are_there_for_a_run_that_begins_again(file: h5py.File) -> None:
    # A run that broke before its state was renewed goes on from the start, before which no row is.
    store_extremes(file, 1, extremes(1.0))
    store_extremes(file, 20, extremes(2.0))
    drop_extremes(file, 0)
    kept = extremes_at(file, 0)
    assert kept is not None and kept["arm_uplift"].max() == 1.0


def test_a_checksum_of_another_shape_is_not_kept(file: h5py.File) -> None:
    group, arrays = file.create_group("some"), {"a": np.arange(3.0)}
    assert sum_is_kept(group, arrays) is None
    seal_arrays(group, arrays)
    assert sum_is_kept(group, arrays) is True
    assert sum_is_kept(group, {"a": np.arange(4.0)}) is False
    known = group.attrs[ARRAYS_SUM]
    for odd in (np.array([known]), np.array([known, known]), "text"):
        group.attrs[ARRAYS_SUM] = odd
        assert sum_is_kept(group, arrays) is False
