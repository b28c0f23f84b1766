"""Progress is plain lines with the time left."""

import io
import re

import pytest

from knitstudy.loading import restart as module
from knitstudy.loading.restart import Progress


@pytest.fixture
def clock(monkeypatch):
    class Clock:
        now = 100.0

    monkeypatch.setattr(module.time, "monotonic", lambda: Clock.now)
    return Clock


def lines(progress, clock, *reports):
    stream = io.StringIO()
    reporter = Progress("dns a", streams=(stream,), every=5.0)
    for seconds, done in reports:
        clock.now = 100.0 + seconds
        reporter(done, "strain")
    return stream.getvalue().splitlines()


def test_time_left_is_judged_by_the_share_done(clock):
    *_, last = lines(Progress, clock, (0, 0.0), (60, 0.25))
    assert re.fullmatch(r"dns a +25% \[01:00<03:00\] strain", last)


def test_after_a_restart_only_the_new_share_counts(clock):
    *_, last = lines(Progress, clock, (0, 0.5), (60, 0.75))
    assert "[01:00<01:00]" in last


def test_few_lines_but_always_the_last(clock):
    written = lines(Progress, clock, (0, 0.0), (1, 0.1), (2, 0.2), (6, 0.5), (7, 1.0))
    assert [re.search(r"\d+%", line).group() for line in written] == ["0%", "50%", "100%"]
