"""A step in two passes through runs of stations of one make-up; see ``two_pass_step``.

Its numbers are those of ``two_pass_kernels.forth_and_back``, to the last bit. Where all stations
around are of one make-up, both passes are those of a line that has no other.
"""

from __future__ import annotations

from catenary.solver.base.kernels.compiled import addressed, inner
from catenary.solver.base.kernels.pointers import call_held, held_at, pointed
from catenary.solver.integrators.two_pass_kernels import (
    begin_back,
    eliminate_row,
    end_after,
    ends_of,
    go_back,
)
from catenary.solver.linear.factors.substitution import Factored, meet
from catenary.solver.linear.stations.lanes import zero
from catenary.solver.linear.stations.runs import distance, in_runs, shifted
from catenary.solver.linear.stations.station_products import read_station

# Two chains of stations go side by side; a chain is all that its kernels take.


@inner
def forth(layout, first, other, i, j, n, x, y):
    """The pass forth through n stations from i up and from j down; x and y are those outwards."""
    product, known, added, found, _, _ = first
    facing, others, loaded, left, _, _ = other
    before, here = read_station(product, i - 1), read_station(product, i)
    beyond, there = read_station(facing, j + 1), read_station(facing, j)
    for k in range(n):
        after, ahead = read_station(product, i + k + 1), read_station(facing, j - k - 1)
        of_i, of_j = (before, here, after), (ahead, there, beyond)
        x = eliminate_row(layout, known.places, i + k, product, known, added, False, of_i, x, found)
        y = eliminate_row(layout, others.places, j - k, facing, others, loaded, True, of_j, y, left)
        before, here, beyond, there = here, after, there, ahead
    return x, y


@inner
def back(layout, first, other, i, j, n, x, y):
    """The pass back through n stations from i down and from j up; x and y are those inwards."""
    _, known, _, found, moved, changes = first
    _, others, _, left, moving, _ = other
    for k in range(n):
        x = go_back(layout, known.places, i - k, known, x, found, moved, changes)
        y = go_back(layout, others.places, j + k, others, y, left, moving, changes)
    return x, y


@inner
def meet_after(layout, pairs, ends, chain, x, y):
    """Go forth after as many ``pairs`` of stations through those that one side has more, and solve
    for the middle one."""
    product, known, added, found, _, _ = chain
    begin, end, _, _, middle = ends
    places = known.places
    beyond, there = read_station(product, end - pairs), read_station(product, end - 1 - pairs)
    for j in range(end - 1 - pairs, middle, -1):
        ahead = read_station(product, j - 1)
        others = ahead, there, beyond
        y = eliminate_row(layout, places, j, product, known, added, True, others, y, found)
        beyond, there = there, ahead
    before, here = read_station(product, begin + pairs - 1), read_station(product, begin + pairs)
    for i in range(begin + pairs, middle + 1):
        after = read_station(product, i + 1)
        states = before, here, after
        x = eliminate_row(layout, places, i, product, known, added, False, states, x, found)
        before, here = here, after
    meet(layout, places, middle, known, y, found)


@inner
def placed(layout, run, of_product, chain, station):
    """A chain whose stations around ``station`` are all of a run; see ``in_runs``."""
    product, known, added, found, moved, changes = chain
    _, read_places, kinds, blocks, first, factor, velocity = product
    read = distance(layout, run, read_places, first + station)
    by = distance(layout, run, known.places, station)
    own = by - distance(layout, run, known.places, known.low)
    product = (
        *(of_product, read_places, kinds, blocks, first),
        *(shifted(factor, read), shifted(velocity, read)),
    )
    blocks = known.kinds, known.blocks, known.beside_kinds, known.besides
    known = Factored(run, known.places, *blocks, known.low, known.ends)
    x, y, z, shares, latest, predicted = moved
    moved = (
        *(shifted(x, own), shifted(y, own), shifted(z, own), shares),
        *(shifted(latest, own), predicted),
    )
    return product, known, (shifted(added[0], by), added[1]), shifted(found, by), moved, changes


forth_by_runs = in_runs(forth, placed, inwards=True)
back_by_runs = in_runs(back, placed, inwards=False)


@addressed
def forth_and_back(place):
    """``two_pass_kernels.forth_and_back`` by the ``runs`` of stations, see ``runs.starts_of``."""
    of_passes, runs = held_at(place)
    multiplied, factored, loads, answer, motion, changes, stretch, ahead, following = of_passes
    call_held(ahead)
    layout, ends = factored.layout, ends_of(factored.ends)
    begin, end, low, high, middle = ends
    product, known, found, moved = pointed((multiplied, factored, answer, motion))
    added, places = (pointed(loads), loads.size > 0), known.places
    chain = product, known, added, found, moved, changes
    pairs = min(middle - begin, end - 1 - middle)
    x = y = zero(layout)
    done = 0
    while done < pairs:
        i, j, rest = begin + done, end - 1 - done, pairs - done
        x, y, ran, alone = forth_by_runs(layout, chain, runs, i, j, rest, x, y)
        done += ran
        x, y = forth(layout, chain, chain, i + ran, j - ran, alone, x, y)
        done += alone
    meet_after(layout, pairs, ends, chain, x, y)

    pairs = min(middle - low, high - 1 - middle)
    x = y = begin_back(layout, places, middle, known, found, moved, changes)
    for start in range(1, pairs + 1, stretch):
        done, stop = start, min(start + stretch, pairs + 1)
        while done < stop:
            i, j, rest = middle - done, middle + done, stop - done
            x, y, ran, alone = back_by_runs(layout, chain, runs, i, j, rest, x, y)
            x, y = back(layout, chain, chain, i - ran, j + ran, alone, x, y)
            done += ran + alone
        if start + stretch <= pairs:
            call_held(following)
    end_after(layout, pairs, ends, chain, x, y)
    call_held(following)
