"""The calibration's pieces and its command's errors; what it finds is in tests/regression."""

import numpy as np

from knitstudy.geometry.calibrate import UNUSABLE, first_guess, read_problem, residuals, whole_loop
from knitstudy.geometry.loop import symmetries
from knitstudy.geometry.spline import CatmullRom
from knitstudy.study.configuration import CONFIG


def test_quarter_makes_a_loop_with_mirror_and_half_turn():
    quarter = np.random.default_rng(5).normal(size=(5, 3))
    quarter[0, 0], quarter[-1, :2] = 0.0, (3.0, 0.0)
    assert len(symmetries(CatmullRom(whole_loop(quarter, 12.0), [12.0, 0, 0]))) == 2


def test_residuals_keep_their_number_where_there_is_no_knit():
    problem, _ = read_problem(CONFIG)
    unknowns = first_guess(problem)
    apart = unknowns.copy()
    apart[1] *= 10  # rows too far from each other to cross
    assert (residuals(apart, problem) == UNUSABLE).all()
    assert residuals(apart, problem).shape == residuals(unknowns, problem).shape
