"""The running surface as the contact sees it: waves, kinks, and the spectrum of random heights."""

from __future__ import annotations

import numpy as np
from measuring import check, march
from small_lines import BARE, EN_CONTACT_WIRE, FREE_MASS, bare_wires, mesh_of, problem_of, train

from catenary.mbs.vehicle import N_WAVES
from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.model.partition import distribute
from catenary.solver.problem.defects import (
    BentWire,
    Heights,
    HeightSpectrum,
    Irregularities,
    Kink,
    LengthErrors,
    WornWire,
)
from catenary.solver.statics.form_finding import find_form

WAVY = BARE | {"gravity", "running_surface", "contact_loss", "kink"}


def sine(amplitude: float, wavelength: float, length: float) -> Heights:
    """A sine as a table, a spline of 40 points to a wave."""
    x = np.arange(0.0, length + 1e-9, wavelength / 40)
    return Heights((0.0, length), None, tuple(zip(x, amplitude * np.sin(2 * np.pi * x / wavelength),
                                                  strict=True)))  # fmt: skip


def test_a_head_on_a_wavy_wire_has_the_force_of_its_transfer_function() -> None:
    """A free mass m under a string with the impedance 2 Z at a moving point, contact stiffness k:
    z = a sin(w t) at w = 2 pi V / lambda needs F = z / (1/k + 1/(i w 2 Z) - 1/(w^2 m)).

    Bending rounds the string's kink off, by l / (2 T) with l = sqrt(EI / T). An echo of the first
    force would come from the near end after 2.5 s and from the far one after 1.9 s: none is in the
    run.
    """
    length, speed, wavelength, amplitude = 400.0, 40.0, 8.0, 2e-4
    heights = sine(amplitude, wavelength, length)
    problem = problem_of(
        bare_wires(length),
        BARE | {"running_surface", "contact_loss"},
        irregularities=Irregularities(surface=heights),
        train=train(speed, 150.0, 206.0, data=FREE_MASS, static_force=60.0, raise_time=0.3),
    )
    history = march(problem, mesh_of(problem.line, 800))
    time, force = np.array(history.time), history["contact_force"][:, 0]
    omega = 2 * np.pi * speed / wavelength
    last = time > time[-1] - 4 * wavelength / speed + 1e-9
    basis = np.stack([np.sin(omega * time[last]), np.cos(omega * time[last]),
                      np.ones(last.sum()), time[last]], axis=1)  # fmt: skip
    fitted = np.linalg.lstsq(basis, force[last], rcond=None)[0]
    z = np.sqrt(EN_CONTACT_WIRE.tension * EN_CONTACT_WIRE.mass_per_length)
    (mass,) = FREE_MASS.masses
    rounded = np.sqrt(195.0 / 20e3) / (2 * 20e3)
    give = 1 / 5e4 - rounded + 1 / (1j * omega * 2 * z) - 1 / (omega**2 * mass)
    check("amplitude [N]", np.hypot(*fitted[:2]), amplitude / abs(give),
          within=0.005 * amplitude / abs(give))  # fmt: skip


def test_the_surface_is_what_was_wanted_at_every_place() -> None:
    """Between samples a cubic is off by (k h)^4 / 384 of the shortest wave, for heights; by
    (k h)^3 / 72 sqrt(3) k for slopes; a kink stands in closed form."""
    spectrum = HeightSpectrum(1e-3, 2.0, 0.5, 5.0, 3)
    heights = Heights((5.0, 55.0), spectrum)
    problem = problem_of(
        bare_wires(60.0),
        WAVY,
        irregularities=Irregularities(surface=heights),
        defects=(Kink(CONTACT_WIRE, 30.0, 0.02),),
    )
    model, form = find_form(problem, mesh_of(problem.line, 60))
    wires = ContactWires(model, form, distribute(model, 1, 0))
    x = np.random.default_rng(1).uniform(6.0, 54.0, 4000)
    x = np.concatenate([x, 30.0 + np.linspace(-0.3, 0.3, 601)])
    flat = find_form(problem_of(bare_wires(60.0), WAVY), mesh_of(problem.line, 60))
    smooth = ContactWires(*flat, distribute(flat[0], 1, 0))
    bent = BentWire(CONTACT_WIRE, 30.0, 0.02, float(np.sqrt(195.0 / 20e3)))
    parts = [shape.at(CONTACT_WIRE, x) for shape in (heights, bent)]
    check("height [m]", wires.rest_height(x) - smooth.rest_height(x), sum(p[0] for p in parts),
          within=1e-7)  # fmt: skip
    apart = np.abs(x - 30.0) > 1e-5
    steep = wires.rest_slope(x) - smooth.rest_slope(x)
    check("slope [-]", steep[apart], sum(p[1] for p in parts)[apart], within=2e-5)


def test_heights_given_by_place_stay_beyond_their_ends() -> None:
    """As the document of ``by_place`` says: a head does not fall off the last of them."""
    table = ((20.0, 1e-3), (25.0, -4e-4), (30.0, 2e-3))
    sound = problem_of(bare_wires(60.0), WAVY)
    flat = find_form(sound, mesh_of(sound.line, 60))
    smooth = ContactWires(*flat, distribute(flat[0], 1, 0))
    x = np.array([0.0, 7.3, 20.0 - 1e-6, 20.0, 25.0, 30.0, 30.0 + 1e-6, 44.4, 60.0])
    wanted = np.array([1e-3] * 4 + [-4e-4] + [2e-3] * 4)
    # Round-off of heights of 5.5 m. A kink is followed to 16 decay lengths, where its slope is
    # 1.1e-9; a cubic from there over the 18 m to the heights is off by 4/27 of 18 m times that.
    for kinks, within in ((), 1e-14), ((Kink(CONTACT_WIRE, 50.0, 0.02),), 4e-9):
        problem = problem_of(
            bare_wires(60.0),
            WAVY,
            irregularities=Irregularities(surface=Heights((0.0, 60.0), None, table)),
            defects=kinks,
        )
        model, form = find_form(problem, mesh_of(problem.line, 60))
        wires = ContactWires(model, form, distribute(model, 1, 0))
        check("height [m]", wires.rest_height(x) - smooth.rest_height(x), wanted, within=within)
        # The spline turns by 5.2e-4 1/m at its ends: slopes 1e-6 m from there are below 1e-9.
        level = x != 25.0
        check("slope [-]", wires.rest_slope(x)[level], smooth.rest_slope(x)[level], within=2e-9)


def test_a_kink_of_a_worn_wire_straightens_over_less() -> None:
    """Its depth is angle / 2 sqrt(EI / F) of what is left: of 30 % lost from below 0.34 of EI."""
    worn = WornWire(CONTACT_WIRE, 25.0, 35.0, 0.3)
    effects = WAVY | {"worn_wire"}
    kink = Kink(CONTACT_WIRE, 30.0, 0.02)
    depth = []
    for others in ((), (worn,)):
        heights = []
        for defects in (others, (*others, kink)):
            problem = problem_of(bare_wires(60.0), effects, defects=defects)
            model, form = find_form(problem, mesh_of(problem.line, 60))
            wires = ContactWires(model, form, distribute(model, 1, 0))
            heights.append(wires.rest_height(np.array([30.0]))[0])
        depth.append(heights[0] - heights[1])
    length = np.sqrt(195.0 / 20e3)
    check("depth of a sound wire [m]", depth[0], 0.01 * length, within=1e-7)
    # 0.34065 by summing a disc in strips; samples of the surface are good for 1e-7 m.
    check("depth of a worn wire [m]", depth[1], 0.01 * length * np.sqrt(0.34065), within=2e-7)


def test_random_heights_have_the_spectrum_wanted() -> None:
    """Power of each third of an octave over 40 km, and the variance of all; slopes by
    differences. A sine's own power is met to the length of the record."""
    for exponent in (1.0, 2.0, 3.5):
        spectrum = HeightSpectrum(0.02, exponent, 10.0, 100.0, 5)
        heights = Heights((0.0, 40e3), spectrum)
        x = np.arange(400.0, 39.6e3, 1.0)
        z, slope = heights.at(CONTACT_WIRE, x)
        check("standard deviation [m]", z.std(), 0.02, within=0.02 * 0.02)
        power = np.abs(np.fft.rfft(z * np.hanning(z.size))) ** 2
        power *= 2.0 / (z.size * (np.hanning(z.size) ** 2).sum())
        number = 2 * np.pi * np.fft.rfftfreq(z.size, 1.0)
        edges = np.geomspace(2 * np.pi / 100.0, 2 * np.pi / 10.0, N_WAVES + 1)[::12]
        made = [power[(number >= a) & (number < b)].sum() for a, b in
                zip(edges, edges[1:], strict=False)]  # fmt: skip
        wanted = spectrum.variance(edges[:-1], edges[1:])
        # Of twelve sines in a band the outer ones leak into the next one.
        check("power of bands [m2]", np.array(made), wanted, within=0.06 * wanted)
        outside = power[(number < 0.9 * edges[0]) | (number > 1.1 * edges[-1])].sum()
        assert outside < 1e-6 * power.sum()
        a, b = heights.at(CONTACT_WIRE, x + 5e-4)[0], heights.at(CONTACT_WIRE, x - 5e-4)[0]
        check("slope [-]", slope, (a - b) / 1e-3, within=1e-7)
    other = Heights((0.0, 40e3), HeightSpectrum(0.02, 3.5, 10.0, 100.0, 6)).at(CONTACT_WIRE, x)[0]
    assert abs(np.corrcoef(z, other)[0, 1]) < 0.2
    twin = heights.at("other_wire", x)[0]
    assert abs(np.corrcoef(z, twin)[0, 1]) < 0.2


def test_random_lengths_are_normal_and_cut_off() -> None:
    errors = LengthErrors(0.01, 2.0, 11).of(40_000)
    assert np.abs(errors).max() <= 0.02
    # Standard deviation of a normal distribution that is cut off at two: 0.8796 of its own.
    check("standard deviation [m]", errors.std(), 0.8796e-2, within=1e-4)
    check("mean [m]", errors.mean(), 0.0, within=1.5e-4)
    assert np.array_equal(errors[:100], LengthErrors(0.01, 2.0, 11).of(100))
    assert not np.array_equal(errors[:100], LengthErrors(0.01, 2.0, 12).of(100))
