"""Searches for an optimum: sequential quadratic programming, and an evolution strategy."""

from __future__ import annotations

import warnings

import numpy as np

from catenary.cases.studies.optimise.objective import Point, Problem, Spent
from catenary.cases.studies.optimise.task import CMA, GRADIENT, SearchTable

# First standard deviation of the evolution strategy, over the width of the bounds.
_FIRST_SPREAD = 0.15
_MOST_ITERATIONS = 200
# Iterations of SLSQP that must gain something together.
_FRUITLESS = 3
# What stands for the objective of points that violate constraints: behind all that do not.
_BEHIND = 1e3


def search(problem: Problem, method: str, table: SearchTable) -> Point:
    """The best point that a method finds from the case as shipped. Not collective."""
    methods = {GRADIENT: _by_gradient, CMA: _by_evolution}
    try:
        problem.points([np.zeros(problem.variables.low.size)])
        methods[method](problem, table)
    except Spent:
        pass
    return problem.best()


def _by_gradient(problem: Problem, table: SearchTable) -> None:
    """SciPy's SLSQP (D. Kraft, DFVLR-FB 88-28, 1988) on changes over the width of their bounds.

    The worst of many values has kinks; in its place stands a further unknown t that no value may
    exceed, which is to be as small as can be.
    """
    from scipy.optimize import minimize

    model = _Scaled(problem)
    n, worst = problem.variables.low.size, problem.is_worst
    start = model.start()
    if worst:
        start = np.append(start, model.point(start).objective.max())
    constraints = []
    if model.margins(start).size:
        constraints.append({"type": "ineq", "fun": model.margins, "jac": model.margin_slopes})
    if worst:
        constraints.append({"type": "ineq", "fun": model.below, "jac": model.below_slopes})
    bounds = [(0.0, 1.0)] * n + ([(None, None)] if worst else [])
    minimize(
        (lambda z: z[n]) if worst else model.mean,
        start,
        jac=(lambda z: np.append(np.zeros(n), 1.0)) if worst else model.mean_slopes,
        bounds=bounds,
        constraints=constraints,
        callback=_Stalled(problem, table.precision),
        method="SLSQP",
        options={"ftol": 0.1 * table.precision, "maxiter": _MOST_ITERATIONS},
    )


class _Stalled:
    """Ends a search, with ``Spent``, whose last iterations together gained less than a precision.

    Slopes over kinks mislead SLSQP near the optimum into many short steps.
    """

    def __init__(self, problem: Problem, precision: float) -> None:
        self._problem = problem
        self._precision = precision
        self._values: list[float] = []

    def __call__(self, z: np.ndarray) -> None:
        best = self._problem.best()
        self._values.append(np.inf if best.violation else best.value)
        if len(self._values) > _FRUITLESS:
            before = self._values[-1 - _FRUITLESS]
            if before - self._values[-1] < self._precision * abs(before):
                raise Spent


class _Scaled:
    """A problem as functions of z: changes from 0 at the lower to 1 at the upper bound, then t."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._low = problem.variables.low
        self._width = problem.variables.high - self._low
        self._points: dict[bytes, Point] = {}
        self._slopes: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    def start(self) -> np.ndarray:
        """The case as shipped."""
        return np.asarray(-self._low / self._width)

    def point(self, z: np.ndarray) -> Point:
        own = np.clip(z[: self._low.size], 0.0, 1.0)
        key = own.tobytes()
        if key not in self._points:
            (self._points[key],) = self._problem.points([self._low + own * self._width])
        return self._points[key]

    def slopes(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        point = self.point(z)
        key = point.change.tobytes()
        if key not in self._slopes:
            self._slopes[key] = self._problem.slopes(point)
        return self._slopes[key]

    def mean(self, z: np.ndarray) -> float:
        return float(self.point(z).objective.mean())

    def mean_slopes(self, z: np.ndarray) -> np.ndarray:
        return np.asarray(self.slopes(z)[0].mean(axis=0))

    def below(self, z: np.ndarray) -> np.ndarray:
        return np.asarray(z[-1] - self.point(z).objective)

    def below_slopes(self, z: np.ndarray) -> np.ndarray:
        slopes = self.slopes(z)[0]
        return np.column_stack([-slopes, np.ones(slopes.shape[0])])

    def margins(self, z: np.ndarray) -> np.ndarray:
        return self.point(z).margins

    def margin_slopes(self, z: np.ndarray) -> np.ndarray:
        slopes = self.slopes(z)[1]
        more = z.size - slopes.shape[1]
        return np.column_stack([slopes, np.zeros((slopes.shape[0], more))])


def _by_evolution(problem: Problem, table: SearchTable) -> None:
    """CMA-ES (N. Hansen, arXiv:1604.00772), all points of a generation at once.

    It ranks points and needs no slopes; those that violate constraints stand behind all others, in
    the order of their violation (K. Deb, Comput. Methods Appl. Mech. Engrg. 186, 2000).
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # on what it could plot if other packages were there
        import cma

    low = problem.variables.low
    width = problem.variables.high - low
    options = {
        "bounds": [0.0, 1.0],
        "seed": table.seed + 1,  # it takes 0 for the time of the day
        "tolfun": table.precision,
        "tolfunhist": table.precision,
        "verbose": -9,
    }
    strategy = cma.CMAEvolutionStrategy(-low / width, _FIRST_SPREAD, options)
    scale = abs(problem.history[0].value) or 1.0
    while not strategy.stop():
        asked = strategy.ask()
        found = problem.points([low + np.clip(one, 0.0, 1.0) * width for one in asked])
        strategy.tell(asked, [_rank(point, scale) for point in found])


def _rank(point: Point, scale: float) -> float:
    if point.broke:
        return 10.0 * _BEHIND
    return _BEHIND + point.violation if point.violation else point.value / scale
