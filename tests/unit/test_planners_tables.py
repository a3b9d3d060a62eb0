"""Tables of planners and of surveys of a line: what is read, and what is refused."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from scenes import Scene, line_data_of, load_scene, mesh_of, problem_of, read_draft, recorded

from catenary import InputError
from catenary.cases.run.arrivals import arrival_warnings
from catenary.cases.scene.checks.mesh_size import size_of

WITHOUT = (
    "line.dropper.positions_m=",
    "line.dropper.pre_sag_mm=",
    "line.n_spans=",
    "line.span_m=",
    "evaluation.from_m=330",
    "evaluation.to_m=660",
)
POSITIONS = [4.5, 10.25, 16.0, 21.75, 27.5, 33.25, 39.0, 44.75, 50.5]
PRE_SAG = [0.0, 24.0, 41.0, 52.0, 55.0, 52.0, 41.0, 24.0, 0.0]
N = 20


def droppers(n: int = N) -> str:
    rows = [
        f"{span},{x},{sag}"
        for span in range(1, n + 1)
        for x, sag in zip(POSITIONS, PRE_SAG, strict=True)
    ]
    return "\n".join(["span,position_m,pre_sag_mm", *rows]) + "\n"


def alike(n: int = N) -> str:
    return "span_m\n" + "55.0\n" * n


def load(folder: Path, files: dict[str, str], *more: str) -> Scene:
    """The case ac_simple with the tables of a planner."""
    for name, text in files.items():
        (folder / name).write_text(text)
    names = ("line.spans_file", "spans.csv"), ("line.dropper.patterns_file", "droppers.csv")
    named = [f"{key}={folder / file}" for key, file in names]
    return load_scene("ac_simple", [*WITHOUT, *named, *more])


def test_tables_make_the_same_line_as_keys(tmp_path: Path) -> None:
    by_keys = load_scene("ac_simple", [f"line.n_spans={N}", *WITHOUT[-2:]])
    by_files = load(tmp_path, {"spans.csv": alike(), "droppers.csv": droppers()})
    assert by_files.line.n_spans == N
    assert line_data_of(by_files) == line_data_of(by_keys)
    (pattern,) = by_files.line.dropper.patterns  # type: ignore[union-attr, misc]
    assert pattern.spans == list(range(1, N + 1))  # like spans stand together


@pytest.mark.parametrize(
    "text",
    [
        "span_m\n" + "55.5\n" * N,
        "\ufeff# of the planner\nspan;span_m\n" + "".join(f"{i};55,5\n" for i in range(1, N + 1)),
        'span_m,"span"\n' + "".join(f"55.5,{i} # mast {i}\n" for i in range(1, N + 1)),
    ],
    ids=["one column", "semicolons and decimal commas", "quotes and comments"],
)
def test_columns_may_be_separated_as_planners_do(tmp_path: Path, text: str) -> None:
    scene = load(tmp_path, {"spans.csv": text, "droppers.csv": droppers()})
    assert scene.line.span_m == [55.5] * N


def test_each_span_has_its_own_droppers(tmp_path: Path) -> None:
    own = droppers().replace("\n7,16.0,41.0", "\n7,17.0,43.0")
    scene = load(tmp_path, {"spans.csv": alike(), "droppers.csv": own})
    data = line_data_of(scene)
    assert data.dropper_positions[6][2] == 17.0 and data.pre_sag[6][2] == pytest.approx(0.043)
    others = [i for i in range(N) if i != 6]
    assert {data.dropper_positions[i] for i in others} == {tuple(POSITIONS)}
    # The size that is announced is that of the mesh, though lengths do not tell spans apart.
    size = size_of(scene)
    assert size is not None and size.nodes == mesh_of(scene).n_nodes


def test_a_result_needs_the_files_no_more(tmp_path: Path) -> None:
    scene = load(tmp_path, {"spans.csv": alike(), "droppers.csv": droppers()})
    (tmp_path / "spans.csv").unlink()
    (tmp_path / "droppers.csv").unlink()
    again = recorded(scene)
    assert problem_of(again) == problem_of(scene)


def test_fewer_spans_are_the_first_ones(tmp_path: Path) -> None:
    text = "span_m\n" + "".join(f"{50 + i % 2}\n" for i in range(N))
    own = droppers().replace(",50.5,0.0", ",44.9,0.0")
    shorter = load(tmp_path, {"spans.csv": text, "droppers.csv": own}, "line.n_spans=16")
    assert shorter.line.span_m == [50.0, 51.0] * 8
    patterns = shorter.line.dropper.patterns  # type: ignore[union-attr]
    assert patterns is not None and patterns[0].spans == list(range(1, 17))


def test_a_line_that_is_too_short_is_told_what_its_file_needs(tmp_path: Path) -> None:
    """A larger ``line.n_spans`` alone would be refused."""
    files = {"spans.csv": alike(12), "droppers.csv": droppers(12)}
    (warning,) = arrival_warnings(load(tmp_path, files, "evaluation.to_m=600"))
    n = int(re.search(r"Take a line\.spans_file of (\d+) spans", warning)[1])  # type: ignore[index]
    assert n > 12
    files = {"spans.csv": alike(n), "droppers.csv": droppers(n)}
    assert arrival_warnings(load(tmp_path, files, "evaluation.to_m=600")) == []


def test_files_beside_a_case_are_found_from_anywhere(tmp_path: Path) -> None:
    load(tmp_path, {"spans.csv": alike(), "droppers.csv": droppers()})
    case = Path(__file__).parents[2] / "cases" / "ac_simple" / "case.toml"
    text = case.read_text().replace("n_spans = 30\nspan_m = 55.0", 'spans_file = "spans.csv"')
    (tmp_path / "case.toml").write_text(text.split("[test]")[0].replace("1100.0", "900.0"))
    assert load_scene(tmp_path).line.n_spans == N
    table = read_draft(tmp_path).table()
    assert table["line"]["spans_file"] == str(tmp_path / "spans.csv")


@pytest.mark.parametrize(
    ("file", "text", "sentence"),
    [
        ("spans.csv", "55\n55\n", 'its column "55" is unknown: it takes span_m, span'),
        ("spans.csv", "span\n1\n", "it has no column span_m: its first line names the columns"),
        ("spans.csv", "spam_m\n55\n", "did you mean span_m?"),
        ("spans.csv", "length_m\n55\n", 'its column "length_m" is unknown: it takes span_m, span'),
        ("spans.csv", "span_m\n", "it holds no line of numbers below the names of columns"),
        ("spans.csv", "span_m\n55\n60 m\n", 'a number for each of span_m, and is "60 m"'),
        ("spans.csv", "span_m\n55,5\n60\n", 'and is "55,5": write decimal points, or semicolons'),
        ("spans.csv", 'span,span_m\n1,"55,5"\n', "write decimal points, or semicolons or tabs"),
        ("spans.csv", 'span,span_m\n"1,55"\n', "write decimal points, or semicolons or tabs"),
        ("spans.csv", "span_m\n55\nnan\n", "its line 3 must hold a number for each of span_m"),
        ("spans.csv", "span,span_m\n1,55\n3,55\n", "its line 3 must be about span 2"),
        ("spans.csv", "span_m,span_m\n55,55\n", "it has several columns span_m"),
        ("spans.csv", "span_m\n55\n900\n" + "55\n" * (N - 2), "line.span_m.1 is 900"),
        (
            "droppers.csv",
            "span,position_m\n2,5\n1,5\n",
            "its line 3 must have the number of a span",
        ),
        ("droppers.csv", "span,position_m\n1.5,5\n", "has 1.5"),
        (
            "droppers.csv",
            "span,position_m\n1,5\n1,5\n",
            "its line 3 must have a position greater than the 5 m of the dropper before it",
        ),
        ("droppers.csv", "span,position_m,length_m\n1,5,1.1\n", "it takes no length_m"),
        (
            "droppers.csv",
            "span,position_m,pre_sag_mm\n1,5,0\n1,20,0.05\n1,45,0.01\n",
            "its largest pre_sag_mm is 0.05: is it 0.05 m? write 50",
        ),
        ("droppers.csv", "span,position_m\n1,5\n", "has no entry for span 2; it has 1 span"),
        (
            "droppers.csv",
            droppers().replace("\n3,50.5,", "\n3,56.0,"),
            "puts a dropper of span 3 at 56 m",
        ),
        (
            "droppers.csv",
            droppers() + "99,5.0,0\n",
            f"it has droppers of span 99, and line.spans_file has {N} spans",
        ),
    ],
)
def test_a_table_that_is_none_is_refused(
    tmp_path: Path, file: str, text: str, sentence: str
) -> None:
    files = {"spans.csv": alike(), "droppers.csv": droppers()} | {file: text}
    with pytest.raises(InputError) as refused:
        load(tmp_path, files)
    assert sentence in str(refused.value)
    assert "line.n_spans" not in str(refused.value)


def test_more_spans_than_the_file_has_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="it has 20 spans, and line.n_spans is 30: leave that out"):
        load(tmp_path, {"spans.csv": alike(), "droppers.csv": droppers()}, "line.n_spans=30")


def test_lengths_stand_in_a_file_or_in_the_scene(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="line.span_m is given too: take one of them away"):
        load(tmp_path, {"spans.csv": alike(), "droppers.csv": droppers()}, "line.span_m=55.0")


def patterns(*entries: str) -> list[str]:
    keys = ["line.dropper.positions_m=", "line.dropper.pre_sag_mm="]
    return [*keys, f"line.dropper.patterns=[{','.join(entries)}]"]


def test_a_number_goes_before_a_length() -> None:
    most, one = "{span_m=55.0,positions_m=[5.0,50.0]}", "{spans=[3],positions_m=[10.0,20.0,45.0]}"
    places = line_data_of(load_scene("ac_simple", patterns(most, one))).dropper_positions
    assert places[2] == (10.0, 20.0, 45.0)
    assert {*places[:2], *places[3:]} == {(5.0, 50.0)}


def test_spans_in_which_the_wire_rises_sag_only_by_their_own_numbers() -> None:
    """What holds for all spans, or for those of a length, holds where the wire is level."""
    places = "positions_m=[5.0,27.5,50.0],pre_sag_mm=[0.0,30.0,0.0]"
    every, one = f"{{span_m=55.0,{places}}}", f"{{spans=[2,30],{places}}}"
    rising = ["line.transition.n_spans_start=2", "line.transition.n_spans_end=1"]
    rising.append("line.transition.rise_m=0.3")
    sags = line_data_of(load_scene("ac_simple", [*patterns(every, one), *rising])).pre_sag
    level, own = (0.0, 0.0, 0.0), (0.0, 0.03, 0.0)
    assert sags == (level, own, *[own] * 27, own)


@pytest.mark.parametrize(
    ("entries", "sentence"),
    [
        (["{positions_m=[5.0]}"], "exactly one of span_m, spans, but none is given"),
        (["{span_m=55.0,spans=[1],positions_m=[5.0]}"], "span_m and spans are given"),
        (
            ["{spans=[1,2],positions_m=[5.0]}", "{spans=[2],positions_m=[6.0]}"],
            "must have one pattern for span 2, not several",
        ),
        (
            ["{span_m=55.0,positions_m=[5.0]}", "{spans=[31],positions_m=[6.0]}"],
            "line.dropper.patterns.1.spans is 31",
        ),
    ],
)
def test_patterns_that_contradict_each_other_are_refused(entries: list[str], sentence: str) -> None:
    with pytest.raises(InputError) as refused:
        load_scene("ac_simple", patterns(*entries))
    assert sentence in str(refused.value)


SURVEY = {
    "heights.csv": "# against plan\nplace_m;height_mm\n0,0;0\n330,0;12,5\n385;-8,0\n1650;0\n",
    "errors.csv": "span,dropper,error_mm\n7,3,4.0\n7,4,-3.0\n",
}
SURVEYED = (
    ("irregularities.contact_wire_height.by_place_file", "heights.csv"),
    ("irregularities.dropper_lengths.by_dropper_file", "errors.csv"),
)


def surveyed(folder: Path, **changed: str) -> Scene:
    """The case ac_simple as a survey found it; ``changed`` are contents by names of tables."""
    for name, text in SURVEY.items():
        (folder / name).write_text(changed.get(name.removesuffix(".csv"), text))
    return load_scene("ac_simple", [f"{key}={folder / file}" for key, file in SURVEYED])


def test_a_survey_is_the_line_of_its_numbers(tmp_path: Path) -> None:
    scene = surveyed(tmp_path)
    pairs = "[[0.0,0.0],[330.0,0.0125],[385.0,-0.008],[1650.0,0.0]]"
    by_keys = load_scene(
        "ac_simple",
        [
            f"irregularities.contact_wire_height.by_place={pairs}",
            "irregularities.dropper_lengths.by_dropper=[[7,3,4.0],[7,4,-3.0]]",
        ],
    )
    assert problem_of(scene) == problem_of(by_keys)
    assert problem_of(scene) != problem_of(load_scene("ac_simple"))
    by_tabs = {name: text.replace(",", "\t") for name, text in SURVEY.items() if ";" not in text}
    assert problem_of(surveyed(tmp_path, errors=by_tabs["errors.csv"])) == problem_of(by_keys)
    for _, file in SURVEYED:
        (tmp_path / file).unlink()
    again = recorded(scene)
    assert problem_of(again) == problem_of(scene)


@pytest.mark.parametrize(
    ("file", "text", "told"),
    [
        ("heights", "place_m,height_m\n0,0\n9,0.01\n", 'its column "height_m" is unknown'),
        ("heights", "place_m,height_mm\n0,0\n330,ten\n", "its line 3 must hold a number for each"),
        ("heights", "place_m,height_mm\n0,0\n330,1080\n", "within 0.5 m, but is 1.08"),
        ("heights", "place_m,height_mm\n330,0\n0,10\n", "in ascending order"),
        ("heights", "place_m,height_mm\n0,0\n1700,10\n", "the line runs from 0 to 1650 m"),
        ("errors", "span,error_mm\n7,4.0\n", "it has no column dropper"),
        ("errors", "span,dropper,error_mm\n7,30,4.0\n", "span 7 has 9 droppers"),
        (
            "errors",
            "span;dropper;error_mm\n7;3;4,0\n7;4;1,0\n7;3;5,0\n",
            "line 4 is about dropper 3 of span 7, as line 2 is",
        ),
        ("errors", "span,dropper,error_mm\n7.5,3,4.0\n", "line 2 must have a span from 1 on"),
    ],
)
def test_a_survey_that_does_not_fit_is_told(
    tmp_path: Path, file: str, text: str, told: str
) -> None:
    with pytest.raises(InputError) as raised:
        surveyed(tmp_path, **{file: text})
    assert told in str(raised.value) and f"{file}.csv" in str(raised.value)
