"""Wind along a line: its mean, its gusts in space and time, and what it does to wires.

Spectra of gusts are one-sided over the frequency n [Hz], their variance between frequencies has a
closed form; u* is the friction velocity, U the mean speed, z the height.
Along the mean wind, A. G. Davenport (1961): n S / u*^2 = 4 x^2 / (1 + x^2)^(4/3), x = 1200 n / U10;
or T. von Karman (1948): n S / s^2 = 4 y / (1 + 70.8 y^2)^(5/6), y = n L / U, s^2 = 6 u*^2.
Upward, H. A. Panofsky and R. A. McCormick (1960): n S / u*^2 = 6 f / (1 + 4 f)^2, f = n z / U.
Across it, J. C. Kaimal et al. (1972): n S / u*^2 = 15 f / (1 + 9.5 f)^(5/3).

A part of the gusts is a random field that is made anew wherever it is needed: a sum of waves in
time, one for each narrow band of its spectrum. Their amplitudes are random and differ from place to
place: those of one frequency n are a first-order Gauss-Markov process along the line, whose
correlation exp(-C n d / U) is the coherence wanted (A. G. Davenport). Posts stand along the line;
between two of them the process is made with both given, which is exact. So any stretch and any time
follow from the seed alone, and memory does not grow with either.

Drag. A wire of diameter d is met by the wind across it, q = (W_y - v', W_z - w') less its own
velocity, with the force 1/2 rho d C_d |q| q per length (J. Dyrbye, S. O. Hansen, Wind Loads on
Structures). With the mean W along y, gusts (g_y, g_z) and small velocities that is

    lateral:   1/2 rho d C_d W |W|  +  rho |W| d C_d (g_y - v')
    vertical:                       1/2 rho |W| d C_d (g_z - w')

and without linearisation about the mean the gusts' part is 1/2 rho d C_d (|q| q - |W| W).
"""

from __future__ import annotations

import functools
import math
from collections import OrderedDict
from collections.abc import Callable, Sequence

import numpy as np
from scipy import sparse

from catenary.mbs.air import Airflow, Tunnel, WindAt
from catenary.meshgen.wires import Wire
from catenary.solver.kernels import native
from catenary.solver.model import beam
from catenary.solver.model.alike import alike
from catenary.solver.model.loads import FieldLoad
from catenary.solver.model.model import Block, Model
from catenary.solver.model.unknowns import LEVEL, UPRIGHT
from catenary.solver.problem.problem import Placement, Problem, Simulated
from catenary.solver.problem.wind import Wind

# A gust that is hardly exceeded in ten minutes, in standard deviations.
PEAK = 3.5
# Parts of a gust: along the mean wind, across it to the left, upward.
ALONG, ACROSS, UPWARD = range(3)
# Bands: below this frequency [Hz] so many to a factor of ten, from there on so wide [Hz].
_EVEN_FROM, _PER_DECADE, _WIDTH = 0.1, 30, 0.01
# Points from post to post, and stretches between posts that are kept.
POSTS, _KEPT = 64, 96
# Slices in a period of the highest frequency. Linear between them, a wave loses part of itself.
_SLICES = 5


def variance_below(wind: Wind, part: int) -> Callable[[np.ndarray], np.ndarray]:
    """Variance [m2/s2] of a part of the gusts below frequencies [Hz], as a function of these."""
    gusts = wind.gusts
    assert gusts is not None
    square, mean, height = gusts.friction_velocity**2, wind.mean, wind.height
    if part == UPWARD:
        return lambda n: 1.5 * square * (1.0 - 1.0 / (1.0 + 4.0 * n * height / mean))
    if part == ACROSS:
        share = 22.5 / 9.5 * square
        return lambda n: share * (1.0 - (1.0 + 9.5 * n * height / mean) ** (-2.0 / 3.0))
    if gusts.spectrum == "von_karman":
        from scipy.special import hyp2f1  # not loaded for air without gusts

        def karman(n: np.ndarray) -> np.ndarray:
            y = n * gusts.length_scale / mean
            return np.asarray(24.0 * square * y * hyp2f1(0.5, 5.0 / 6.0, 1.5, -70.8 * y**2))

        return karman
    at_ten = float(wind.speed * wind.profile.growth(10.0, wind.reference_height))
    return lambda n: 6.0 * square * (1.0 - (1.0 + (1200.0 * n / at_ten) ** 2) ** (-1.0 / 3.0))


class GustField:
    """One part of the gusts at points along the line. Not collective; the same on all ranks.

    Parameters
    ----------
    wind : with gusts
    part : ALONG, ACROSS or UPWARD
    points : (n,) places [m], ascending
    spread : distance [m] of points between which a load is linear: the coherence of loads over
        longer lengths is then that of the gusts themselves. None for the gusts at a point

    Attributes
    ----------
    interval : between slices of time [s]
    frequencies, deviations : (k,) [Hz] and standard deviations [m/s] of the waves; the sum of the
        squares is the variance of the spectrum from the lowest to the highest frequency
    """

    def __init__(
        self, wind: Wind, part: int, points: np.ndarray, spread: float | None = None
    ) -> None:
        gusts = wind.gusts
        assert gusts is not None
        self.interval = 1.0 / (_SLICES * gusts.highest)
        self._points, self._seed, self._growth = points, (gusts.seed, part), gusts.growth
        edges = _edges(gusts.lowest, gusts.highest)
        random = np.random.default_rng([*self._seed, 0])
        share = random.uniform(size=edges.size - 1)
        self.frequencies = edges[:-1] + share * np.diff(edges)
        self.deviations = np.sqrt(np.diff(variance_below(wind, part)(edges)))
        # Between slices the field is linear, which takes this of a wave.
        self._raised = self.deviations / np.sinc(self.frequencies * self.interval) ** 2
        rates = gusts.decay[part] * self.frequencies / wind.mean
        if spread is not None:
            self._raised *= np.sqrt(narrowed(0.5 * rates * spread))
        # Each wave has two amplitudes, of its cosine and of its sine.
        self._rates = np.tile(rates, 2)
        self._posts = self._first_chain(random)
        self._kept: OrderedDict[int, np.ndarray] = OrderedDict()

    def fill(self, first: int, part: slice, slices: np.ndarray) -> None:
        """Fill ``slices`` (m, k) [m/s] at the points of ``part``, at (first + i) ``interval``."""
        times = self.interval * (first + np.arange(slices.shape[0]))
        phases = 2.0 * np.pi * times[:, None] * self.frequencies
        waves = np.concatenate([np.cos(phases), np.sin(phases)], axis=1)
        if self._growth > 0.0:
            grown = np.clip(times / self._growth, 0.0, 1.0)
            waves *= (0.5 - 0.5 * np.cos(np.pi * grown))[:, None]
        slices[:] = 0.0
        begin = part.start
        while begin < part.stop:
            post = begin // POSTS
            end = min(part.stop, (post + 1) * POSTS)
            own = self._between(post)[:, begin - post * POSTS : end - post * POSTS]
            # A block of its own, as slices may be any part of a larger array.
            made = np.zeros((slices.shape[0], end - begin))
            native.add_waves(waves, np.ascontiguousarray(own), made)
            slices[:, begin - part.start : end - part.start] = made
            begin = end

    def _first_chain(self, random: np.random.Generator) -> np.ndarray:
        """Amplitudes at the posts (p, 2 k), one more than there are stretches."""
        last = self._points.size - 1
        numbers = np.minimum(np.arange(0, last + POSTS + 1, POSTS), last)
        steps = np.diff(self._points[numbers])
        chain = random.standard_normal((numbers.size, self._rates.size))
        for post, step in enumerate(steps, start=1):
            kept = np.exp(-self._rates * step)
            chain[post] *= np.sqrt(-np.expm1(-2.0 * self._rates * step))
            chain[post] += kept * chain[post - 1]
        return chain

    def _between(self, post: int) -> np.ndarray:
        """Amplitudes times deviations (2 k, m) at the m points from a post to before the next."""
        if post in self._kept:
            self._kept.move_to_end(post)
            return self._kept[post]
        first, stop = post * POSTS, min((post + 1) * POSTS, self._points.size - 1)
        inner = max(stop - first - 1, 0)
        values = np.empty((inner + 1, self._rates.size))
        values[0] = self._posts[post]
        if inner:
            normals = np.random.default_rng([*self._seed, 1 + post]).standard_normal(
                (inner, self._rates.size)
            )
            steps = np.diff(self._points[first : stop + 1])
            ends = self._posts[post], self._posts[post + 1]
            values[1:] = _bridge(*ends, self._rates, steps, normals)
        if stop == self._points.size - 1 and stop < (post + 1) * POSTS and stop > first:
            values = np.concatenate([values, self._posts[post + 1][None]])
        made = np.ascontiguousarray(values.T * np.tile(self._raised, 2)[:, None])
        self._kept[post] = made
        if len(self._kept) > _KEPT:
            self._kept.popitem(last=False)
        return made


def _bridge(
    first: np.ndarray, last: np.ndarray, rates: np.ndarray, steps: np.ndarray, normals: np.ndarray
) -> np.ndarray:
    """Values (m, k) at m points between two posts of k first-order Gauss-Markov processes.

    They are ``first`` and ``last`` (k,) at the posts and decay as exp(-rate d), ``rates`` in 1/m;
    ``steps`` (m + 1,) are from the first post to the point after it, and so on to the last post
    [m]; ``normals`` (m, k) standard normal numbers.
    """
    near = np.multiply.outer(steps[:-1], rates)
    far = np.multiply.outer(steps.sum() - np.cumsum(steps[:-1]), rates)
    lost_near, lost_far, lost = (-np.expm1(-2.0 * decay) for decay in (near, far, near + far))
    values = np.exp(-far) * lost_near / lost * last
    values += np.sqrt(lost_near * lost_far / lost) * normals
    kept = np.exp(-near) * lost_far / lost
    for before, value, share in zip([first, *values[:-1]], values, kept, strict=True):
        value += share * before
    return np.asarray(values)


def narrowed(half: np.ndarray) -> np.ndarray:
    """Factor on the power of a gust process, for a field that is linear between points [-].

    The process has the correlation exp(-a d), the points are h apart, ``half`` is a h / 2. The
    factor is 2 / a over the sum of h exp(-a h |j|) over all j: over lengths beyond h the load has
    the power of the process. Shape as ``half``.
    """
    return np.asarray(np.tanh(half) / half)


def _edges(lowest: float, highest: float) -> np.ndarray:
    """Edges of the bands [Hz]."""
    middle = min(max(_EVEN_FROM, lowest), highest)
    edges = [np.array([lowest])]
    if middle > lowest:
        n = max(1, round(_PER_DECADE * np.log10(middle / lowest)))
        edges.append(np.geomspace(lowest, middle, n + 1)[1:])
    if highest > middle:
        n = max(1, round((highest - middle) / _WIDTH))
        edges.append(np.linspace(middle, highest, n + 1)[1:])
    return np.concatenate(edges)


def exposure(wind: Wind, places: np.ndarray, tunnels: Sequence[Tunnel] = ()) -> np.ndarray:
    """Mean speed at places [m] over that outside of stretches, shape as ``places``.

    In tunnels there is no wind.
    """
    found = gust_exposure(wind, places, tunnels)
    for stretch in wind.stretches:
        if stretch.height is not None:
            inside = (places >= stretch.start) & (places < stretch.end)
            found[inside] *= float(wind.profile.growth(stretch.height, wind.height))
    return found


def gust_exposure(wind: Wind, places: np.ndarray, tunnels: Sequence[Tunnel] = ()) -> np.ndarray:
    """Speed of the gusts at places [m] over that outside of stretches, shape as ``places``.

    The mean grows with the height, the friction velocity, of which gusts are a multiple, does not.
    """
    found = np.ones(places.shape)
    for stretch in wind.stretches:
        found[(places >= stretch.start) & (places < stretch.end)] = stretch.factor
    for tunnel in tunnels:
        found *= 1.0 - tunnel.depth(places)
    return found


def directions(wind: Wind) -> tuple[float, float]:
    """Parts of a unit of mean wind with the train and to the left of it."""
    along, across = math.cos(wind.direction), math.sin(wind.direction)
    # Of a wind straight across nothing is left along the track but round-off, and so the other way.
    return (0.0 if abs(along) < 1e-12 else along), (0.0 if abs(across) < 1e-12 else across)


def across_at(wind: Wind, tunnels: tuple[Tunnel, ...], places: np.ndarray) -> np.ndarray:
    """Mean wind to the left of the track [m/s] at ``places`` [m], of the same shape; 0 in
    ``tunnels``."""
    return directions(wind)[1] * wind.mean * exposure(wind, places, tunnels)


def mean_load(
    wind: Wind, tunnels: tuple[Tunnel, ...], wire: Wire, places: np.ndarray
) -> np.ndarray:
    """Mean lateral load on a wire [N/m] at ``places`` [m], of the same shape; to the left positive,
    0 in ``tunnels``."""
    speed = across_at(wind, tunnels, places)
    return np.asarray(0.5 * wind.density * drag_width(wire) * np.abs(speed) * speed)


def drag_width(wire: Wire) -> float:
    """Diameter times drag coefficient of a wire [m]."""
    assert wire.diameter is not None  # check_wind has refused scenes without
    return wire.diameter * wire.drag_coefficient


def gust_points(spacing: float, start: float, end: float) -> np.ndarray:
    """Points of a gust field at most ``spacing`` apart from ``start`` to ``end`` [m]."""
    return np.linspace(start, end, max(2, int(np.ceil((end - start) / spacing)) + 1))


def horizontal_gusts(
    wind: Wind, points: np.ndarray, spread: float | None = None
) -> tuple[GustField, GustField]:
    """Gusts at ``points`` (n,) [m] along the mean wind and across it to the left; ``spread`` as in
    ``GustField``."""
    return GustField(wind, ALONG, points, spread), GustField(wind, ACROSS, points, spread)


def wind_at(wind: Wind, start: float, end: float) -> WindAt:
    """Wind [m/s] with the train and across it to the left, at any places and times.

    ``start`` and ``end`` [m] of the line, beyond which gusts are as at its ends. Tunnels are left
    to whoever meets the wind.
    """
    with_train, across = directions(wind)
    if wind.gusts is None:

        def steady(places: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            speed = wind.mean * exposure(wind, places)
            return with_train * speed, across * speed

        return steady
    points = gust_points(wind.gusts.spacing, start, end)
    fields = horizontal_gusts(wind, points)

    def gusty(places: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        u, v = (_sampled(field, points, places, times) for field in fields)
        exposed = gust_exposure(wind, places)
        u, v = wind.mean * exposure(wind, places) + exposed * u, exposed * v
        return with_train * u - across * v, across * u + with_train * v

    return gusty


def _sampled(
    field: GustField, points: np.ndarray, places: np.ndarray, times: np.ndarray
) -> np.ndarray:
    """A field linear between its points and slices, at places [m] and times [s], (n,) each."""
    row = np.floor(times / field.interval).astype(np.int64)
    column = np.clip(np.searchsorted(points, places, side="right") - 1, 0, points.size - 2)
    first, low = int(row.min()), int(column.min())
    slices = np.empty((int(row.max()) + 2 - first, int(column.max()) + 2 - low))
    field.fill(first, slice(low, low + slices.shape[1]), slices)
    later = times / field.interval - row
    share = np.clip((places - points[column]) / (points[column + 1] - points[column]), 0.0, 1.0)
    row, column = row - first, column - low
    now = (1.0 - share) * slices[row, column] + share * slices[row, column + 1]
    then = (1.0 - share) * slices[row + 1, column] + share * slices[row + 1, column + 1]
    return np.asarray((1.0 - later) * now + later * then)


def airflow(problem: Problem, simulated: Simulated, placement: Placement) -> Airflow | None:
    """The air that a pantograph meets on its way, None if it has no forces. Not collective."""
    if not (simulated.meets_air and placement.data.meets_air):
        return None
    train, wind = problem.train, simulated.wind
    masts = problem.line.support_positions
    blowing = None if wind is None else wind_at(wind, float(masts[0]), float(masts[-1]))
    return Airflow(
        train.speed,
        train.start - placement.behind,
        problem.tunnels,
        blowing,
        placement.data.crosswind_factor,
        sheltered=wind is not None and bool(wind.stretches),
    )


def forces_along(
    model: Model, wire: str, unknowns: tuple[str, str], points: np.ndarray | None = None
) -> tuple[np.ndarray, sparse.csr_matrix]:
    """Unknowns (n,) of a wire in a plane, and work-equivalent forces (n, n_points) of unit loads.

    Column j holds the forces [N], [N m] by a load per length of 1 N/m at point j. The load is
    linear between points and constant beyond them; it is evaluated at nodes, and linear along each
    element.

    Parameters
    ----------
    model : Model
        Discrete line.
    wire : str
        Name of the wire.
    unknowns : tuple of str
        Names of deflection and slope in the plane.
    points : ndarray, shape (n_points,), optional
        Ascending places [m]; the wire's nodes if not given.
    """
    dofs, length = model.wire_elements(wire, unknowns)
    nodes = model.mesh.wires[wire]
    number = np.empty(model.mesh.n_nodes, dtype=np.int64)
    number[nodes] = np.arange(nodes.size)
    rows, row_of = np.unique(dofs, return_inverse=True)
    forces = beam.linear_load(length)
    at = np.broadcast_to(row_of.reshape(dofs.shape)[:, :, None], forces.shape)
    column = np.broadcast_to(number[model.mesh.elements(wire)][:, None, :], forces.shape)
    weights = sparse.coo_matrix(
        (forces.ravel(), (at.ravel(), column.ravel())), shape=(rows.size, nodes.size)
    ).tocsr()
    if points is not None:
        weights = weights @ _interpolation(model.mesh.x(nodes), points)
    return rows, weights


def _interpolation(x: np.ndarray, points: np.ndarray) -> sparse.csr_matrix:
    """Matrix (n, m) of linear interpolation from ``points`` (m,) to ``x`` (n,) [m]."""
    m = points.size
    if m == 1:
        return sparse.csr_matrix(np.ones((x.size, 1)))
    low = np.clip(np.searchsorted(points, x, side="right") - 1, 0, m - 2)
    share = np.clip((x - points[low]) / (points[low + 1] - points[low]), 0.0, 1.0)
    i = np.arange(x.size)
    return sparse.coo_matrix(
        (np.concatenate([1.0 - share, share]), (np.tile(i, 2), np.concatenate([low, low + 1]))),
        shape=(x.size, m),
    ).tocsr()


def planes_of(model: Model, wire: str) -> tuple[tuple[str, str], ...]:
    """Planes in which a wire moves, as pairs of unknowns."""
    nodes = model.mesh.wires[wire]
    level = bool(model.numbering.has(nodes, LEVEL[0]).all())
    return (UPRIGHT, LEVEL) if level else (UPRIGHT,)


def damping_blocks(model: Model, wind: Wind) -> list[Block]:
    """Aerodynamic damping of all wires about the mean wind, in all planes. Not collective."""
    tunnels, found = model.problem.tunnels, []
    for wire in model.problem.line.wires:
        for plane in planes_of(model, wire.name):
            dofs, length = model.wire_elements(wire.name, plane)
            middle = model.mesh.middles(wire.name)
            speed = np.abs(across_at(wind, tunnels, middle))
            share = 1.0 if plane is LEVEL else 0.5
            rate = share * wind.density * drag_width(wire) * speed
            first, kind = alike(np.column_stack([length, rate]))
            matrices = beam.mass(length[first], rate[first])
            found.append(Block(wire.name, dofs, kind, None, None, matrices))
    return found


def gust_loads(model: Model, wind: Wind) -> list[FieldLoad]:
    """Loads of the gusts on all wires, one for each plane. Not collective."""
    gusts = wind.gusts
    assert gusts is not None
    x = model.mesh.points[:, 0]
    points = gust_points(gusts.spacing, float(x.min()), float(x.max()))
    pressure = GustPressure(model, wind, points)
    found = []
    for plane in (UPRIGHT, LEVEL):
        parts = [
            (*forces_along(model, wire.name, plane, points), drag_width(wire))
            for wire in model.problem.line.wires
            if plane in planes_of(model, wire.name)
        ]
        if parts:
            unknowns = np.concatenate([unknowns for unknowns, _, _ in parts])
            weights = sparse.vstack([width * weights for _, weights, width in parts]).tocsr()
            fill = pressure.fill_leftward if plane is LEVEL else pressure.fill_upward
            found.append(FieldLoad(unknowns, weights, pressure.interval, fill))
    return found


class GustPressure:
    """Force of gusts on a wire over its diameter times drag coefficient [N/m2]. Not collective.

    Attributes
    ----------
    interval : time between slices, between which the force is linear [s]

    Parameters
    ----------
    points : (n,) places along the track, even and ascending [m]
    """

    def __init__(self, model: Model, wind: Wind, points: np.ndarray) -> None:
        self._wind, self._mean = wind, across_at(wind, model.problem.tunnels, points)
        self._exposed = gust_exposure(wind, points, model.problem.tunnels)
        self._upward = GustField(wind, UPWARD, points, _apart(points))
        self._points = points
        self.interval = self._upward.interval

    def fill_upward(self, first: int, part: slice, slices: np.ndarray) -> None:
        """Fill ``slices`` (m, k) with the force upwards, at the k points of ``part`` and at the
        times (first + i) ``interval``."""
        self._fill_upward_gusts(first, part, slices)
        speed = np.abs(self._mean[part])
        if self._wind.quadratic:
            across = self._mean[part] + self._across.at(first, part, slices.shape[0])
            speed = np.hypot(across, slices)
        slices *= speed
        slices *= 0.5 * self._wind.density

    def fill_leftward(self, first: int, part: slice, slices: np.ndarray) -> None:
        """As ``fill_upward``, with the force to the left of the track."""
        wind, mean = self._wind, self._mean[part]
        across = self._across.at(first, part, slices.shape[0])
        if not wind.quadratic:
            slices[:] = wind.density * np.abs(mean) * across
            return
        self._fill_upward_gusts(first, part, slices)
        across += mean
        slices[:] = np.hypot(across, slices) * across - np.abs(mean) * mean
        slices *= 0.5 * wind.density

    def _fill_upward_gusts(self, first: int, part: slice, slices: np.ndarray) -> None:
        self._upward.fill(first, part, slices)
        slices *= self._exposed[part]

    @functools.cached_property
    def _across(self) -> _Across:
        return _Across(self._wind, self._points, self._exposed)


def _apart(points: np.ndarray) -> float:
    """Distance of points, which are even [m]."""
    return float(points[1] - points[0])


class _Across:
    """Gusts to the left of the track [m/s], as far as the wind's direction has such."""

    def __init__(self, wind: Wind, points: np.ndarray, exposed: np.ndarray) -> None:
        parts = zip(
            reversed(directions(wind)), horizontal_gusts(wind, points, _apart(points)), strict=True
        )
        self._parts = [(share, field) for share, field in parts if share]
        self._exposed, self.interval = exposed, self._parts[0][1].interval

    def at(self, first: int, part: slice, n_slices: int) -> np.ndarray:
        """At the points of ``part`` and slices from ``first`` on, (n_slices, k)."""
        total = np.zeros((n_slices, part.stop - part.start))
        one = np.empty_like(total)
        for share, field in self._parts:
            field.fill(first, part, one)
            total += share * one
        return np.asarray(total * self._exposed[part])
