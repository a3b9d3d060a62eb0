"""Runs ``catenary run`` in this process and prints a line of JSON: processor time by part [s].

python whole_run.py CASE -o DIR [...]: the words of ``catenary run``.
"""

from __future__ import annotations

import json
import resource
import sys
from collections.abc import Callable
from typing import Any

ENDS: dict[str, float] = {}


def spent() -> float:
    """Processor time of this process and of those it has waited for, user and system [s]."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def timed(owner: Any, name: str, before: str, after: str) -> None:
    """Note when a function of ``owner`` is called and when it returns."""
    function: Callable[..., Any] = getattr(owner, name)

    def noting(*args: Any, **kwargs: Any) -> Any:
        ENDS[before] = spent()
        result = function(*args, **kwargs)
        ENDS[after] = spent()
        return result

    setattr(owner, name, noting)


def main() -> None:
    from catenary.cases.cli import run as verb
    from catenary.cases.cli.main import main as catenary

    begin = verb.begin

    def begun(*args: Any) -> Any:
        found = begin(*args)
        ENDS["scene read and checked, MPI and PETSc started"] = spent()
        from catenary.cases.run import runner
        from catenary.solver.time_loop.march import March

        timed(runner._Run, "make", "imports of a run", "")
        timed(March, "run", "mesh, rest, solver prepared", "march and records")
        return found

    verb.begin = begun
    sys.argv = ["catenary", "run", *sys.argv[1:]]
    try:
        catenary()
    except SystemExit as end:
        ENDS.pop("", None)
        ENDS["report"] = spent()
        parts, last = {}, 0.0
        for name, at in ENDS.items():
            parts[name] = at - last
            last = at
        print(json.dumps({"code": end.code, "parts": parts}))


if __name__ == "__main__":
    main()
