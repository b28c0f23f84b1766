import mmap

import pytest

from knitstudy.loading.history import Meter


def _take_and_give_back(size):
    """Touch memory that no allocator can serve from what the process holds already."""
    with mmap.mmap(-1, size) as memory:
        memory[:: mmap.PAGESIZE] = b"1" * -(-size // mmap.PAGESIZE)


def test_growth_counts_memory_that_was_freed_again():
    meter = Meter()
    if not meter.has_own_peak:
        pytest.skip("this system has no peak that can be begun anew")
    _take_and_give_back(64_000_000)
    cost = meter.read()
    assert 55e6 < cost.memory_growth < 100e6
    assert cost.memory_peak >= cost.memory_growth
    assert cost.seconds > 0


def test_a_new_meter_begins_anew():
    _take_and_give_back(64_000_000)
    meter = Meter()
    if meter.has_own_peak:
        assert meter.read().memory_growth < 30e6


def test_a_pause_takes_no_time(monkeypatch):
    now = [10.0]
    monkeypatch.setattr("knitstudy.loading.history.time.perf_counter", lambda: now[0])
    meter = Meter()
    now[0] += 2
    with meter.paused():
        now[0] += 5
    assert meter.read().seconds == 2
