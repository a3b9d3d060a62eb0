"""Searches for an optimum: sequential quadratic programming, and an evolution strategy."""

from __future__ import annotations

import warnings
from functools import cache
from typing import Any

import numpy as np

from catenary.cases.studies.optimise.objective import Point, Problem, Spent
from catenary.cases.studies.optimise.task import CMA, GRADIENT, SearchTable

# Greatest first standard deviation of the evolution strategy, over the width of the bounds.
_FIRST_SPREAD = 0.15
_MOST_ITERATIONS = 200
# Iterations of SLSQP that must gain something together.
_FRUITLESS = 3
# Objective of points that violate constraints: they rank behind all that do not.
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

    low = problem.variables.low
    width, n, worst = problem.variables.high - low, low.size, problem.is_worst

    @cache
    def at(key: bytes) -> Point:
        (point,) = problem.points([low + np.frombuffer(key) * width])
        return point

    @cache
    def slopes_at(key: bytes) -> tuple[np.ndarray, np.ndarray]:
        return problem.slopes(at(key))

    # Functions of z: changes from 0 at the lower to 1 at the upper bound, then t.
    def point(z: np.ndarray) -> Point:
        return at(np.clip(z[:n], 0.0, 1.0).tobytes())

    def slopes(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return slopes_at(np.clip(z[:n], 0.0, 1.0).tobytes())

    def margin_slopes(z: np.ndarray) -> np.ndarray:
        found = slopes(z)[1]
        return np.column_stack([found, np.zeros((found.shape[0], z.size - n))])

    def below_slopes(z: np.ndarray) -> np.ndarray:
        found = slopes(z)[0]
        return np.column_stack([-found, np.ones(found.shape[0])])

    start = -low / width
    constraints: list[dict[str, Any]] = []
    if point(start).margins.size:
        margins = {"fun": lambda z: point(z).margins, "jac": margin_slopes}
        constraints.append({"type": "ineq"} | margins)
    bounds: list[tuple[float | None, float | None]] = [(0.0, 1.0)] * n
    objective = {"fun": lambda z: point(z).objective.mean(), "jac": lambda z: slopes(z)[0].mean(0)}
    if worst:
        below = {"fun": lambda z: z[n] - point(z).objective, "jac": below_slopes}
        constraints.append({"type": "ineq"} | below)
        bounds.append((None, None))
        start = np.append(start, point(start).objective.max())
        objective = {"fun": lambda z: z[n], "jac": lambda z: np.append(np.zeros(n), 1.0)}
    minimize(
        **objective,
        x0=start,
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


def _by_evolution(problem: Problem, table: SearchTable) -> None:
    """CMA-ES (N. Hansen, arXiv:1604.00772), all points of a generation at once.

    It ranks points and needs no slopes; those that violate constraints stand behind all others, in
    the order of their violation (K. Deb, Comput. Methods Appl. Mech. Engrg. 186, 2000), and those
    beyond bounds or that broke by how far they are.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # on what it could plot if other packages were there
        import cma

    low, high = problem.variables.low, problem.variables.high
    steps = problem.natural_steps(_FIRST_SPREAD)
    options = {
        "seed": table.seed + 1,  # it takes 0 for the time of the day
        "tolfun": table.precision,
        "tolfunhist": table.precision,
        "verbose": -9,
    }
    strategy = cma.CMAEvolutionStrategy(np.zeros(low.size), 1.0, options)
    scale = abs(problem.history[0].value) or 1.0
    while not strategy.stop():
        asked = strategy.ask()
        wanted = [steps @ one for one in asked]
        found = problem.points([np.clip(one, low, high) for one in wanted])
        ranks = []
        for share, change, point in zip(asked, wanted, found, strict=True):
            beyond = np.linalg.norm((change - point.change) / (high - low))
            far = _BEHIND * np.linalg.norm(share) if point.broke else 0.0
            ranks.append(_rank(point, scale) + beyond + far)
        strategy.tell(asked, ranks)


def _rank(point: Point, scale: float) -> float:
    if point.broke:
        return 10.0 * _BEHIND
    return _BEHIND + point.violation if point.violation else point.value / scale
