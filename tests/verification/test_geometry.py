"""Yarn geometry: exact gradients and orders."""

import numpy as np
import pytest

from knitstudy.knit.geometry.lay_out import initial_loop
from knitstudy.knit.geometry.optimise import CostFunction
from knitstudy.knit.geometry.spline import CatmullRom
from knitstudy.run.configuration import knits_of, load_scenes


@pytest.fixture(scope="module")
def scene():
    return next(iter(knits_of(load_scenes()).values()))


@pytest.fixture(scope="module")
def cost(scene):
    return CostFunction(initial_loop(scene).in_radii(), scene.geometry)


@pytest.mark.parametrize("term", ["distance", "continuous", "join", "length", "value"])
def test_gradient_of_each_term_of_the_cost(cost, scene, term, verify):
    random = np.random.default_rng(2)
    start = initial_loop(scene).in_radii().control_points
    points = start + 0.05 * random.normal(size=start.shape)
    direction = random.normal(size=points.shape)
    function = getattr(cost, term)
    exact = (function(points)[1] * direction).sum()

    def error(step):
        ahead, behind = function(points + step * direction)[0], function(points - step * direction)[0]
        return abs((ahead - behind) / (2 * step) / exact - 1)

    verify.at_most(f"gradient of F, term {term}, against central differences", error(1e-5), 1e-7)
    if term in ("join", "length", "value"):  # the others are quadratic to within rounding on such steps
        order = np.log2(error(4e-3) / error(2e-3))
        verify.at_least(f"gradient of F, term {term}, order of the difference", order, 1.9, reference="2")


def test_sharp_joins_have_an_exact_gradient_too(cost, verify):
    # A polygon folded by more than 135 degrees: the second branch of Eq. (5).
    points = np.column_stack([np.arange(16) % 2 * 5.0, 0.5 * np.arange(16), 0.1 * np.arange(16) ** 1.5])
    direction = np.random.default_rng(3).normal(size=points.shape)
    step = 1e-6
    ahead, behind = cost.join(points + step * direction)[0], cost.join(points - step * direction)[0]
    exact = (cost.join(points)[1] * direction).sum()
    verify.at_most("gradient of K_join below pi/4", abs((ahead - behind) / (2 * step) / exact - 1), 1e-6)


def test_circle_is_approached_with_fourth_order(verify):
    def error(count):
        t = 2 * np.pi * np.arange(count) / count
        circle = CatmullRom(np.column_stack([np.cos(t), np.sin(t), 0 * t]), [0, 0, 0])
        return np.abs(np.linalg.norm(circle.value(np.linspace(0, 1, 50)), axis=1) - 1).max()

    order = np.log2(error(32) / error(64))
    verify.at_least("Catmull-Rom curve through a circle, order of the radius", order, 3.9, reference="4")
