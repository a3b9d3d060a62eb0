"""A wire that leaves a strip is told of under way, judged, and stands in summary and report."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path

import numpy as np
import pytest
from program import catenary

from catenary import open as open_run

pytestmark = pytest.mark.usefixtures("examined_here")

# Strips that end a millimetre beyond the wire in still air, which is 200 mm beside their middle at
# every mast; the wind blows it off.
HALF, SCENE = 0.201, (
    "line.n_spans=6",
    "mesh.elements_per_gap=2",
    "train.start_m=82.5",
    "train.end_m=200",
    "line.contact_wire.diameter_mm=14.4",
    "line.messenger_wire.diameter_mm=14.0",
    "wind={speed_m_per_s=30,direction_deg=90,height_m=6,roughness_length_m=0.05}",
    "train.raise_time_s=0.1",
    "evaluation.from_m=120",
    "evaluation.to_m=180",
    f"pantographs.three_masses.strips={{length_m={2 * 0.201}}}",
)  # fmt: skip


def test_a_wire_that_leaves_a_strip_is_named_everywhere(tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ("run", "ac_simple_3d", "-o", str(out), "--set", *SCENE)
    done = catenary(*words, cwd=tmp_path, pictures=True)
    assert done.code == 0, done.stderr
    with open_run(out) as run:
        place = np.nan_to_num(run.channel("lateral_place")[:, 0])
        time, x = run.force.time.values, run.force.position.values[:, 0]
    beyond = np.abs(place) > HALF
    first = int(np.argmax(beyond))
    assert 0 < first and 0 < np.count_nonzero(beyond) < 0.5 * beyond.size
    where = f"{time[first]:.4g} s, {x[first]:.4g} m"

    # Once, under way.
    told = [line for line in done.stderr.splitlines() if "leaves the strips" in line]
    assert len(told) == 1 and f"of the pantograph at {where}" in told[0]
    assert f"they end {HALF:.3g} m beside their middle" in told[0]

    summary = json.loads((out / "summary.json").read_text())
    (own,) = summary["lateral"]
    assert own["left_strip_s"] == time[first] and own["left_strip_at_m"] == x[first]
    farthest = int(np.abs(place).argmax())
    assert own["max_place_mm"] == 1e3 * place[farthest] and own["time_s"] == time[farthest]
    assert own["strip_half_length_mm"] == 1e3 * HALF
    criterion = "lateral position of the contact wire on the strips"
    (judged,) = [row for row in summary["acceptance"] if row["criterion"] == criterion]
    assert judged["passed"] is False and judged["value"] == abs(own["max_place_mm"])
    assert judged["limit"] == 1e3 * HALF and summary["passed"] is False

    page = re.sub(r"\s+", " ", html.unescape((out / "report.html").read_text()))
    assert f"At {where}, a contact wire leaves the strips of the pantograph" in page
    assert criterion in page
