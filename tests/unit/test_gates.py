"""Gates let pass what is sound, and say in one line what is not: what, where, how much, what is allowed, which key."""

import numpy as np
import psutil
import pytest

from knitstudy.errors import CoarseIncrement, ConvergenceError, MeshError
from knitstudy.loading.gates import (
    expected_work,
    fewest_across,
    require_closed_ledger,
    require_elements_across,
    require_small_hourglass,
    require_small_stabilisation,
)
from knitstudy.loading.history import Recorder, Stations
from knitstudy.loading.load_path import Motion
from knitstudy.mechanics.increment import Increment
from knitstudy.mechanics.model import Response
from knitstudy.mesh.memory import require_memory
from knitstudy.mesh.section import Section, nodes_for_size

END = 2.0  # m


def recorded(force, internal, corners=(1.0,)):
    """A recorder of forces [N] and internal energies [J] at equal increments of a path that may return."""
    ends = END * np.array([[1.0, 0, 0], [0, 0, 0]])[: len(corners)]
    motion = Motion(ends, corners, (), axis=0, length=10.0)
    recorder = Recorder(
        Stations(np.zeros(1, int), np.zeros(1), np.zeros((1, 3))), np.array([[0, 1, 2]]), motion
    )
    loads = np.linspace(0, 1, len(force))
    for index, (load, pull, stored) in enumerate(zip(loads, force, internal, strict=True)):
        response = Response(np.array([pull, 0.0, 0.0]), 1.0, {"internal": stored})
        increment = Increment(index, load, None, response, 0.1)
        recorder.add(increment, {"centreline_displacement": np.zeros((1, 3))})
    return recorder


def test_ledger_of_a_spring_is_closed():
    load = np.linspace(0, 1, 5)
    require_closed_ledger(recorded(3 * END * load, 1.5 * (END * load) ** 2), 4, 1e-12)


def test_open_ledger_is_refused():
    """A spring that has lost 0.5 of 6 J in its first increment, and nothing since."""
    load = np.linspace(0, 1, 5)
    recorder = recorded(3 * END * load, 1.5 * (END * load) ** 2 - 0.5 * (load > 0))
    message = (
        r"increment 4: the ledger of energies is open by 0\.5 J, 8\.3% of the external work; gates\.ledger allows"
        r" 5\.0%.*solver\.increments.*gates\.ledger raises the limit"
    )
    with pytest.raises(ConvergenceError, match=message) as refused:
        require_closed_ledger(recorder, 4, 0.05)
    assert not isinstance(refused.value, CoarseIncrement)
    require_closed_ledger(recorder, 4, 0.09)
    require_closed_ledger(recorder, 4, 0.05, unloaded=0.6)


def test_no_increment_uses_up_what_is_allowed_to_others():
    """The third of four of a cubic spring: 0.078 J of 3.7 J that are expected, but 7.1 % of its own 1.1 J."""
    load = np.linspace(0, 1, 5)
    recorder = recorded((END * load) ** 3, (END * load) ** 4 / 4)
    for values in recorder.columns.values():
        del values[4:]
    message = r"increment 3: .* opens further by 0\.0781 J, 7\.1% of the work .* allows 5\.0%, and one increment half"
    with pytest.raises(CoarseIncrement, match=message) as coarse:
        require_closed_ledger(recorder, 3, 0.05)
    assert coarse.value.gap == pytest.approx(5 / 64)
    require_closed_ledger(recorder, 3, 0.15)


def test_at_rest_no_ledger_is_open():
    """Beams that overlap as they are drawn store something before anything moves."""
    require_closed_ledger(recorded([0.0], [1.0]), 0, 0.05)


def test_where_contact_has_only_begun_little_work_is_done():
    """Half of the work of the first increment is that of the rule; of all work to come it is next to nothing."""
    recorder = recorded([0.0, 0.0, 1.0], [0.0, 0.0, 0.0])
    assert recorder.columns["energy"][-1][0] == pytest.approx(0.5 * END / 2)
    early = recorded([0.0, 1.0], [0.0, 0.0])
    with pytest.raises(ConvergenceError):
        require_closed_ledger(early, 1, 0.05)  # at full load nothing is to come
    going_on = recorded([0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 0.0, 0.0])
    for values in going_on.columns.values():
        del values[2:]
    # 1 N after a third of 2 m, growing by 1.5 N/m over the other 4/3 m.
    assert expected_work(going_on) == pytest.approx(1 / 3 + 4 / 3 + 0.5 * 1.5 * (4 / 3) ** 2)


def test_work_to_come_is_that_of_all_legs():
    there_and_back = recorded([0.0, 1.0, 1.0], [0.0, 0.0, 0.0], corners=(0.5, 1.0))
    for values in there_and_back.columns.values():
        del values[2:]
    assert expected_work(there_and_back) == pytest.approx(1.0 + 2.0 * (1.0 + 0.5 * 0.5 * 2.0))


@pytest.mark.parametrize(
    ("coefficient", "energy", "remedy"),
    [
        (0.005, 0.06, r"Use a smaller mesh\.size, or mesh\.element 'quadratic'"),
        (0.5, 0.06, r"Use solver\.hourglass 0\.005, a smaller mesh\.size"),
        (1e-12, 3e-11, r"Use solver\.hourglass 0\.005, a smaller mesh\.size"),
    ],
)
def test_hourglass_modes_that_carry_or_run_free(coefficient, energy, remedy):
    """Without stiffness they cost nothing and move most: what they would cost with the usual one counts."""
    with pytest.raises(
        ConvergenceError, match=rf"increment 3: hourglass energy.*gates\.hourglass allows 5\.0%\. {remedy}"
    ):
        require_small_hourglass({"internal": 1.0, "hourglass": energy}, 0.5, 3, coefficient, 0.05)
    small = {"internal": 1.0, "hourglass": energy / 100}
    require_small_hourglass(small, 0.5, 3, coefficient, 0.05)
    require_small_hourglass({"internal": 1.0, "hourglass": energy}, 0.05, 1, coefficient, 0.05)


def test_stabilisation_that_dissipates_or_pulls():
    def judge(damped, force, load=0.5):
        energy = {"internal": 2.0, "stabilisation": damped}
        require_small_stabilisation(energy, force, 10.0, load, 3, 1e-4, 0.05, 0.05)

    judge(0.09, 0.4)
    judge(5.0, 50.0, load=0.05)
    with pytest.raises(
        ConvergenceError, match=r"stabilisation = 0\.0001 .* dissipated 6\.0% .*gates\.stabilisation"
    ):
        judge(0.12, 0.0)
    with pytest.raises(
        ConvergenceError, match=r"viscous forces are 6\.0% of the reaction, 10 N; gates\.viscous_force"
    ):
        judge(0.0, 0.6)
    with pytest.raises(ConvergenceError, match=r"1e\+03 times the internal energy"):
        judge(2000.0, 0.0)


def test_elements_that_are_too_large_for_the_yarn():
    require_elements_across(1.8e-3, 0.6e-3, 3.0)
    require_elements_across(1.8, 0.6, 3.0)
    message = r"mesh\.size is 0\.0007 m, 2\.6 elements across.*gates\.elements_across asks for 3: use 0\.0006 m or less"
    with pytest.raises(MeshError, match=message):
        require_elements_across(1.8e-3, 0.7e-3, 3.0)


def test_a_pair_needs_fewer_elements_where_they_are_smaller_at_the_crossing():
    assert [fewest_across("pair", r) for r in (1.0, 2.0, 3.0)] == [7.0, 3.5, 3.0]
    assert fewest_across("knit", 3.0) == 3.0


def test_what_does_not_fit_into_memory():
    free = psutil.virtual_memory().available
    require_memory(free / 2, "mesh.size", 1e-4, "a mesh", power=3)
    with pytest.raises(
        MeshError, match=r"mesh\.size is 0\.0001 m: a mesh would take about .* GiB.*use about 0\.00021 m"
    ):
        require_memory(8 * free, "mesh.size", 1e-4, "a mesh", power=3)


@pytest.mark.parametrize("size", [0.9e-3, 0.55e-3, 0.3e-3, 0.1e-3])
def test_nodes_of_a_section_are_known_before_it_is_made(size):
    assert nodes_for_size(1.8e-3, size) == Section.for_size(1.8e-3, size).size
