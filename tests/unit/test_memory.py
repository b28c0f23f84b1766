import numpy as np

from knitstudy.memory import Memory


def test_growth_counts_memory_that_was_freed_again():
    watch = Memory()
    np.ones(4_000_000)  # 32 MB, freed at once
    growth, peak = watch.measure()
    assert 25e6 < growth < 60e6
    assert peak >= growth


def test_a_new_watch_begins_anew():
    np.ones(8_000_000)
    growth, _ = Memory().measure()
    assert growth < 30e6
