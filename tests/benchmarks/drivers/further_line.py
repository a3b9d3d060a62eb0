"""Prints processor time that a further line takes in a sweep of statistics.

python further_line.py CASE [KEY=VALUE ...]

Variants differ in the tension of the contact wire. Sweeps of 8 and of 24 of them are run in turns,
and the difference of their least times is shared by 16: start, table and picture are in both.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from catenary.cases.scene.load import load_scene

FEW, MANY, TURNS = 8, 24, 3
KEY = "line.contact_wire.tension_N"


def processor_time(case: str, words: list[str], n: int, tension: float) -> float:
    """Processor time of a sweep of ``n`` variants [s]."""
    tensions = ",".join(f"{tension * (1.0 + 1e-3 * number):g}" for number in range(n))
    program = str(Path(sys.executable).parent / "catenary")
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "sweep", case, "-o", f"{folder}/sweep", "--only-statistics"]
        command += ["--vary", f"{KEY}={tensions}", *(["--set", *words] if words else [])]
        before = os.times()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        after = os.times()
    return sum(after[2:4]) - sum(before[2:4])


def main(case: str, *words: str) -> None:
    tension = load_scene(case, words).line.contact_wire.tension_N
    times: dict[int, list[float]] = {FEW: [], MANY: []}
    for _ in range(TURNS):
        for n, spent in times.items():
            spent.append(processor_time(case, list(words), n, tension))
    further = (min(times[MANY]) - min(times[FEW])) / (MANY - FEW)
    print(f"{case}: a further line takes {further:.3f} s of processor time")


if __name__ == "__main__":
    main(*sys.argv[1:])
