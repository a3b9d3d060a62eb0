"""The verb ``scaling``."""

from __future__ import annotations

from typing import Annotated

import typer

from catenary.base.errors import InputError
from catenary.cases.cli.app import SceneWords, verb
from catenary.cases.terminal import console


@verb(
    "scaling",
    help="Predict the time of a step on many ranks. It follows from latency and bandwidth of "
    "messages: those between the ranks that it is started on, or given ones. On several "
    "ranks it also times all messages of a step between them.",
    epilog="Example: mpirun -n 8 --oversubscribe catenary scaling ambrosio2012 "
    "--ranks 64,512,4096 --set line.n_spans=10000",
)
def scaling(
    words: SceneWords,
    ranks: Annotated[
        str, typer.Option("--ranks", metavar="N,...", help="Numbers of ranks.")
    ] = "64,512,4096",
    latency: Annotated[
        float | None,
        typer.Option(
            "--latency-us", help="Latency of a message; measured on several ranks if absent."
        ),
    ] = None,
    bandwidth: Annotated[
        float | None,
        typer.Option(
            "--bandwidth-GB-per-s", help="Bandwidth of a message; given with the latency."
        ),
    ] = None,
) -> int:
    """Collective."""
    from catenary.base.parallel import launched_by_mpirun, on_root
    from catenary.cases.studies import scaling as study
    from catenary.cases.studies.sweep.variants import whole_numbers

    if (latency is None) != (bandwidth is None):
        raise InputError("--latency-us and --bandwidth-GB-per-s belong together; give both")
    given = None
    if latency is not None and bandwidth is not None:
        if not (0.0 < latency <= 1e6 and 1e-6 <= bandwidth <= 1e6):
            raise InputError(
                f"--latency-us {latency:g} must be above 0 and at most 1e6, --bandwidth-GB-per-s "
                f"{bandwidth:g} between 1e-6 and 1e6"
            )
        given = study.Wire(1e-6 * latency, 1e-9 / bandwidth)
    numbers = whole_numbers(ranks, "--ranks", 1, study.MOST_RANKS, "64,512,4096")
    comm = console.world() if launched_by_mpirun() else None
    several = comm is not None and comm.size > 1
    if not several and given is None:
        raise InputError(
            "on one rank no message can be timed: start it with mpirun -n 2 or more, or give "
            "--latency-us and --bandwidth-GB-per-s"
        )

    def work() -> study.Work:
        return study.work_of(words.load())

    found = on_root(comm, work, takes_long=True) if comm is not None else work()
    wire, exchange = given, None
    if several:
        assert comm is not None
        wire = given or study.wire_between(comm)
        exchange = (comm.size, *study.time_of_exchange(comm, found.sizes))
    assert wire is not None
    console.say(study.as_text(found, wire, numbers, given is None, exchange))
    return console.DONE
