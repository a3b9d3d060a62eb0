"""What the READMEs of shipped cases claim of their own settings."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from program import catenary as called
from scenes import shipped

import catenary
from catenary.postproc.evaluate.statistics import contact_statistics

CASES = shipped()
# Rows of the table of windows in the README of EN 50318: mesh in the columns, misses in the cells.
NAMES = {
    "deviation": "std",
    "statistical minimum": "stat_min",
    "statistical maximum": "stat_max",
    "maximum": "maximum",
    "minimum": "minimum",
    "mean": "mean",
}
RANGES = {
    "mean": (110.0, 120.0),
    "std": (26.0, 31.0),
    "stat_max": (190.0, 210.0),
    "stat_min": (20.0, 40.0),
    "maximum": (175.0, 210.0),
    "minimum": (50.0, 75.0),
}


def claimed() -> dict[tuple[str, int], dict[str, tuple[float, int]]]:
    """Window and elements a gap -> what is said to miss its range: value and its decimals."""
    text = (CASES["en50318_2002"].parent / "README.md").read_text(encoding="utf-8")
    head, *rows = re.findall(r"^\| (?:250 km/h \| 5|spans) .*$", text, re.MULTILINE)
    meshes = [int(n) for n in re.findall(r"(\d+) elements", head)]
    found: dict[tuple[str, int], dict[str, tuple[float, int]]] = {}
    for row in rows:
        window, *cells = [cell.strip() for cell in row.strip("|").split("|")]
        for mesh, cell in zip(meshes, cells, strict=True):
            misses = re.findall(r"([a-z ]+?) ([\d.]+) (?:N|mm) \(", cell)
            found[window, mesh] = {
                NAMES.get(name.strip(), name.strip()): (
                    float(value),
                    len(value.partition(".")[2]),
                )
                for name, value in misses
            }
    return found


@pytest.mark.study
def test_the_windows_of_en50318_miss_what_its_readme_says() -> None:
    """One run a mesh serves all windows; uplifts, which are of the whole run, are left to one."""
    claims = claimed()
    meshes = sorted({mesh for _, mesh in claims})
    assert (len(claims), meshes) == (12, [5, 8, 12])
    longer = catenary.load("en50318_2002").replace(
        evaluation={"to_m": 840}, line={"n_spans": 30}, output={"field_every_s": 0}
    )
    for mesh in meshes:
        run = catenary.run(longer.replace(mesh={"elements_per_gap": mesh}))
        position, force, height = (
            run.channel(name).values[:, 0]
            for name in ("contact_position", "contact_force", "wire_height")
        )
        arms, uplift = run.uplift.steady_arm.values, run.uplift.largest.values
        for window in sorted({window for window, _ in claims}):
            first, last_span = (int(n) for n in re.findall(r"\d+", window))
            stretch = (60.0 * (first - 1), 60.0 * last_span)
            found = contact_statistics("one", position, force, height, 1e-3, stretch)
            values = {name: float(getattr(found, name)) for name in RANGES}
            misses = {
                name for name, (low, high) in RANGES.items() if not low <= values[name] <= high
            }
            within = (arms >= stretch[0]) & (arms <= stretch[1])
            values["uplift"] = 1e3 * float(uplift[within].max())
            if not 48.0 <= values["uplift"] <= 55.0:
                misses.add("uplift")
            print(f"{window}, {mesh} elements: misses {sorted(misses)}")
            assert misses == set(claims[window, mesh])
            for name, (value, decimals) in claims[window, mesh].items():
                assert values[name] == pytest.approx(value, abs=0.51 * 10**-decimals)


@pytest.mark.study
@pytest.mark.parametrize("speed", ["275", "320"])
def test_ac_simple_keeps_the_allowed_mean_force(speed: str, tmp_path: Path) -> None:
    words = ["--set", f"train.speed_km_h={speed}", "output.field_every_s=0"]
    done = called("run", "ac_simple", "-o", str(tmp_path / "out"), *words, cwd=tmp_path)
    assert done.code == 0, done.stderr
    assert "WARNING" not in done.stdout + done.stderr
    (line,) = [text for text in done.stdout.splitlines() if "mean contact force" in text]
    value, limit = (float(number) for number in re.findall(r"\d+\.\d+", line))
    print(line)
    assert line.split()[0] == "passed"
    assert 0.0 < limit - value < 0.5


@pytest.mark.study
@pytest.mark.parametrize("case", CASES)
def test_a_shipped_case_ends_without_a_warning(case: str, tmp_path: Path) -> None:
    """The first run of a newcomer: the case as it is shipped."""
    words = ["--set", "output.field_every_s=0"]
    done = called("run", case, "-o", str(tmp_path / "out"), *words, cwd=tmp_path)
    assert done.code == 0, done.stderr
    assert "WARNING" not in done.stdout + done.stderr
