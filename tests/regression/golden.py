"""Golden numbers: mean and standard deviation of the contact force of every shortened case.

They hold the program still, they do not say that it is right; the other tests do. After a change
that is meant to move them, say so and why:

    python tests/regression/golden.py "damping of ac_simple from its source" ac_simple

writes the rows of the cases that are named, or of all cases if none is, into golden.csv with the
day and the reason.
"""

from __future__ import annotations

import csv
import sys
from datetime import date
from pathlib import Path

import catenary
from catenary.cases.scene.input.case_files import shipped

FILE = Path(__file__).with_name("golden.csv")
COLUMNS = ["case", "pantograph", "mean_N", "std_N", "date", "reason"]
ORIGIN = (
    "# Mean and standard deviation [N] of the 20 Hz contact force of every shipped case,\n"
    "# shortened by its [test] table, as this program found them on one rank. Made by golden.py.\n"
)


def read() -> list[dict[str, str]]:
    """All rows, empty if there is no file yet."""
    if not FILE.exists():
        return []
    lines = FILE.read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def write(rows: list[dict[str, str]]) -> None:
    """Replace the file."""
    with FILE.open("w", encoding="utf-8", newline="") as stream:
        stream.write(ORIGIN)
        writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def measure(case: str) -> list[dict[str, str]]:
    """Case, pantograph, mean and deviation of each pantograph of a shortened case."""
    return [
        {"case": case, "pantograph": found["name"]}
        | {name: f"{found[name]:.10g}" for name in ("mean_N", "std_N")}
        for found in catenary.run(catenary.load(case, short=True)).summary["pantographs"]
    ]


def refresh(reason: str, cases: list[str]) -> None:
    """Measure cases anew and replace their rows; drop rows of cases that are no more."""
    stamp = {"date": date.today().isoformat(), "reason": reason}
    kept = [row for row in read() if row["case"] in shipped() and row["case"] not in cases]
    made = [row | stamp for case in cases for row in measure(case)]
    write(sorted(kept + made, key=lambda row: row["case"]))


if __name__ == "__main__":
    if len(sys.argv) < 2 or not set(sys.argv[2:]) <= set(shipped()):
        sys.exit(f"{__doc__}\nCases: {', '.join(shipped())}")
    refresh(sys.argv[1], sys.argv[2:] or list(shipped()))
