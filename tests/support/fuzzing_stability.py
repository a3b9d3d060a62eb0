"""Random scenes at the bounds of what the schema lets pass: what may run away does so here.

Sound scenes of any topology and plane with damping left out, droppers and contacts as stiff, steps
as long, winds as strong and lines as warm as a scene may have them.
"""

from __future__ import annotations

import random

from fuzzing import RandomScene, sound_scene, topology_scene

# Steps of a run; a quarter of the step takes four times as many.
N_STEPS = 300


def extreme_scene(seed: int) -> RandomScene:
    """A scene with some of its keys at, or near, what is allowed; it may be refused."""
    rng = random.Random(f"extreme {seed}")
    made = rng.choice((sound_scene, sound_scene, topology_scene))(seed, N_STEPS)
    more = {
        "effects.contact_loss": "true",
        "effects.dropper_slackening": "true",
        "train.start_below_m": "0.0",
        "line.dropper.stiffness_N_per_m": f"{10 ** rng.uniform(4.0, 9.0)!r}",
        "contact.stiffness_N_per_m": f"{10 ** rng.uniform(4.0, 8.0)!r}",
    }
    if rng.random() < 0.6:
        more |= {"line.damping.alpha_s": "0.0", "line.damping.beta_per_s": "0.0"}
    if rng.random() < 0.4:
        more["wind"] = f"{{speed_m_per_s={rng.uniform(5.0, 60.0)!r},height_m=6.0}}"
        more |= {f"line.{wire}.diameter_mm": "13.0" for wire in ("contact_wire", "messenger_wire")}
        if rng.random() < 0.5:
            more |= {"effects.lateral_motion": "true", "line.stagger_m": "0.2"}
            more["line.steady_arm.length_m"] = f"{rng.uniform(0.5, 1.5)!r}"
    words = (f"{key}={value}" for key, value in more.items())
    return RandomScene(seed, (*made.assignments, *words), base=made.base)
