import numpy as np
import pytest

from knitstudy.loading.cost import Meter


def test_growth_counts_memory_that_was_freed_again():
    meter = Meter()
    if not meter.has_own_peak:
        pytest.skip("this system has no peak that can be begun anew")
    np.ones(8_000_000)  # 64 MB, freed at once; malloc may take up to 32 MiB from what the process has already
    cost = meter.read()
    assert 55e6 < cost.memory_growth < 100e6
    assert cost.memory_peak >= cost.memory_growth
    assert cost.seconds > 0


def test_a_new_meter_begins_anew():
    np.ones(8_000_000)
    meter = Meter()
    if meter.has_own_peak:
        assert meter.read().memory_growth < 30e6


def test_a_pause_takes_no_time(monkeypatch):
    now = [10.0]
    monkeypatch.setattr("knitstudy.loading.cost.time.perf_counter", lambda: now[0])
    meter = Meter()
    now[0] += 2
    with meter.paused():
        now[0] += 5
    assert meter.read().seconds == 2
