"""A yarn dragged across the facets of another one: what the grid adds to a force that should be constant."""

import numpy as np
import pytest
from contact_bodies import back, crossed_yarns, drive, law, reaction, together

from knitstudy.mechanics.increment import Settings
from knitstudy.mechanics.linear import LU
from knitstudy.mechanics.load_path import trace


@pytest.mark.parametrize(
    ("lower", "friction", "bar", "slow"),
    [
        ("rigid", 0.0, 0.02, False),
        ("rigid", 0.3, 0.02, True),
        # A node or the middle of an element below the contact: the elastic yarn itself is not equally stiff.
        ("elastic", 0.0, 0.03, True),
        ("elastic", 0.3, 0.035, True),
    ],
)
def test_ironing(lower, friction, bar, slow, full, verify):
    """Two yarns pressed by 5% of the diameter; the upper one is moved along the lower one over four facets or more.

    They are 8 elements across at full resolution, otherwise 5. With friction the force is judged from where the whole
    contact slides.
    """
    if slow and not full:
        pytest.skip("takes --full")
    core, rings, slide, increments = (4, 2, 1.2, 20) if full else (3, 1, 1.6, 12)
    size = 2 / (core + 2 * rings)
    bodies = crossed_yarns(core, rings, length=5.0)
    model, first = together(bodies, law(size, friction), size=size)
    up = np.array([0, 0, 1.0])
    held = np.arange(first[1]) if lower == "rigid" else back(bodies[0], -up)
    driven = back(bodies[1], up) + first[1]
    settings = Settings(increments=2 * increments, growth=1.0)
    motion = drive(held, driven, [[0, 0, -0.1], [slide, 0, -0.1]])
    begin = 0.7 if friction else 0.5
    force = [reaction(each, driven) for each in trace(model, motion, settings, LU()) if each.load >= begin]
    tangential, _, normal = np.transpose(force)
    case = f"ironing, lower yarn {lower}, mu = {friction}: ripple of the"
    verify.at_most(f"{case} normal force", abs(np.ptp(normal) / normal.mean()), bar)
    mean = tangential.mean() if friction else normal.mean()
    verify.at_most(f"{case} tangential force", abs(np.ptp(tangential) / mean), bar)
