"""A sweep: what it writes, that it goes on where it was, variants that break, bad input."""

from __future__ import annotations

import csv
import json
import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure
from measuring import COMM
from scenes import TINY_WORDS, with_words
from verb_runner import invoke

import catenary
from catenary import InputError
from catenary.cases.result_folder import output_folder
from catenary.cases.result_folder.folder_lock import FolderLock
from catenary.cases.run.needs import needs_before_meshing
from catenary.cases.run.runner import run_case
from catenary.cases.studies.records import read_record
from catenary.cases.studies.sweep.jobs import STATISTICS, Ended, Job, RunOptions, make_jobs
from catenary.cases.studies.sweep.output import (
    as_text,
    draw_statistics,
    files_of,
    key_in_words,
    table_of,
)
from catenary.cases.studies.sweep.run_jobs import read_summary, run_jobs
from catenary.cases.studies.sweep.sweep import refuse_other_sweep
from catenary.cases.studies.sweep.variants import Variant, parse_vary, product
from catenary.cases.studies.sweeps import merge
from catenary.postproc.read.results import Results
from catenary.postproc.report.study_table import write_files

pytestmark = pytest.mark.usefixtures("quick_reports")

CASE = "en50318_2002"
VARIED = "train.speed_km_h=250,300"
# A wire that is to rise towards mid-span pushes on its droppers: found at the equilibrium.
SLACK = "line.dropper.pre_sag_mid_mm=-100"


def tiny(*variants: Variant) -> list[Job]:
    return make_jobs(CASE, variants or product([parse_vary(VARIED)], {}), TINY_WORDS)


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder of a sweep of two speeds and what the command line said."""
    out = tmp_path_factory.mktemp("swept") / "out"
    hook = sys.excepthook
    done = invoke("sweep", CASE, "-o", str(out), "--vary", VARIED, "--set", *TINY_WORDS)
    sys.excepthook = hook
    assert done.exit_code == 0, done.output
    return out, done.stdout


def test_each_variant_has_its_run_and_a_row(swept: tuple[Path, str]) -> None:
    out, said = swept
    with (out / "sweep.csv").open() as file:
        table = list(csv.DictReader(file))
    names = ["speed_km_h_250", "speed_km_h_300"]
    assert [row["variant"] for row in table] == names
    assert [row["train.speed_km_h"] for row in table] == ["250", "300"]
    for row in table:
        summary = json.loads((out / row["variant"] / "summary.json").read_text())
        for name in ("mean_N", "std_N"):
            assert float(row[name]) == summary["pantographs"][0][name] and len(row[name]) > 12
        assert summary["speed_km_h"] == pytest.approx(float(row["train.speed_km_h"]))
        assert not (out / row["variant"] / "report.html").exists()
        assert f"{summary['pantographs'][0]['std_N']:.1f}" in said
        with Results(out / row["variant"]) as results:
            assert results.complete
    assert table[0]["std_N"] != table[1]["std_N"]
    record = json.loads((out / "sweep.json").read_text())
    assert [row["variant"] for row in record["rows"]] == names
    assert (out / "sweep.png").read_bytes().startswith(b"\x89PNG")


def test_a_variant_is_the_run_of_the_same_scene(swept: tuple[Path, str]) -> None:
    variant = tiny()[1].variant
    alone = catenary.run(with_words(CASE, (*TINY_WORDS, *variant.assignments)))
    with catenary.open(swept[0] / variant.name) as one:
        assert (alone.force == one.force).all()


DAMAGED: dict[str, tuple[str, str, str]] = {
    "half a summary": ("summary.json", "{", "["),
    "a summary with text": ("summary.json", '"std_N": ', '"std_N": "much", "x": '),
    "a summary without uplift": ("summary.json", '"max_uplift_mm"', '"other"'),
    "a record of other figures": ("variant.json", '"wall_s": ', '"wall_s": 1'),
    "a record without a checksum": ("variant.json", '"crc32"', '"other"'),
}


@pytest.mark.parametrize("how", DAMAGED)
def test_what_an_earlier_variant_left_damaged_is_told(
    how: str, swept: tuple[Path, str], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    name, before, after = DAMAGED[how]
    record = read_record(swept[0] / "speed_km_h_250" / "variant.json")
    assert record is not None
    file = tmp_path / name
    text = (swept[0] / "speed_km_h_250" / name).read_text()

    def read(path: Path) -> object:
        return read_summary(path, record) if name == "summary.json" else read_record(path)

    file.write_text(text)
    assert read(file)
    assert before in text
    file.write_text(text.replace(before, after, 1))
    with caplog.at_level("WARNING", "catenary.sweep"):
        assert read(file) is None
    (told,) = caplog.records
    assert told.getMessage() == f"{file} is damaged: its part of the study is repeated"


def test_what_is_done_is_not_run_again(swept: tuple[Path, str]) -> None:
    out, _ = swept
    first, second = out / "speed_km_h_250", out / "speed_km_h_300"
    before = (first / "run.h5").stat().st_mtime_ns
    figures = (out / "sweep.csv").read_text().splitlines()[2].split(",")[4:-1]
    (second / "variant.json").unlink()  # as a kill leaves it
    again = invoke("sweep", CASE, "-o", str(out), "--vary", VARIED, "--set", *TINY_WORDS)
    assert again.exit_code == 0, again.output
    assert "[1/2] speed_km_h_250: done already" in again.stdout
    assert "[2/2] speed_km_h_300\n" in again.stdout
    assert (first / "run.h5").stat().st_mtime_ns == before
    assert (out / "sweep.csv").read_text().splitlines()[2].split(",")[4:-1] == figures


def test_further_values_join_a_sweep_and_other_ones_are_refused(swept: tuple[Path, str]) -> None:
    out, _ = swept
    other = invoke(
        "sweep", CASE, "-o", str(out), "--vary", "train.speed_km_h=275", "--set", *TINY_WORDS
    )  # fmt: skip
    assert other.exit_code == 2
    assert "a sweep with other variants (speed_km_h_250)" in other.stderr
    assert not (out / "speed_km_h_275").exists()


def test_another_configuration_is_not_overwritten_without_force(tmp_path: Path) -> None:
    variant = Variant("one", ())
    run_jobs(tiny(variant), tmp_path, COMM)
    before = (tmp_path / "one" / "summary.json").read_text()
    changed = make_jobs(CASE, [variant], [*TINY_WORDS, "contact.stiffness_N_per_m=2e4"])
    with pytest.raises(InputError, match="another configuration"):
        run_jobs(changed, tmp_path, COMM)
    assert (tmp_path / "one" / "summary.json").read_text() == before
    (ended,) = run_jobs(changed, tmp_path, COMM, RunOptions(force=True))
    assert ended.done and not ended.skipped
    assert (tmp_path / "one" / "summary.json").read_text() != before


def test_a_run_of_its_own_is_not_overwritten(tmp_path: Path) -> None:
    (other,) = make_jobs(CASE, [Variant("one", ())], [*TINY_WORDS, "numerics.dt_s=0.01"])
    run_case(other.scene, tmp_path / "one", COMM, only_summary=True)
    with pytest.raises(InputError, match="the results of another run"):
        run_jobs(tiny(Variant("one", ())), tmp_path, COMM)


def test_a_variant_that_breaks_does_not_stop_the_others(tmp_path: Path) -> None:
    named = tmp_path / "variants.toml"
    named.write_text(f'slack = ["{SLACK}"]\nsound = []\n')
    out = tmp_path / "out"
    done = invoke(
        "sweep", CASE, "-o", str(out), "--variants", str(named),
        "--set", *TINY_WORDS,
    )  # fmt: skip
    assert done.exit_code == 1, done.output
    assert "1 of 2 variants broke: slack (the dropper in span" in done.stderr
    assert "would be slack at rest" in done.stderr
    with (out / "sweep.csv").open() as file:
        slack, sound = csv.DictReader(file)
    assert "would be slack at rest" in slack["outcome"] and slack["std_N"] == ""
    assert sound["outcome"] == "done" and float(sound["std_N"]) > 0


def test_a_sweep_whose_variants_all_break_still_has_its_table(tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = invoke(
        "sweep", CASE, "-o", str(out), "--vary", SLACK.replace("=", "=-90,"), "--set", *TINY_WORDS
    )  # fmt: skip
    assert done.exit_code == 1
    assert "2 of 2 variants broke" in done.stderr
    assert {path.name for path in out.iterdir()} - {"sweep.parquet"} == {"sweep.csv", "sweep.json"}


def test_measures_are_taken_and_results_dropped_on_request(tmp_path: Path) -> None:
    (job,) = tiny(Variant("one", ()))
    slim = Job(job.variant, job.scene, keep_results=False)

    def measure(results: Results) -> dict[str, Any]:
        return {"n_steps": results.n_steps}

    (first,) = run_jobs([slim], tmp_path, COMM, measure=measure)
    assert first.measured == {"n_steps": first.summary["n_steps"]}
    assert not (tmp_path / "one" / "run.h5").exists()
    (second,) = run_jobs([slim], tmp_path, COMM, measure=measure)
    assert second.skipped and second.measured == first.measured
    (third,) = run_jobs([job], tmp_path, COMM, measure=measure)  # now the file is wanted
    assert not third.skipped and (tmp_path / "one" / "run.h5").exists()


def test_reports_are_written_on_request(tmp_path: Path) -> None:
    (plain,) = tiny(Variant("one", ()))
    job = replace(plain, full_report=True)
    run_jobs([plain], tmp_path, COMM)
    assert not (tmp_path / "one" / "report.html").exists()
    (ended,) = run_jobs([job], tmp_path, COMM)  # done before, but without its report
    assert not ended.skipped
    assert (tmp_path / "one" / "report.html").exists()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ([], "there is nothing to vary"),
        (["--vary", "train.sped_km_h=1,2"], "did you mean train.speed_km_h?"),
        (["--vary", "train.speed_km_h=250,-3"], "variant speed_km_h_-3: train.speed_km_h is -3"),
        (["--vary", "train.speed_km_h"], "must have the form"),
        (["--vary", "train.speed_km_h=1", "--plot", "sdt_N"], "did you mean std_N?"),
        (["--variants", "nowhere.toml"], "nowhere.toml cannot be read"),
        (["--vary", "train.speed_km_h=250", "fast"], "neither key=value nor"),
    ],
)
def test_bad_input_is_one_sentence_and_writes_nothing(
    words: list[str], sentence: str, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    done = invoke("sweep", CASE, "-o", str(out), *words)
    assert done.exit_code == 2
    assert sentence in done.stderr
    assert done.stderr.count("\n") == 1
    assert not out.exists()


def test_a_variant_that_is_refused_breaks_alone(tmp_path: Path) -> None:
    vary = "line.dropper.pre_sag_mid_mm=20,0.04,30"
    words = ["sweep", CASE, "-o", str(tmp_path / "out"), "--vary", vary, "--set", *TINY_WORDS]
    done = invoke(*words)
    assert done.exit_code == 1, done.output
    why = "is it 0.04 m? write 40, or case.accept_unusual = true if it is meant"
    assert why in done.stderr.splitlines()[0]
    assert "1 of 3 variants broke: pre_sag_mid_mm_0.04" in done.stderr.splitlines()[-1]
    with (tmp_path / "out" / "sweep.csv").open(encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert [row["outcome"] == "done" for row in table] == [True, False, True]
    assert why in table[1]["outcome"] and table[1]["std_N"] == ""
    meant = invoke(*words, "case.accept_unusual=true", "--force")
    assert meant.exit_code == 0, meant.output


def test_a_folder_that_cannot_be_made_is_refused_before_anything_is_run(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match="cannot be made or written to"):
        run_jobs(tiny(), tmp_path / "file" / "out", COMM)


def test_results_in_place_of_a_file_are_refused(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine")
    done = invoke("sweep", CASE, "-o", str(tmp_path / "out"), "--vary", VARIED)
    assert done.exit_code == 2
    assert "is a file" in done.stderr


def fake(name: str, varied: dict[str, str], *sigmas: float | None) -> Ended:
    """A variant that is done with one pantograph for each standard deviation."""
    people = ["leading", "trailing"]
    pantographs = [
        {**dict.fromkeys(STATISTICS, 1.0), "name": people[i], "std_N": sigma, "loss_percent": 0.0}
        for i, sigma in enumerate(sigmas)
    ]
    acceptance = [
        {"criterion": "mean contact force", "passed": True},
        {"criterion": "maximum contact force", "passed": name != "hard250"},
        {"criterion": "arcing NQ", "passed": None},
    ]
    summary = {
        "pantographs": pantographs,
        "supports": {"max_uplift_mm": 5.0},
        "acceptance": acceptance,
        "passed": name != "hard250",
    }
    return Ended(Variant(name, (), varied), "done", summary)


def test_rows_have_one_line_per_pantograph_and_one_per_broken_variant() -> None:
    ended = [fake("a", {"k": "1"}, 10.0, None), Ended(Variant("b", (), {"k": "2"}), "it broke")]
    table = table_of(ended).records()
    assert [(row["variant"], row["k"], row["pantograph"]) for row in table] == [
        ("a", 1, "leading"), ("a", 1, "trailing"), ("b", 2, ""),
    ]  # fmt: skip
    assert [row["std_N"] for row in table] == [10.0, None, None]
    assert "BROKE: it broke" in as_text(ended)


def test_names_of_criteria_that_failed_are_told_apart() -> None:
    """Their names have commas."""
    one = fake("a", {"k": "1"}, 10.0)
    names = ["standard deviation, 0.3 of the mean", "arcing NQ"]
    one.summary["acceptance"] = [{"criterion": name, "passed": False} for name in names]
    one.summary["passed"] = False
    assert f"FAILED {'; '.join(names)}" in as_text([one])


def test_each_row_names_its_variant_where_keys_are_varied_beside_named_ones(
    tmp_path: Path,
) -> None:
    variants = product([parse_vary("train.speed_km_h=200,300")], {"soft": [], "hard": []})
    ended = [replace(fake("", {}, float(n)), variant=one) for n, one in enumerate(variants, 1)]
    rows = table_of(ended).records()
    assert [(row["variant"], row["named"], row["train.speed_km_h"]) for row in rows] == [
        ("soft__speed_km_h_200", "soft", 200), ("soft__speed_km_h_300", "soft", 300),
        ("hard__speed_km_h_200", "hard", 200), ("hard__speed_km_h_300", "hard", 300),
    ]  # fmt: skip
    # The parts of a job array, which share names in the file.
    for name, part in (("a", ended[::2]), ("b", ended[1::2])):
        write_files(tmp_path / name, files_of(CASE, part, None))
    merged = merge([tmp_path / "a", tmp_path / "b"]).record
    by_name = {row["variant"]: row["std_N"] for row in merged["rows"]}
    assert by_name == {one.variant.name: float(n) for n, one in enumerate(ended, 1)}
    assert {one["name"] for one in merged["variants"]} == set(by_name)


def curves_of(figure: Figure) -> dict[str, list[tuple[float, float]]]:
    """Points of the curves in a figure's first panel, by label."""
    return {
        str(line.get_label()): [(float(x), float(y)) for x, y in line.get_xydata()]
        for line in figure.axes[0].get_lines()
    }


def test_statistics_are_drawn_over_the_key_with_numbers() -> None:
    ended = [
        fake(f"{law}{speed}", {"contact.law": law, "train.speed_km_h": speed}, 1.0 * int(speed))
        for law in ("hard", "soft")
        for speed in ("300", "200")
    ]
    keys, shown = ["contact.law", "train.speed_km_h"], ["std_N", "max_uplift_mm"]
    figure = draw_statistics(table_of(ended).rows, keys, shown)
    assert curves_of(figure) == {
        "leading, law hard": [(200.0, 200.0), (300.0, 300.0)],
        "leading, law soft": [(200.0, 200.0), (300.0, 300.0)],
    }
    looks = [(line.get_marker(), line.get_linestyle()) for line in figure.axes[0].get_lines()]
    assert looks == [("o", "-"), ("s", "--")]  # a print without colours tells them apart
    assert figure.axes[1].get_xlabel() == "train speed [km/h]"
    assert figure.axes[0].get_ylabel() == "standard deviation,\n0-20 Hz [N]"
    assert figure.axes[1].get_ylabel() == "largest uplift at\narms [mm]"


def test_words_stand_on_the_axis_where_no_key_has_numbers() -> None:
    ended = [fake("a", {"contact.law": "hard"}, 3.0), fake("b", {"contact.law": "soft"}, 4.0)]
    figure = draw_statistics(table_of(ended).rows, ["contact.law"], ["std_N"])
    assert curves_of(figure) == {"leading": [(0.0, 3.0), (1.0, 4.0)]}
    assert [label.get_text() for label in figure.axes[0].get_xticklabels()] == ["hard", "soft"]


def test_varied_values_keep_their_types(tmp_path: Path) -> None:
    """Numbers, truth values, words and lists in JSON; plain text in CSV."""
    varied = {
        "train.speed_km_h": "250", "numerics.dt_s": "5e-4", "effects.head_roll": "true",
        "contact.law": "hertz", "line.span_m": "[50, 60]",
    }  # fmt: skip
    one = fake("a", varied, 3.0)
    write_files(
        tmp_path,
        files_of(CASE, [replace(one, variant=replace(one.variant, named="007"))], ["std_N"]),
    )
    (row,) = json.loads((tmp_path / "sweep.json").read_text())["rows"]
    assert [row[key] for key in varied] == [250, 5e-4, True, "hertz", [50, 60]]
    assert row["named"] == "007"
    assert type(row["train.speed_km_h"]) is int
    (cells,) = csv.DictReader((tmp_path / "sweep.csv").read_text().splitlines())
    assert [cells[key] for key in varied] == ["250", "0.0005", "true", "hertz", "[50, 60]"]
    assert cells["named"] == "007"


def test_what_failed_is_told_by_name(tmp_path: Path) -> None:
    ended = [fake("hard250", {"k": "1"}, 3.0), fake("b", {"k": "2"}, 3.0)]
    failed, passed = table_of(ended).records()
    assert failed["failed"] == ["maximum contact force"] and not failed["passed"]
    assert passed["failed"] == [] and passed["passed"]
    said = as_text(ended).splitlines()
    assert said[1].endswith("FAILED maximum contact force") and said[2].endswith("passed")
    write_files(tmp_path, files_of(CASE, ended, ["std_N"]))
    first, second = csv.DictReader((tmp_path / "sweep.csv").read_text().splitlines())
    assert (first["failed"], second["failed"]) == ("maximum contact force", "")


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("line.contact_wire.tension_N", "contact wire: tension [N]"),
        ("contact.stiffness_N_per_m", "contact: stiffness [N/m]"),
        ("pantographs.lumped.static_force_N", "lumped: static contact force [N]"),
        ("mesh.elements_per_gap", "mesh: elements per gap"),
        ("named", "named"),
    ],
)
def test_axes_are_in_the_fields_words(key: str, words: str) -> None:
    assert key_in_words(key) == words


def test_every_statistic_has_words_with_a_unit() -> None:
    meanings = [column.meaning for column in STATISTICS.values()]
    assert all(words.endswith("]") and "_" not in words for words in meanings)


def test_a_sweep_without_room_for_all_its_runs_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each alone has room."""
    jobs = tiny()
    sizes = [needs_before_meshing(job.scene) for job in jobs]
    (one, other) = (size.files.result + size.files.film for size in sizes if size is not None)
    room = [0.9 * (one + other)]
    monkeypatch.setattr(output_folder, "free_bytes", lambda folder: room[0])
    with pytest.raises(InputError, match="there is no room for the results"):
        run_jobs(jobs, tmp_path / "out", COMM)
    assert not list(tmp_path.rglob("run.h5"))
    # Of runs whose result files do not stay only one at a time takes room.
    passing = [replace(job, keep_results=False) for job in jobs]
    room[0] = 1.5 * max(one, other) + 2e6  # and a report, by which a run alone is judged
    assert [end.outcome for end in run_jobs(passing, tmp_path / "out", COMM)] == ["done", "done"]


@pytest.mark.parametrize("text", ["[" * 5000, '{"variants": [{"name": 3}, 4]}', "{"])
def test_a_table_that_no_sweep_wrote_names_no_variants(text: str, tmp_path: Path) -> None:
    (tmp_path / "sweep.json").write_text(text)
    refuse_other_sweep(tmp_path, [], False)


def test_a_pipe_in_place_of_a_record_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "variant.json")
    assert read_record(tmp_path / "variant.json") is None


def test_parts_in_one_folder_merge_where_no_sweep_runs(tmp_path: Path) -> None:
    """A sweep under way would replace the merged table when it ends."""
    variants = product([parse_vary("train.speed_km_h=200,300")], {})
    for number, one in enumerate(variants, 1):
        part = [replace(fake("", {}, float(number)), variant=one)]
        write_files(tmp_path / "all" / f"part_{number}_of_2", files_of(CASE, part, None))
    words = ["merge", str(tmp_path / "all"), "-o", str(tmp_path / "out")]
    lock = FolderLock(tmp_path / "out", "catenary sweep")
    try:
        refused = invoke(*words)
        assert refused.exit_code == 2 and "is in use by process" in refused.stderr
        assert not (tmp_path / "out" / "sweep.csv").exists()
    finally:
        lock.release()
    done = invoke(*words)
    assert done.exit_code == 0 and "2 variants" in done.stdout, done.output
    assert sorted(path.name for path in (tmp_path / "out").iterdir() if path.name[0] == ".") == []
