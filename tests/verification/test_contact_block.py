"""A block on a plane: friction at prescribed slip, and its loop on reversal."""

import numpy as np
import pytest
from contact_bodies import MODULUS, drive, law, plate, reaction, together
from refusals import refusal

from knitstudy.mechanics.contact.indentation import indentation
from knitstudy.mechanics.increment import Settings
from knitstudy.mechanics.linear import LU
from knitstudy.mechanics.load_path import trace
from knitstudy.mechanics.solid import Penetration

SIZE = 0.25  # element size that stiffnesses refer to

PRESS = 0.01
FRICTION = 0.3


class Block:
    """A unit cube of `count`^3 elements on a wide rigid plane, its upper face driven.

    The plane's facets end where the block does, so that none of its points leaves the block's face: slip is less
    than the distance of the first point from the edge, 0.11.
    """

    def __init__(self, friction, *, count=4, poisson=0.0, rigid=False, **options):
        block = plate([count] * 3, np.ones(3), up=False).moved([1, 1, 0])
        plane = plate([3, 3, 1], [3, 3, 1], up=True).moved([0, 0, -1])
        self.model, first = together(
            [plane, block], law(SIZE, friction), size=SIZE, poisson=poisson, **options
        )
        self.held = np.arange(first[1])
        block = np.arange(first[1], first[2])
        self.driven = block if rigid else block[self.model.nodes[block, 2] > 1 - 1e-9]

    def trace(self, path, increments, stops=()):
        settings = Settings(
            increments=increments, residual_tolerance=1e-9, correction_tolerance=1e-8, growth=1.0
        )
        return list(trace(self.model, drive(self.held, self.driven, path, stops=stops), settings, LU()))

    def force(self, increment):
        """Force (3,) that the block puts on the plane."""
        return -reaction(increment, self.held)


def work(increments, driven):
    """Work (m,) of the driven nodes up to every increment, by the trapezoidal rule over reactions."""
    force = np.array([reaction(each, driven) for each in increments])
    moved = np.array([each.state.displacement[driven[0]] for each in increments])
    steps = 0.5 * (force[1:] + force[:-1]) * np.diff(moved, axis=0)
    return np.concatenate([[0.0], np.cumsum(steps.sum(axis=1))])


def test_friction_at_prescribed_slip(verify):
    """Wherever it is driven to, the block is held back by mu N, against its motion."""
    block = Block(FRICTION, poisson=0.4)
    path = np.array([[0, 0, -PRESS], [0.08, 0, -PRESS], [-0.06, -0.09, -PRESS]])
    increments = block.trace(path, 6)
    for where, end, way in (("", 4, path[1] - path[0]), (", turned", 6, path[2] - path[1])):
        force = block.force(increments[end])
        along = force @ way / np.linalg.norm(way)
        verify.within(f"block, prescribed slip{where}: friction over N", along / -force[2], FRICTION, 0.005)


@pytest.mark.parametrize("rigid", [True, False], ids=["rigid", "elastic"])
def test_loop_on_reversal(rigid, verify):
    """A block slid to and fro by s does the work 4 mu N (s - mu N / k), k the stiffness while it sticks.

    That of the contact is epsT A; the elastic block's, in series with its shear, is the slope of the first step.
    """
    slide, stick = 0.08, 10 * MODULUS / SIZE
    block = Block(FRICTION, count=2, rigid=rigid)
    # Increments end about where the block comes loose, where the rule of the trapezoid needs them.
    loose = 2 * FRICTION * PRESS if rigid else 0.019
    around = 0.25 * loose / (2 * slide) * (np.array([1.0]) if rigid else np.linspace(0.6, 1.4, 5))
    stops = (0.251, *(0.5 + around), *(0.75 + around))
    increments = block.trace(
        [[0, 0, -PRESS], [slide, 0, -PRESS], [-slide, 0, -PRESS], [slide, 0, -PRESS]], 16, stops
    )
    done = work(increments, block.driven)
    loads = np.array([each.load for each in increments])
    begun, first, last = (int(np.argmin(np.abs(loads - load))) for load in (0.251, 0.5, 1.0))
    normal = -block.force(increments[last])[2]
    if rigid:
        verify.within("rigid block: normal force over eps A g", normal / (stick * PRESS), 1.0, 1e-10)
    else:
        stick = block.force(increments[begun])[0] / increments[begun].state.displacement[block.driven[0], 0]
    area = 4 * FRICTION * normal * (slide - FRICTION * normal / stick)
    name = "rigid" if rigid else "elastic"
    verify.within(f"{name} block, slid to and fro: area of the loop", done[last] - done[first], area, 0.005)
    lost = increments[last].response.energy["friction"] - increments[first].response.energy["friction"]
    verify.within(f"{name} block, slid to and fro: dissipated energy", lost, area, 0.005)


def test_penetration_is_removed_or_refused():
    """Beyond its limit multipliers are updated until it is below, and without them the run stops."""
    press = [[0, 0, -PRESS]]
    limit = 1e-5
    block = Block(FRICTION, count=2, penetration=Penetration(limit, 20))
    *_, end = block.trace(press, 2)
    assert end.state.augmentations > 0
    assert block.model.contact.smallest_gap(block.model.contact_points(end.state)) > -limit
    with refusal("penetrate each other"):
        Block(FRICTION, count=2, penetration=Penetration(limit)).trace(press, 2)


def test_indentation_of_spline_yarns_is_refused_on_hexahedra():
    law = indentation(2, 0.9, 3, modulus=MODULUS, poisson=0.4, radius=1.0, friction=FRICTION)
    bodies = [plate([1, 1, 1], np.ones(3), up=up).moved([0, 0, -up]) for up in (True, False)]
    with refusal("surfaces of other elements, which show all of it: use"):
        together(bodies, law, size=SIZE)
