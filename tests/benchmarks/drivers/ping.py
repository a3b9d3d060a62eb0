"""Times messages between two ranks: latency [s] and time per byte [s], as a line of JSON.

mpirun -n 2 python -m mpi4py ping.py
"""

from __future__ import annotations

import json
import time

import numpy as np
from mpi4py import MPI

ROUNDS = 2000
SIZES = (8, 512, 4096, 32768, 262144)


def main() -> None:
    comm = MPI.COMM_WORLD
    other, times = 1 - comm.rank, []
    for size in SIZES:
        buffer = np.zeros(size, dtype=np.uint8)
        comm.Barrier()
        best = np.inf
        for _ in range(5):
            begin = time.perf_counter()
            for _ in range(ROUNDS // 5):
                if comm.rank == 0:
                    comm.Send(buffer, dest=other)
                    comm.Recv(buffer, source=other)
                else:
                    comm.Recv(buffer, source=other)
                    comm.Send(buffer, dest=other)
            best = min(best, (time.perf_counter() - begin) / (ROUNDS // 5) / 2)
        times.append(best)
    per_byte, latency = np.polyfit(SIZES, times, 1, w=1 / np.array(times))
    if comm.rank == 0:
        print(json.dumps({"latency_s": float(latency), "s_per_byte": float(per_byte)}))


if __name__ == "__main__":
    main()
