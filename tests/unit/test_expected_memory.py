"""Jobs declare the memory that was measured on scenes of their kind, and what exceeds the machine is refused."""

from types import SimpleNamespace

import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.stages.memory import expected_memory, unknowns
from knitstudy.stages.simulate import simulate
from knitstudy.study.configuration import load_scene

MEASURED = {
    "dns-tie-course": (193_848, 791),
    "yarns-tie-course": (11_232, 240),
    "yarns-isotropic-wale": (11_718, 494),
    "pair-slid-90": (10_944, 257),
    "reference-3x3-tie-course-p4": (42_120, 542),
    "reference-3x3-rough-wale-quadratic-060": (371_532, 2_827),
    "domain-yarns-tie-course-30x30": (855_414, 4_324),
}
"""Unknowns, and peak of the process [MB]."""


@pytest.mark.parametrize("name", MEASURED)
def test_what_was_measured_is_expected(name):
    """Unknowns are counted of the loop as drawn; a job may be promised up to twice too much, never too little."""
    count, peak = MEASURED[name]
    scene = load_scene(name)
    assert unknowns(scene) == pytest.approx(count, rel=0.1)
    assert peak <= expected_memory(scene) <= 2 * peak


def test_scene_that_exceeds_the_machine_is_refused_before_it_begins(monkeypatch):
    monkeypatch.setattr("psutil.virtual_memory", lambda: SimpleNamespace(total=0.3e9, available=0.3e9))
    with pytest.raises(
        ConfigurationError,
        match=r"coarse': pattern.loops is 3, .*mesh.size is .*'simulation' would take some 0\.\d+ GB.*has 0.3",
    ):
        simulate(load_scene("dns-tie-course-coarse"))
