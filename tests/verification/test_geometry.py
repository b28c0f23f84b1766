"""Yarn geometry: exact gradients and orders."""

import numpy as np

from knitstudy.knit.geometry.spline import CatmullRom


def test_circle_is_approached_with_fourth_order(verify):
    def error(count):
        t = 2 * np.pi * np.arange(count) / count
        circle = CatmullRom(np.column_stack([np.cos(t), np.sin(t), 0 * t]), [0, 0, 0])
        return np.abs(np.linalg.norm(circle.value(np.linspace(0, 1, 50)), axis=1) - 1).max()

    order = np.log2(error(32) / error(64))
    verify.at_least("Catmull-Rom curve through a circle, order of the radius", order, 3.9, reference="4")
