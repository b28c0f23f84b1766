"""How much of a step is taken."""

from types import SimpleNamespace

import numpy as np
import pytest

from knitstudy.mechanics.increment import TRIALS, Trial, line_search


def trials(force, status=None):
    """A trial at a share of a unit step in one unknown, and the shares that were asked for."""
    asked = []

    def trial(share):
        asked.append(share)
        value = force(share)
        return Trial(share, np.array([share]), None, SimpleNamespace(status=status), value, abs(value))

    return trial, asked


def closing(gap, penalty=1e4):
    """Force that a gap lets fall slowly, and contact steeply once it has closed."""
    return lambda share: -1.0 + 0.5 * share + penalty * max(0.0, share - gap)


def test_a_full_step_is_one_trial():
    trial, asked = trials(lambda share: share - 1.0)
    assert line_search(trial, -1.0, 1.0, 1e-6).share == 1.0
    assert asked == [1.0]


@pytest.mark.parametrize("gap", [0.1, 0.3, 0.6])
def test_a_step_ends_where_a_gap_closes(gap):
    trial, asked = trials(closing(gap, 1e2), status=np.zeros(1))
    found = line_search(trial, -1.0, 1.0, 1e-6)
    assert found.share == pytest.approx(gap, abs=0.03)
    assert len(asked) <= TRIALS


def test_the_best_of_all_trials_is_taken_where_the_root_stays_hidden():
    trial, asked = trials(closing(0.3, 1e9), status=np.zeros(1))
    found = line_search(trial, -1.0, 1.0, 1e-6)
    assert len(asked) == TRIALS
    assert found.along == min((closing(0.3, 1e9)(share) for share in asked), key=abs)


def test_folded_elements_shorten_the_step():
    trial, _ = trials(lambda share: np.nan if share > 0.4 else share - 1.0)
    assert line_search(trial, -1.0, 1.0, 1e-6).share == 0.25


def test_none_helps():
    trial, _ = trials(lambda share: np.nan)
    assert line_search(trial, -1.0, 1.0, 1e-6) is None
    trial, _ = trials(lambda share: -2.0)
    assert line_search(trial, -1.0, 1.0, 1e-6) is None
