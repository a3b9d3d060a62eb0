"""A constant force that moves along a tensioned wire, against closed forms.

The force enters by the door that every effect uses: a test effect is registered whose load changes
with time. The train is there but does not touch: its contact stiffness is zero.

Sources: L. Fryba, Vibration of solids and structures under moving loads (simply supported beam);
T. Dahlberg, Moving force on an axially loaded beam, 2007 (boundary layer around the force).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from measuring import check, march, print_table, registered
from scipy.special import erf
from small_lines import (
    BARE,
    EN_CONTACT_WIRE,
    FREE_MASS,
    bare_wires,
    mesh_of,
    numerics,
    problem_of,
    train,
)

from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.solver.effects.effect import Effect
from catenary.solver.model.beam import shape_values
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.loads import FunctionLoad
from catenary.solver.problem.contact_laws import LinearLaw

TENSION, DENSITY = EN_CONTACT_WIRE.tension, EN_CONTACT_WIRE.mass_per_length
WAVE_SPEED = EN_CONTACT_WIRE.wave_speed
FORCE = 100.0
# sqrt(EI / T) [m], five times that of a real wire, so that elements resolve it.
ROUNDING = 0.5
SPEED = 0.4 * WAVE_SPEED


def moving_force(
    builder: ModelBuilder, force: Callable[[float], float], place: Callable[[float], float]
) -> None:
    """``force(t)`` [N] at ``place(t)`` [m] on the contact wire, as forces on its unknowns."""
    model, nodes = builder.model, builder.mesh.wires[CONTACT_WIRE]
    unknowns = np.stack([model.dofs(nodes), model.dofs(nodes, "theta_y")], axis=1).ravel()
    x = model.mesh.x(nodes)

    def values(time: float) -> np.ndarray:
        at = place(time)
        element = int(np.clip(np.searchsorted(x, at) - 1, 0, x.size - 2))
        length = x[element + 1] - x[element]
        result = np.zeros(unknowns.size)
        shape = shape_values((at - x[element]) / length, length)
        result[2 * element : 2 * element + 4] = force(time) * shape
        return result

    builder.add_load(FunctionLoad("moving_force", unknowns, values))


def deflection(
    length: float,
    n_elements: int,
    dt: float,
    duration: float,
    force: Callable[[float], float],
    place: Callable[[float], float],
) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of the contact wire [m] and their deflection at the end [m]."""
    wire = replace(EN_CONTACT_WIRE, bending_stiffness=TENSION * ROUNDING**2)
    line = bare_wires(length, contact_wire=wire)
    mesh = mesh_of(line, n_elements)
    effect = Effect(
        "moving_force",
        "a force that moves along the contact wire",
        "a load that changes with time",
        "test",
        default=False,
        build=lambda builder: moving_force(builder, force, place),
    )
    # A train that creeps along for as long as the run is to last; half a step saves the count of
    # steps from round-off.
    creep = train(1.0, 1.0, 1.0 + duration + 0.5 * dt, data=FREE_MASS, static_force=0.0)
    problem = problem_of(
        line,
        BARE | {"moving_force"},
        train=creep,
        contact=LinearLaw(0.0, 0.0),
        numerics=numerics(dt),
    )
    with registered(effect):
        history = march(problem, mesh, lambda view: (view.time, view.node_motion))
    time, motion = history.watched[-1]
    assert abs(time - duration) < 1e-9
    assert not history["contact_force"].any()
    nodes = mesh.wires[CONTACT_WIRE]
    return mesh.x(nodes), motion("w", False)[np.searchsorted(history.stage.owned_nodes, nodes)]


@pytest.mark.study
def test_a_moving_force_raises_the_wire_ahead_more_steeply_than_behind() -> None:
    """A force F that sets in at time 0 and moves with V < c, before any reflection.

    String: w = A (c t - xi) ahead and B (c t + xi) behind, xi from where it set in. Continuity at
    xi = V t, and the jump of the slope there, F / (T (1 - V^2 / c^2)), as the kink moves, give

        A = F / (2 T (1 - V / c)),   B = F / (2 T (1 + V / c)),   w = F c t / (2 T) at the force,

    the last one whatever the speed is. Bending rounds the kink over 1 / lambda,
    lambda^2 = T (1 - V^2 / c^2) / EI, by F / (2 T (1 - V^2 / c^2) lambda) exp(-lambda |xi - V t|).
    A force that sets in gradually is a sum of sudden ones: nothing changes but that t counts from
    the mean of its rise.
    """
    length, n_elements, dt, x0 = 400.0, 1600, 0.5e-3, 180.0
    rise, mean, t = 0.01, 0.08, 0.9

    def force(time: float) -> float:
        return FORCE * 0.5 * (1.0 + float(erf((time - mean) / (rise * np.sqrt(2.0)))))

    def place(time: float) -> float:
        return x0 + SPEED * (time - mean)

    x, w = deflection(length, n_elements, dt, mean + t, force, place)
    now = x0 + SPEED * t
    ahead = FORCE / (2 * TENSION * (1 - SPEED / WAVE_SPEED))
    behind = FORCE / (2 * TENSION * (1 + SPEED / WAVE_SPEED))
    height = FORCE * WAVE_SPEED * t / (2 * TENSION)
    tension = TENSION * (1 - (SPEED / WAVE_SPEED) ** 2)
    inverse = np.sqrt(tension / (TENSION * ROUNDING**2))
    layer = FORCE / (2 * tension * inverse) * np.exp(-inverse * np.abs(x - now))
    string = height - np.where(x > now, ahead, behind) * np.abs(x - now)
    # Bending spreads a front over (3/2 EI / T c t)^(1/3) = 3.4 m. 30 m behind it that has died
    # away, and what could have come back from the ends had to be three times as fast as the
    # front: waves of that frequency, 650 1/s, are exp(-21) of what the force contains.
    clear = (x > 150.0) & (x < x0 + WAVE_SPEED * t - 30.0)
    # Cubic elements leave out how an element itself gives way under the force in its middle.
    element = FORCE * (length / n_elements) ** 3 / (192 * TENSION * ROUNDING**2)
    check("deflection [m]", w[clear], (string - layer)[clear], within=element)
    under = np.argmin(np.abs(x - now))
    print(f"at the force {w[under]:.4f} m, of which the boundary layer takes {layer[under]:.2e} m")
    for name, side, theory in (("ahead", x > now, -ahead), ("behind", x < now, behind)):
        # Outside the boundary layer; over a stretch the slope is off by twice an error at its ends.
        away = clear & side & (np.abs(x - now) > 20 / inverse)
        stretch = np.ptp(x[away])
        slope = np.polyfit(x[away] - now, w[away], 1)[0]
        check(f"slope {name} over {stretch:.0f} m", slope, theory, within=2 * element / stretch)


def test_a_beam_under_a_moving_force_follows_frybas_series() -> None:
    """From one support towards the other, a harmonic force F cos(p t) with the speed V causes

        w = sum over n and both signs of F / (rho L) sin(k x)
            (sin(q t) - q / omega sin(omega t)) / (omega^2 - q^2),   q = k V +- p,

    k = n pi / L, omega^2 = (T k^2 + EI k^4) / rho. A force that swells and fades away as
    (1 - cos(p t))^2 / 4 is a sum of three of them, the first one constant, and smooth enough at
    its beginning for the errors to fall with the full order 2 of the time step.
    """
    length, n_elements, duration = 60.0, 480, 0.8
    p = 2 * np.pi / duration
    harmonics = ((0.0, 3 / 8), (p, -1 / 2), (2 * p, 1 / 8))

    def force(time: float) -> float:
        return FORCE * sum(share * float(np.cos(q * time)) for q, share in harmonics)

    k = np.arange(1, 1001) * np.pi / length
    omega = np.sqrt((TENSION * k**2 + TENSION * ROUNDING**2 * k**4) / DENSITY)
    amplitude = np.zeros_like(k)
    for frequency, share in harmonics:
        for q in (k * SPEED + frequency, k * SPEED - frequency):
            forced = np.sin(q * duration) - q / omega * np.sin(omega * duration)
            amplitude += share * FORCE / (DENSITY * length) * forced / (omega**2 - q**2)
    errors, steps = [], [8e-3, 4e-3, 2e-3, 1e-3]
    for dt in steps:
        x, w = deflection(length, n_elements, dt, duration, force, lambda t: SPEED * t)
        exact = np.sin(np.outer(x, k)) @ amplitude
        errors.append(float(np.abs(w - exact).max()))
    print(f"largest deflection {np.abs(exact).max():.4f} m")
    title = "largest error [m], expected order 2"
    observed = print_table(title, [f"{1e3 * dt:g} ms" for dt in steps], errors)
    # What disturbs the order between the last two: the next term, (omega dt)^2 of the fastest
    # motion, the passage of the boundary layer's kink with omega = V sqrt(T / EI), and what the
    # elements leave out (as above).
    element = FORCE * (length / n_elements) ** 3 / (192 * TENSION * ROUNDING**2)
    following = (SPEED / ROUNDING * steps[-2]) ** 2 + element / errors[-1]
    check("order", observed[-1], 2, within=np.log2(1 + following))
