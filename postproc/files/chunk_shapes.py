"""Shapes of the chunks in which tables grow, so that a flush fills whole ones.

A chunk is written once: a kill in the midst of writing one spoils no checksum of earlier rows. Of
long chunks a column of a pantograph has its own, because it is read alone. Of the line's channels a
chunk holds neighbouring columns: those that are far from the train take no room if a window is
recorded.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from catenary.postproc.channels.header import GZIP, LineRecord
from catenary.solver.time_loop.views.channels import Channel

# Largest numbers of rows of a chunk: of one column, and of a block of columns.
_ROWS_OF_ONE, _ROWS_OF_MANY = 4096, 512
# Shorter chunks hold all columns of a table: there would be too many of them.
_LEAST_OF_ONE = 512
BLOCK = 64


class Chunk(NamedTuple):
    """Rows and columns of a chunk."""

    rows: int
    columns: int


def chunks_of(
    table: Mapping[str, tuple[Channel, int]], n_steps: int, rows_per_flush: int, every: int
) -> dict[str, Chunk]:
    """Shapes of the chunks by path.

    Parameters
    ----------
    table : mapping
        Path -> channel and columns.
    n_steps : int
        Steps that are planned after step 0.
    rows_per_flush : int
        Steps of a flush.
    every : int
        Steps between two rows of the line's channels.
    """
    # Rows that are appended at once, and that are planned.
    line = max(1, rows_per_flush // every), n_steps // every + 1
    step = rows_per_flush, n_steps + 1
    shapes = {}
    for path, (channel, columns) in table.items():
        if path.startswith("energy/"):
            # Its rows are few, and not so many a flush.
            shapes[path] = Chunk(min(_ROWS_OF_MANY, n_steps + 1), 1)
        elif channel.of_line:
            n_blocks = max(1, math.ceil(columns / BLOCK))
            rows = _rows(*line, _ROWS_OF_MANY)
            shapes[path] = Chunk(rows, max(1, math.ceil(columns / n_blocks)))
        else:
            rows = _rows(*(line if path.startswith("line_channels/") else step), _ROWS_OF_ONE)
            shapes[path] = Chunk(rows, 1 if rows >= _LEAST_OF_ONE else max(1, columns))
    return shapes


def room_of(
    table: Mapping[str, tuple[Channel, int]],
    chunks: Mapping[str, Chunk],
    rows: int,
    record: LineRecord,
) -> int:
    """Most bytes that an append adds to a file, in whole chunks [B].

    Parameters
    ----------
    table : mapping of str to tuple
        Channel and number of columns by path in the file.
    chunks : mapping of str to Chunk
        Shapes of chunks by path.
    rows : int
        Number of steps that are appended.
    record : LineRecord
        Recorded part of the line.
    """
    total = 0
    for path, (channel, columns) in table.items():
        shape = chunks[path]
        across = math.ceil(max(columns, 1) / shape.columns) * shape.columns
        added = math.ceil(rows / shape.rows)
        # The chunks that were begun move if they are compressed, or get neighbours in a window.
        moves = record.window is not None or record.compression == GZIP
        added += channel.of_line and moves
        total += 8 * across * shape.rows * added
    return total


def _rows(per_flush: int, planned: int, most: int) -> int:
    """The largest part of a flush with at most ``most`` rows, and not more than are planned."""
    parts = math.ceil(per_flush / most)
    even = next((n for n in range(parts, 4 * parts) if per_flush % n == 0), parts)
    return max(1, min(math.ceil(per_flush / even), planned))
