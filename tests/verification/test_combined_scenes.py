"""Whole runs in which many keys act together, beside a simulator that shares no code with this one.

That simulator was written from the documents of scenes and the theory alone: beams, droppers and
arms assembled on the same nodes, the rest as a minimum of its own energy, Newmark's and the
generalized-alpha method as textbooks print them, sets of slack droppers found by search. The
figures below are its results. On some 700 random scenes
both agreed within 1e-9 to 1e-6 of the largest force.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from measuring import check

import catenary

LINE: dict[str, Any] = {
    "n_spans": 4,
    "span_m": [50.0, 54.0],
    "contact_height_m": 5.3,
    "encumbrance_m": 1.4,
    "contact_wire": {"tension_N": 15e3, "mass_kg_per_m": 1.2, "bending_stiffness_N_m2": 150.0},
    "messenger_wire": {"tension_N": 16e3, "mass_kg_per_m": 1.0, "bending_stiffness_N_m2": 100.0},
    "dropper": {
        "axial_stiffness_N": 6e4,
        "mass_kg_per_m": 0.1,
        "contact_clamp_kg": 0.15,
        "messenger_clamp_kg": 0.2,
        "count": 5,
        "spacing_m": 10.0,
        "pre_sag_mid_mm": 25.0,
    },
    "steady_arm": {"length_m": 1.1, "mass_kg_per_m": 0.8, "clamp_kg": 0.2},
    "damping": {
        "alpha_s": 1e-3,
        "beta_per_s": 0.02,
        "per_component": {"droppers": {"alpha_s": 5e-3, "beta_per_s": 0.01}},
    },
}
CHAIN: dict[str, Any] = {
    "type": "lumped",
    "masses_kg": [7.0, 9.0, 6.0],
    "stiffnesses_N_per_m": [8000.0, 12000.0, 120.0],
    "dampings_N_s_per_m": [40.0, 10.0, 80.0],
    "static_force_N": 110.0,
}
# Laws, air that acts on two masses, a tunnel, a base that moves by place and time, an impact law,
# a method that damps, a dropper that breaks; the span of the nominal height is the middle one of
# the three running spans, the second.
MANY_LAWS: dict[str, Any] = {
    "line": LINE
    | {
        "transition": {"n_spans_start": 0, "n_spans_end": 1, "rise_m": 0.3},
        "tunnels": [{"from_m": 60.0, "to_m": 130.0, "force_factor": 1.5, "portal_m": 12.0}],
    },
    "pantographs": {
        "a": CHAIN
        | {
            "strips": {
                "number": 2,
                "spacing_m": 0.5,
                "pitch_inertia_kg_m2": 0.4,
                "pitch_spring_distance_m": 0.4,
            },
            "laws": [
                {"type": "limiter", "rise_m": 0.004, "stiffness_N_per_m": 9000.0},
                {"type": "damper", "up_N_s_per_m": 60.0, "down_N_s_per_m": 150.0, "at_mass": 2},
                {"type": "friction", "force_N": 3.0, "velocity_m_per_s": 0.01, "at_mass": 1},
                {
                    "type": "spring",
                    "force_by_extension": [[-0.03, -150.0], [-0.01, -20.0], [0.0, 0.0], [0.02, 60]],
                    "at_mass": 1,
                },
            ],
            "aerodynamics": {"uplift_polynomial": [1.0, 0.01, 0.0004], "head_share": 0.6},
        }
    },
    "vehicle": {
        "vertical": {
            "amplitude_m": 0.004,
            "frequency_hz": 3.0,
            "phase_deg": 40.0,
            "by_place": [[0, 0.0], [40, 0.006], [70, -0.004], [110, 0.005], [150, 0.0], [210, 0.0]],
        }
    },
    "contact": {"law": "hunt_crossley", "stiffness_N_per_m": 6e4, "restitution": 0.7},
    "numerics": {"dt_s": 1e-3, "integrator": "generalized_alpha", "spectral_radius": 0.7},
    "incidents": [{"type": "dropper_break", "at_s": 0.6, "span": 2, "dropper": 4}],
    "effects": {"contact_damping": True, "vehicle_motion": True},
}
# A canted curve in a wind, arms with compliant hinges, a head that rolls, damping across.
CANTED: dict[str, Any] = {
    "line": LINE
    | {
        "contact_wire": LINE["contact_wire"] | {"diameter_mm": 13.2},
        "messenger_wire": LINE["messenger_wire"] | {"diameter_mm": 12.0},
        "stagger_m": [-0.15, -0.15, -0.15, -0.15, -0.15],
        "curve": {"radius_m": 1200.0, "side": "left", "cant_mm": 70.0},
        "steady_arm": LINE["steady_arm"]
        | {"inclination_deg": 8.0, "registration_stiffness_N_per_m": 2e5},
        "damping": LINE["damping"] | {"lateral": {"alpha_s": 2e-4, "beta_per_s": 0.05}},
    },
    "pantographs": {
        "a": CHAIN
        | {
            "nominal_height_m": 5.32,
            "strips": {"length_m": 1.6},
            "roll": {"inertia_kg_m2": 1.5, "spring_distance_m": 0.7},
        }
    },
    "wind": {"speed_m_per_s": 12.0, "direction_deg": 70.0},
    "contact": {"stiffness_N_per_m": 5e4, "damping_N_s_per_m": 60.0},
    "numerics": {"dt_s": 1e-3},
    "effects": {"contact_damping": True, "lateral_motion": True, "head_roll": True},
}
# A regulated lift with filter, delay, limits and gains over the force, and a wind in the plane.
REGULATED: dict[str, Any] = {
    "line": LINE
    | {
        "contact_wire": LINE["contact_wire"] | {"diameter_mm": 13.2},
        "messenger_wire": LINE["messenger_wire"] | {"diameter_mm": 12.0},
    },
    "pantographs": {
        "a": CHAIN
        | {
            "nominal_height_m": 5.32,
            "regulation": {
                "measures": "contact_force",
                "target": 125.0,
                "gains": [
                    {"at": 50.0, "error": 0.3, "integral_per_s": 2.0, "rate_s": 0.002},
                    {"at": 200.0, "error": 0.1, "integral_per_s": 1.0},
                ],
                "sample_s": 0.02,
                "filter_s": 0.1,
                "delay_s": 0.04,
                "from_s": 0.0305,
                "least_N": -15.0,
                "most_N": 15.0,
            },
        }
    },
    "wind": {"speed_m_per_s": 20.0, "direction_deg": 60.0},
    "contact": {"stiffness_N_per_m": 5e4},
    "numerics": {"dt_s": 1e-3, "integrator": "hht", "spectral_radius": 0.8},
}
# A chain tied to its base, which rises with a short lift, on springs beside a law with a kink.
TIED: dict[str, Any] = {
    "line": LINE,
    "train": {
        "speed_km_h": 200.0,
        "start_m": 55.0,
        "end_m": 140.0,
        "raise_time_s": 0.05,
        "start_below_m": 0.01,
        "pantographs": [{"name": "a"}],
    },
    "pantographs": {
        "a": CHAIN
        | {
            "stiffnesses_N_per_m": [8000.0, 12000.0, 900.0],
            "dampings_N_s_per_m": [40.0, 10.0, 500.0],
            "laws": [
                {
                    "type": "spring",
                    "force_by_extension": [[-0.02, -40.0], [0.0, 0.0], [0.02, 20.0]],
                }
            ],
        }
    },
    "contact": {"stiffness_N_per_m": 2e5},
    "numerics": {"dt_s": 1e-3},
}
# Three tension sections, so that in the second overlap `contact_wire_next` is the earlier one; two
# pantographs pass it, droppers hang slack there with residual stiffness and kept dampers, one is
# about to break, a messenger wire has lost tension and the last spans absorb waves.
SECTIONS: dict[str, Any] = {
    "line": LINE
    | {
        "n_spans": 10,
        "overlap": {"first_span": [2, 6], "n_spans": 3, "rise_m": 0.2, "distance_m": 0.4},
        "dropper": LINE["dropper"] | {"slack_damping": "kept", "residual_stiffness_ratio": 0.1},
        "ends": {"end": {"kind": "absorbing_layer", "spans": 2, "damping_per_s": 3.0}},
    },
    "train": {
        "speed_km_h": 200.0,
        "start_m": 285.0,
        "end_m": 375.0,
        "raise_time_s": 0.2,
        "pantographs": [{"name": "a"}, {"name": "b", "behind_m": 17.0}],
    },
    "pantographs": {
        "a": CHAIN | {"nominal_height_m": 5.32},
        "b": CHAIN
        | {
            "nominal_height_m": 5.33,
            "masses_kg": [6.0, 14.0],
            "stiffnesses_N_per_m": [6000.0, 60.0],
            "dampings_N_s_per_m": [20.0, 90.0],
        },
    },
    "irregularities": {"dropper_lengths": {"by_dropper": [[7, 2, 120.0], [7, 5, 110.0]]}},
    "defects": [{"type": "wrong_tension", "wire": "messenger_wire_next", "factor": 0.9}],
    "incidents": [{"type": "dropper_break", "at_s": 0.7, "span": 7, "dropper": 7}],
    "contact": {"stiffness_N_per_m": 5e4},
    "numerics": {"dt_s": 1e-3},
    "evaluation": {"from_m": 300.0, "to_m": 357.0},
    "effects": {"residual_dropper_stiffness": True},
}
# Wires that move along the track between a mid-point and weights with friction and stops.
TENSIONERS: dict[str, Any] = {
    "line": LINE
    | {
        "contact_wire": LINE["contact_wire"] | {"axial_stiffness_N": 1.4e7},
        "messenger_wire": LINE["messenger_wire"] | {"axial_stiffness_N": 9e6},
        "stagger_m": 0.2,
        "mid_points_m": [104.0],
        "ends": {"start": {"along": "tensioner"}, "end": {"along": "tensioner"}},
        "tensioner": {"ratio": 2.0, "efficiency": 0.9998, "travel_m": 3e-4},
    },
    "pantographs": {"a": CHAIN | {"nominal_height_m": 5.32}},
    "contact": {"stiffness_N_per_m": 5e4},
    "numerics": {"dt_s": 1e-3},
    "effects": {"axial_motion": True, "dropper_slackening": False},
}
# The same colder by 25 K: droppers lean, one end is at its stop and the other one slips; droppers
# slacken along and across themselves.
COLD: dict[str, Any] = {
    "line": TENSIONERS["line"]
    | {
        "temperature": {"difference_K": -25.0},
        "mid_points_m": [50.0],
        "tensioner": {"ratio": 2.0, "efficiency": 0.98, "travel_m": 0.03},
    },
    "train": {
        "speed_km_h": 320.0,
        "start_m": 55.0,
        "end_m": 192.0,
        "raise_time_s": 0.2,
        "pantographs": [{"name": "a"}],
    },
    "pantographs": {"a": CHAIN | {"nominal_height_m": 5.32, "static_force_N": 190.0}},
    "contact": {"stiffness_N_per_m": 5e4},
    "numerics": {"dt_s": 1e-3},
    "effects": {"axial_motion": True},
}
# A head with two strips that rolls on a car that bounces, pitches, sways, yaws and rolls.
CAR: dict[str, Any] = {
    "line": LINE | {"stagger_m": 0.25},
    "pantographs": {
        "a": CHAIN
        | {
            "nominal_height_m": 5.32,
            "strips": {"length_m": 1.6, "number": 2, "spacing_m": 0.5},
            "roll": {"inertia_kg_m2": 1.5, "spring_distance_m": 0.7},
        }
    },
    "vehicle": {
        "lateral": {"amplitude_m": 0.03, "frequency_hz": 1.3, "phase_deg": 20.0},
        "irregularity": {"spectrum": "fra_4", "seed": 3},
        "suspension": {
            "body_mass_kg": 3e4,
            "pitch_inertia_kg_m2": 1.5e6,
            "stiffness_N_per_m": 8e5,
            "damping_N_s_per_m": 4e4,
            "bogie_distance_m": 17.0,
            "wheelbase_m": 2.5,
            "pantograph_ahead_m": -6.0,
            "bogie_mass_kg": 2500.0,
            "primary_stiffness_N_per_m": 3e6,
            "primary_damping_N_s_per_m": 2e4,
            "lateral": {
                "roll_inertia_kg_m2": 5.5e4,
                "stiffness_N_per_m": 3e5,
                "damping_N_s_per_m": 6e4,
                "spring_distance_m": 2.0,
                "centre_above_m": 0.8,
                "roof_above_m": 1.8,
            },
        },
    },
    "contact": {"stiffness_N_per_m": 5e4, "damping_N_s_per_m": 60.0},
    "numerics": {"dt_s": 1e-3},
    "effects": {
        "contact_damping": True,
        "lateral_motion": True,
        "head_roll": True,
        "vehicle_motion": True,
    },
}
SCENES = {
    "many laws": MANY_LAWS,
    "canted": CANTED,
    "regulated": REGULATED,
    "tied": TIED,
    "sections": SECTIONS,
    "tensioners": TENSIONERS,
    "cold": COLD,
    "car": CAR,
}
EVERY = 150
# Contact force of the last pantograph in every EVERYth step from the first of these on [N].
FORCES: dict[str, list[float]] = {
    "many laws": [
        67.556204,
        110.602832,
        108.732202,
        77.869737,
        142.814807,
        143.386939,
        144.069167,
        117.291058,
        125.528847,
        191.840312,
    ],
    "canted": [
        54.916469,
        113.260382,
        102.290417,
        137.477665,
        169.88521,
        152.590544,
        78.162422,
        90.120631,
        99.432743,
        112.972353,
    ],
    "regulated": [
        50.462458,
        131.631875,
        107.459695,
        156.459496,
        222.617299,
        134.695976,
        79.587122,
        75.712946,
        95.081633,
        113.518164,
    ],
    "tied": [
        12.474927,
        87.507525,
        37.918186,
        160.256033,
        92.341003,
        87.856348,
        184.884329,
        147.965774,
        113.862133,
        137.257899,
    ],
    "sections": [
        86.468018,
        80.246261,
        56.297307,
        207.999597,
        208.999362,
        92.500206,
        75.762677,
        163.962316,
        85.944464,
        46.689696,
    ],
    "tensioners": [
        47.544884,
        116.835146,
        96.929997,
        142.96186,
        200.08145,
        132.535523,
        83.483181,
        69.200232,
        88.11808,
        106.24975,
    ],
    "cold": [
        142.359196,
        164.253413,
        270.14088,
        254.353235,
        129.990072,
        90.828862,
        196.043543,
        102.690556,
        79.338575,
        204.727716,
    ],
    "car": [
        28.989459,
        87.65247,
        100.862624,
        144.007796,
        220.062151,
        154.962967,
        103.129377,
        92.254825,
        121.0127,
        121.301952,
    ],
}


def scene_of(name: str) -> dict[str, Any]:
    """A scene of this file with what all have in common."""
    return {
        "case": {"name": "combined"},
        "mesh": {"elements_per_gap": 3},
        "train": {
            "speed_km_h": 200.0,
            "start_m": 55.0,
            "end_m": 140.0,
            "raise_time_s": 0.2,
            "pantographs": [{"name": "a"}],
        },
        "evaluation": {"from_m": 90.0, "to_m": 139.0},
        "output": {"field_every_s": 0.0, "energy_every_s": 0.0},
    } | SCENES[name]


@pytest.mark.parametrize("name", SCENES)
def test_forces_are_those_of_an_independent_simulator(name: str) -> None:
    force = catenary.run(catenary.load(scene_of(name))).force.values[EVERY::EVERY, -1]
    # Lengths of droppers are found to 1e-10 m, which the stiffest spring of the line, 2e5 N/m,
    # turns into 2e-5 N; figures have six decimals.
    check("contact force [N]", np.array(FORCES[name]), force, within=3e-5)
