"""The loops of multibody systems, compiled by Numba: rotations, rows of joints, lines of forces.

Each works on arrays of all bodies, the frame at rest in the last row, and knows nothing of joints
or forces by name.
"""

from __future__ import annotations

import numpy as np

from catenary.solver.base.kernels.compiled import called, compiled


@compiled
def rotation_matrices(parameters: np.ndarray) -> np.ndarray:
    """Matrices (n, 3, 3) from body to space axes of unit Euler parameters (n, 4)."""
    result = np.empty((len(parameters), 3, 3))
    for i in range(len(parameters)):
        e0, e1, e2, e3 = parameters[i, 0], parameters[i, 1], parameters[i, 2], parameters[i, 3]
        result[i, 0, 0] = 2.0 * (e0 * e0 + e1 * e1 - 0.5)
        result[i, 0, 1] = 2.0 * (e1 * e2 - e0 * e3)
        result[i, 0, 2] = 2.0 * (e1 * e3 + e0 * e2)
        result[i, 1, 0] = 2.0 * (e1 * e2 + e0 * e3)
        result[i, 1, 1] = 2.0 * (e0 * e0 + e2 * e2 - 0.5)
        result[i, 1, 2] = 2.0 * (e2 * e3 - e0 * e1)
        result[i, 2, 0] = 2.0 * (e1 * e3 - e0 * e2)
        result[i, 2, 1] = 2.0 * (e2 * e3 + e0 * e1)
        result[i, 2, 2] = 2.0 * (e0 * e0 + e3 * e3 - 0.5)
    return result


@compiled
def move(position: np.ndarray, parameters: np.ndarray, step: np.ndarray) -> None:
    """Displace bodies in place by ``step`` (6 n,): translations, then turns in body axes.

    ``position`` (n + 1, 3), ``parameters`` (n + 1, 4); these are normalised after the turn.
    """
    for i in range(len(position) - 1):
        for k in range(3):
            position[i, k] += step[6 * i + k]
        x, y, z = 0.5 * step[6 * i + 3], 0.5 * step[6 * i + 4], 0.5 * step[6 * i + 5]
        half = np.sqrt(x * x + y * y + z * z)
        factor = np.sin(half) / half if half > 0.0 else 1.0
        r0, r1, r2, r3 = np.cos(half), factor * x, factor * y, factor * z
        p0, p1, p2, p3 = parameters[i, 0], parameters[i, 1], parameters[i, 2], parameters[i, 3]
        q0 = p0 * r0 - p1 * r1 - p2 * r2 - p3 * r3
        q1 = p0 * r1 + p1 * r0 + p2 * r3 - p3 * r2
        q2 = p0 * r2 + p2 * r0 + p3 * r1 - p1 * r3
        q3 = p0 * r3 + p3 * r0 + p1 * r2 - p2 * r1
        norm = np.sqrt(q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3)
        parameters[i, 0], parameters[i, 1] = q0 / norm, q1 / norm
        parameters[i, 2], parameters[i, 3] = q2 / norm, q3 / norm


@called
def _turn(matrix: np.ndarray, v: np.ndarray) -> tuple[float, float, float]:
    return (
        matrix[0, 0] * v[0] + matrix[0, 1] * v[1] + matrix[0, 2] * v[2],
        matrix[1, 0] * v[0] + matrix[1, 1] * v[1] + matrix[1, 2] * v[2],
        matrix[2, 0] * v[0] + matrix[2, 1] * v[1] + matrix[2, 2] * v[2],
    )


@called
def _cross(
    a: tuple[float, float, float], b: tuple[float, float, float]
) -> tuple[float, float, float]:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@called
def _dot(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@called
def _add_moment(
    row: np.ndarray, body: int, matrix: np.ndarray, w: tuple[float, float, float], sign: float
) -> None:
    """Add the gradient of (angular velocity of a body) . w to a row, in body axes."""
    for k in range(3):
        row[6 * body + 3 + k] += sign * (
            matrix[0, k] * w[0] + matrix[1, k] * w[1] + matrix[2, k] * w[2]
        )


@called
def _end(
    position: np.ndarray,
    rotation: np.ndarray,
    velocity: np.ndarray,
    spin: np.ndarray,
    body: int,
    local: np.ndarray,
) -> tuple[
    tuple[float, float, float],
    tuple[float, float, float],
    tuple[float, float, float],
    tuple[float, float, float],
]:
    """Arm from a body's centre to a point, its place, velocity and centripetal acceleration."""
    arm = _turn(rotation[body], local)
    turning = _turn(rotation[body], spin[body])
    moving = _cross(turning, arm)
    place = (
        position[body, 0] + arm[0],
        position[body, 1] + arm[1],
        position[body, 2] + arm[2],
    )
    speed = (
        velocity[body, 0] + moving[0],
        velocity[body, 1] + moving[1],
        velocity[body, 2] + moving[2],
    )
    return arm, place, speed, _cross(turning, moving)


@compiled
def products(
    position: np.ndarray,
    rotation: np.ndarray,
    velocity: np.ndarray,
    spin: np.ndarray,
    bodies: np.ndarray,
    between: np.ndarray,
    normals: np.ndarray,
    starts: np.ndarray,
    ends: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Scalar products of a vector of one body with a vector between, or on, two others.

    Row r is n . w with n fixed on body ``bodies[r, 0]`` and w, where ``between[r]``, from a point
    of body ``bodies[r, 1]`` to a point of body ``bodies[r, 2]``, else a vector of the latter.

    Parameters
    ----------
    position, velocity, spin : shape (n + 1, 3); rotation : shape (n + 1, 3, 3)
    bodies : shape (m, 3); between : shape (m,); normals, starts, ends : shape (m, 3), local

    Returns
    -------
    values (m,), Jacobian (m, 6 n), rates (m,), drifts (m,), as in `kinematics.Quantity`
    """
    n, m = len(position) - 1, len(bodies)
    value, rate, drift = np.empty(m), np.empty(m), np.empty(m)
    jacobian = np.zeros((m, 6 * n))
    for r in range(m):
        a, b, c = bodies[r, 0], bodies[r, 1], bodies[r, 2]
        row = jacobian[r]
        normal = _turn(rotation[a], normals[r])
        turning = _turn(rotation[a], spin[a])
        normal_rate = _cross(turning, normal)
        arm, place, speed, inward = _end(position, rotation, velocity, spin, c, ends[r])
        if between[r]:
            back, base, base_speed, base_inward = _end(
                position, rotation, velocity, spin, b, starts[r]
            )
            way = (place[0] - base[0], place[1] - base[1], place[2] - base[2])
            way_rate = (
                speed[0] - base_speed[0],
                speed[1] - base_speed[1],
                speed[2] - base_speed[2],
            )
            way_drift = (
                inward[0] - base_inward[0],
                inward[1] - base_inward[1],
                inward[2] - base_inward[2],
            )
            if c < n:
                for k in range(3):
                    row[6 * c + k] += normal[k]
            if b < n:
                for k in range(3):
                    row[6 * b + k] -= normal[k]
                _add_moment(row, b, rotation[b], _cross(back, normal), -1.0)
        else:
            way = arm
            way_rate = (
                speed[0] - velocity[c, 0],
                speed[1] - velocity[c, 1],
                speed[2] - velocity[c, 2],
            )
            way_drift = inward
        if c < n:
            _add_moment(row, c, rotation[c], _cross(arm, normal), 1.0)
        if a < n:
            _add_moment(row, a, rotation[a], _cross(normal, way), 1.0)
        value[r] = _dot(normal, way)
        rate[r] = _dot(normal, way_rate) + _dot(normal_rate, way)
        drift[r] = (
            _dot(normal, way_drift)
            + 2.0 * _dot(normal_rate, way_rate)
            + _dot(_cross(turning, normal_rate), way)
        )
    return value, jacobian, rate, drift


@compiled
def lines(
    position: np.ndarray,
    rotation: np.ndarray,
    velocity: np.ndarray,
    spin: np.ndarray,
    bodies: np.ndarray,
    starts: np.ndarray,
    ends: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lengths (m,) between points of two bodies each, their rates (m,) and gradients (m, 6 n).

    ``bodies`` (m, 2); ``starts``, ``ends`` (m, 3), local. A gradient of two points that coincide
    is not a number.
    """
    n, m = len(position) - 1, len(bodies)
    length, rate = np.empty(m), np.empty(m)
    gradient = np.zeros((m, 6 * n))
    for r in range(m):
        i, j = bodies[r, 0], bodies[r, 1]
        back, base, base_speed, _ = _end(position, rotation, velocity, spin, i, starts[r])
        arm, place, speed, _ = _end(position, rotation, velocity, spin, j, ends[r])
        way = (place[0] - base[0], place[1] - base[1], place[2] - base[2])
        far = np.sqrt(_dot(way, way))
        unit = (way[0] / far, way[1] / far, way[2] / far)
        length[r] = far
        rate[r] = (
            unit[0] * (speed[0] - base_speed[0])
            + unit[1] * (speed[1] - base_speed[1])
            + unit[2] * (speed[2] - base_speed[2])
        )
        if j < n:
            for k in range(3):
                gradient[r, 6 * j + k] += unit[k]
            _add_moment(gradient[r], j, rotation[j], _cross(arm, unit), 1.0)
        if i < n:
            for k in range(3):
                gradient[r, 6 * i + k] -= unit[k]
            _add_moment(gradient[r], i, rotation[i], _cross(back, unit), -1.0)
    return length, rate, gradient


@compiled
def add_gyroscopic_moments(force: np.ndarray, inertia: np.ndarray, spin: np.ndarray) -> None:
    """Add -omega x J omega to generalised forces (6 n,) in place; ``inertia`` (n, 3)."""
    for i in range(len(inertia)):
        x, y, z = spin[i, 0], spin[i, 1], spin[i, 2]
        force[6 * i + 3] -= (inertia[i, 2] - inertia[i, 1]) * y * z
        force[6 * i + 4] -= (inertia[i, 0] - inertia[i, 2]) * z * x
        force[6 * i + 5] -= (inertia[i, 1] - inertia[i, 0]) * x * y


@compiled
def independent_rows(matrix: np.ndarray, dependent: float) -> np.ndarray:
    """Numbers of rows that are not combinations of rows before them, by Gram-Schmidt, done twice.

    A row of which less than the part ``dependent`` of its length is left is a combination.
    """
    m, width = matrix.shape
    basis = np.empty((min(m, width), width))
    kept = np.empty(min(m, width), dtype=np.int64)
    count = 0
    rest = np.empty(width)
    for r in range(m):
        whole = 0.0
        for k in range(width):
            rest[k] = matrix[r, k]
            whole += rest[k] * rest[k]
        for _ in range(2):
            for b in range(count):
                part = 0.0
                for k in range(width):
                    part += basis[b, k] * rest[k]
                if part != 0.0:
                    for k in range(width):
                        rest[k] -= part * basis[b, k]
        left = 0.0
        for k in range(width):
            left += rest[k] * rest[k]
        if np.sqrt(left) > dependent * np.sqrt(whole):
            # Rows beyond as many as there are columns are combinations whatever round-off says.
            if count == width:
                break
            for k in range(width):
                basis[count, k] = rest[k] / np.sqrt(left)
            kept[count] = r
            count += 1
    return kept[:count]
