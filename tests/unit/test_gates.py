"""Gates pass sound states and refuse others in one line: quantity, place, size, limit, and key."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import psutil
import pytest
from refusals import REFUSED, refusal

from knitstudy.errors import CoarseIncrement
from knitstudy.knit.loading.gates import (
    fewest_across,
    path_work,
    require_apart,
    require_elements_across,
    require_energy_balance,
    require_lasting_friction,
    require_small_hourglass,
    require_small_viscosity,
    require_sound,
)
from knitstudy.knit.loading.history import Motion, Recorder, Stations
from knitstudy.knit.loading.overlap import Repeats, largest_overlap
from knitstudy.knit.mesh.quality import require_memory
from knitstudy.mechanics.core.increment import Increment
from knitstudy.mechanics.core.model import Response

END = 2.0  # m
LOAD = np.linspace(0, 1, 5)


def recorded(force, internal, corners=(1.0,), only=None, friction=None):
    """A recorder of forces [N] and energies [J] at equal increments of a path that may return."""
    ends = END * np.array([[1.0, 0, 0], [0, 0, 0]])[: len(corners)]
    motion = Motion(ends, corners, (), axis=0, length=10.0)
    stations = Stations(np.zeros(1, int), np.zeros(1), np.zeros((1, 3)))
    recorder = Recorder(stations, np.array([[0, 1, 2]]), motion)
    loads = np.linspace(0, 1, len(force))
    lost = np.zeros(len(force)) if friction is None else friction
    for index, (load, pull, stored, rubbed) in enumerate(zip(loads, force, internal, lost, strict=True)):
        energy = {"internal": stored, "friction": rubbed}
        response = Response(np.array([pull, 0.0, 0.0]), 1.0, energy)
        recorder.add(
            Increment(index, load, None, response, 0.1), {"centreline_displacement": np.zeros((1, 3))}
        )
    for values in recorder.columns.values():
        del values[only or len(values) :]
    return recorder


def test_an_energy_balance_that_misses_work_is_refused_and_a_spring_passes():
    """A spring, and one that has lost 0.5 of 6 J in its first increment, and nothing since."""
    require_energy_balance(recorded(3 * END * LOAD, 1.5 * (END * LOAD) ** 2), 4, 1e-12)
    recorder = recorded(3 * END * LOAD, 1.5 * (END * LOAD) ** 2 - 0.5 * (LOAD > 0))
    message = (
        r"increment 4: the energy balance misses 0\.5 J, 8\.3% of the external work \(work 6 J, energy"
        r" of the yarns 5\.5 J\); the limit gates\.ledger is 5\.0%\. Sums over.*solver\.increments"
        r".*gates\.ledger raises the limit"
    )
    with refusal(message) as refused:
        require_energy_balance(recorder, 4, 0.05)
    assert not isinstance(refused.value, CoarseIncrement)
    require_energy_balance(recorder, 4, 0.09)
    require_energy_balance(recorder, 4, 0.05, least=0.6)


def test_yarns_that_snap_are_said_to_snap():
    """In the last increment they set 4 J free; a force of 3 N does 1.5 J."""
    recorder = recorded([0.0, 3.0, 3.0, 3.0, 3.0], [0.0, 0.75, 2.25, 3.75, -0.25])
    message = (
        r"increment 4: its energy balance misses 5\.5 J, 366\.7% of its work \(work"
        r" 1\.5 J, energy of the yarns -4 J\); .* Yarns snap into another place .*contact\.friction"
    )
    with refusal(message) as refused:
        require_energy_balance(recorder, 4, 0.05)
    assert isinstance(refused.value, CoarseIncrement)


def test_what_unbalanced_forces_may_have_done_does_not_count():
    """A slack cell: 0.5 J that no form has are less than the tolerance of the residual leaves open."""
    recorder = recorded(3 * END * LOAD, 1.5 * (END * LOAD) ** 2 - 0.5 * (LOAD == 1))
    gates, yarn = SimpleNamespace(flow=0.05, ledger=0.05, penalty=0.05), SimpleNamespace
    slack = replace(increment(internal=5.5), load=1.0, unbalanced=0.6, unbalanced_so_far=0.6)
    require_sound(slack, recorder, gates, yarn(youngs_modulus=1.0, diameter=1.0))
    with refusal(r"its energy balance misses 0\.5 J"):
        require_sound(replace(slack, unbalanced=0.1), recorder, gates, yarn(youngs_modulus=1.0, diameter=1.0))


@pytest.mark.parametrize(
    ("friction", "ends"),
    [
        ([0.0, 1.0, 2.0, 2.0, 3.0], False),
        ([0.0, 1.0, 2.0, 3.0, 3.0 - 3e-9], False),  # rounding beside 6 J of work
        ([0.0, 3.0, 2.0, 2.0, 2.5], False),  # only the last increment is judged: those before were accepted
        ([0.0, 1.0, 2.0, 3.0, 2.4], True),
        ([0.0, 1.0, 2.0, 3.0, 3.0 - 1e-7], True),
    ],
)
def test_friction_gives_nothing_back(friction, ends):
    recorder = recorded(3 * END * LOAD, np.zeros(5), friction=friction)
    if not ends:
        require_lasting_friction(recorder, 4)
        return
    message = (
        rf"increment 4: the energy of friction falls by {3.0 - friction[-1]:.3g} J, .* the largest energy"
    )
    with refusal(message):
        require_lasting_friction(recorder, 4)


def test_expected_work_is_that_of_the_rest_of_the_path():
    # 1 N after a third of 2 m, growing by 1.5 N/m over the other 4/3 m.
    going_on = recorded([0.0, 1.0, 2.0, 3.0], np.zeros(4), only=2)
    assert path_work(going_on) == pytest.approx(1 / 3 + 4 / 3 + 0.5 * 1.5 * (4 / 3) ** 2)
    there_and_back = recorded([0.0, 1.0, 1.0], np.zeros(3), corners=(0.5, 1.0), only=2)
    assert path_work(there_and_back) == pytest.approx(1.0 + 2.0 * (1.0 + 0.5 * 0.5 * 2.0))


def increment(viscous=0.0, **energy):
    return Increment(3, 0.5, None, Response(np.zeros(3), 1.0, energy, viscous_force=viscous), 0.1)


GATES = SimpleNamespace(stabilisation=0.05, viscous_force=0.05)


@pytest.mark.parametrize(("coefficient", "energy", "remedy"), REFUSED["hourglass modes"])
def test_hourglass_modes_that_carry_or_run_free(coefficient, energy, remedy):
    """Without stiffness they cost nothing and move most: their cost with the usual one counts."""
    message = rf"increment 3: hourglass energy.*the limit gates\.hourglass is 5\.0%\. {remedy}"
    with refusal(message):
        require_small_hourglass(increment(internal=1.0, hourglass=energy), 0.05, coefficient)
    require_small_hourglass(increment(internal=1.0, hourglass=energy / 100), 0.05, coefficient)


@pytest.mark.parametrize(("damped", "force", "message"), REFUSED["stabilisation"])
def test_stabilisation_that_dissipates_or_pulls(damped, force, message):
    arguments = GATES, 1e-4, np.array([0.0, 6.0, 8.0])
    require_small_viscosity(increment(0.4, internal=2.0, stabilisation=0.09), *arguments)
    with refusal(message):
        require_small_viscosity(increment(force, internal=2.0, stabilisation=damped), *arguments)


def test_drag_on_loose_yarns_that_carries_load():
    """What viscous flows have dissipated is not counted: they have a gate of their own."""
    loose = GATES, 0.0, np.array([0.0, 6.0, 8.0])
    flowed = replace(increment(0.4, internal=2.0, stabilisation=1.09), damped=1.0)
    require_small_viscosity(flowed, *loose)
    message = r"increment 3: the drag on yarns .* is 6\.0% of the reaction, 10 N; .* Tie or grip these yarns"
    with refusal(message):
        require_small_viscosity(increment(0.6, internal=2.0), *loose)
    with refusal(r"the drag on yarns .* has dissipated 6\.0% of"):
        require_small_viscosity(replace(flowed, damped=0.97), *loose)


def test_viscous_flows_are_measured_against_what_yarns_store_at_rest_too():
    """A slack cell may store less under load than at rest."""
    gates = SimpleNamespace(flow=0.05, ledger=0.05, penalty=0.05)
    yarn = SimpleNamespace(youngs_modulus=1.0, diameter=1.0)
    recorder = recorded(3 * END * LOAD, 1.5 * (END * LOAD) ** 2)
    flowed = replace(increment(internal=-0.5), damped=0.1)
    message = r"increment 3: viscous flows.*dissipated more than the internal energy; the limit gates\.flow is 5\.0%"
    with refusal(message):
        require_sound(flowed, recorder, gates, yarn)
    require_sound(flowed, recorder, gates, yarn, internal=lambda response: 4.0 + response.energy["internal"])


@pytest.mark.parametrize(
    ("specimen", "refinement", "across", "needed"),
    [("knit", 1.0, 2.5, 3), ("pair", 1.0, 6.9, 7), ("pair", 2.0, 3.4, 3.5), ("pair", 3.0, 2.9, 3)],
)
def test_elements_that_are_too_large_for_the_yarn(specimen, refinement, across, needed):
    fewest = fewest_across(specimen, refinement)
    with refusal(rf"mesh\.size is .*gates\.elements_across requires {needed}: use") as caught:
        require_elements_across(2 / across, fewest)
    require_elements_across(float(str(caught.value).split(": use ")[1].split()[0]), fewest)
    require_elements_across(2 / needed, fewest)


def test_a_mesh_that_does_not_fit_into_memory():
    free = psutil.virtual_memory().available
    require_memory(free / 2, "mesh.size", 0.1, "a mesh", power=3)
    message = r"mesh\.size is 0\.1 yarn radii: a mesh would take about .* GiB.*use about 0\.21 or more"
    with refusal(message):
        require_memory(8 * free, "mesh.size", 0.1, "a mesh", power=3)


S = np.linspace(0, 20, 41)


def stations(*curves):
    yarn = np.repeat(np.arange(len(curves)), [len(curve) for curve in curves])
    s = np.concatenate([np.append(0, np.cumsum(np.linalg.norm(np.diff(c, axis=0), axis=1))) for c in curves])
    return Stations(yarn, s, np.concatenate(curves))


def overlap(*curves, **repeats):
    at = stations(*curves)
    return largest_overlap(at, at.position, 1.0, **repeats)


def line(y, z=0.0):
    return np.column_stack([S, 0 * S + y, 0 * S + z])


@pytest.mark.parametrize("depth", [0.0, 0.3, 1.7])
@pytest.mark.parametrize("angle", [0, 7, 90])
def test_straight_yarns(depth, angle):
    turn = np.radians(angle)
    across = np.column_stack([10 + (S - 10) * np.cos(turn), (S - 10) * np.sin(turn), 0 * S + 2 - depth])
    # Places lie at most a quarter of the radius apart.
    assert overlap(line(0.0), across) == pytest.approx(depth, abs=0.03)


def test_images_overlap_as_yarns_do():
    rows = {"length": np.array([20.0]), "vectors": np.array([[20.0, 0, 0], [0, 1.6, 0]])}
    assert overlap(line(0.0), **rows) == pytest.approx(0.4, abs=0.02)
    # A yarn goes on as its own image along the first vector, and does not overlap there.
    rows["vectors"] = np.array([[20.0, 0, 0], [0, 5.0, 0]])
    assert overlap(line(0.0), **rows) == 0.0
    # Yarns beyond those that repeat themselves are images, which are no other yarns.
    rows["vectors"] = np.array([[20.0, 0, 0], [0, 0.9, 3.0]])
    assert overlap(line(0.0), line(0.0), **rows) == 0.0
    # A yarn and the second image of another one
    rows["length"] = np.array([20.0, 20.0])
    assert overlap(line(0.0), line(4.0, 6.5), **rows) == 0.0
    assert overlap(line(0.0), line(1.8, 6.5), **rows) == pytest.approx(1.5, abs=0.02)


def test_a_lattice_is_stretched_and_sheared():
    repeats = Repeats(np.array([1.0]), np.array([[2.0, 0, 0], [0, 3.0, 0]]))
    np.testing.assert_allclose(
        repeats.stretched(np.array([0.1, -0.2, 0.04])), [[2.2, 0.04, 0], [0.06, 2.4, 0]], atol=1e-12
    )


def test_the_gate_names_the_depth_and_the_key():
    with refusal(r"increment 3: yarns overlap by 0.61 radii; the limit gates.overlap is 0.5") as raised:
        require_apart(0.61, 3, 0.5)
    assert isinstance(raised.value, CoarseIncrement)  # a shorter one may keep them apart
    assert not raised.value.bearable
    require_apart(0.49, 4, 0.5)
