"""The 3 x 3 knit of beams in contact: work stored or lost, yarns in balance; beams that lead spline yarns."""

import numpy as np
import pytest

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.loading.history import load_path
from knitstudy.knit.models.beam.build import beam_knit
from knitstudy.knit.models.spline_yarns import build as guided
from knitstudy.knit.models.spline_yarns.build import discretise
from knitstudy.knit.simulate import build, solve
from knitstudy.knit.yarns.network import grips, tension
from knitstudy.mechanics.core.increment import Settings
from knitstudy.mechanics.core.linear import LU
from knitstudy.mechanics.core.load_path import trace
from knitstudy.mechanics.core.rotation import exp
from knitstudy.run.configuration import load_scene


@pytest.fixture(scope="module")
def scenes(full):
    """Scenes of the study, with beams of the study only at full resolution."""
    loaded = {name: load_scene(f"beam-isotropic-{name}") for name in ("course", "wale")}
    return (
        loaded if full else {name: scene.replace("mesh.beam_size", 10 / 9) for name, scene in loaded.items()}
    )


@pytest.fixture(scope="module")
def loop_knit(scenes):
    return fabric_of(lay_out(scenes["course"]))


YIELDING = {"beam.section": "hertz", "beam.tie": "patch"}


@pytest.mark.parametrize(
    ("direction", "strain", "keys"), [("course", 0.01, {}), ("wale", 0.01, {}), ("wale", 0.06, YIELDING)]
)
def test_every_yarn_is_in_balance(scenes, loop_knit, direction, strain, keys, verify):
    """What ties and contact exert on a yarn is what its grips hold against, also where yarns touch beside ties."""
    scene = scenes[direction].vary(keys)
    beams = beam_knit(scene, loop_knit)
    network, model = beams.network, beams.model
    ends = grips(network, loop_knit, direction)
    drive = tension(ends, load_path(scene.replace("load.strain", strain), loop_knit), "fixed")
    # An ulp of a position of 50 mm times EA over an element's length is 2e-9 of the mean force at 0.25 % in course.
    *_, last = trace(model, drive, Settings(increments=4, residual_tolerance=1e-8, predictor=1), LU())
    assert np.any(last.state.contact.force[beams.tied]) == bool(keys)
    crossings = loop_knit.crossings
    exerted = beams.at_crossings(last.state)["crossing_force"]
    assert np.all(np.linalg.norm(exerted[beams.tied], axis=1) > 0)
    node_force = last.response.force.reshape(-1, 6)[:, :3]
    gripped = np.union1d(ends.held, ends.driven)
    yarn_of_node = np.zeros(len(node_force), dtype=int)
    yarn_of_node[network.station_node] = network.stations.yarn
    rest = np.zeros((len(loop_knit.centrelines), 3))
    np.add.at(rest, crossings.yarn[:, 0], exerted)
    np.add.at(rest, crossings.yarn[:, 1], -exerted)
    np.add.at(rest, yarn_of_node[gripped], node_force[gripped])
    level = np.abs(exerted).max()
    verify.at_most(
        f"knit of beams in contact, {direction} to {strain:.0%}: balance of yarns",
        np.abs(rest).max() / level,
        1e-6,
    )


@pytest.mark.parametrize("size", [6, pytest.param(30, marks=pytest.mark.full)])
def test_loops_that_hang_loose_close_in_one_increment(size, verify):
    """Cut cells in wale tension begin with an even stretch, which springs hold at first.

    With the tangent at rest 6 x 6 cells took 56 iterations; without springs 30 x 30 cells did not get there.
    """
    scene = load_scene("domain-beams-isotropic-course-10x10")
    scene = scene.vary({"load.direction": "wale", "pattern.loops": size, "pattern.rows": size})
    problem = build(scene, fabric_of(lay_out(scene)))
    first = next(increment for increment in problem.increments() if increment.load > 0)
    assert first.load == pytest.approx(1 / scene.solver.increments)
    verify.at_most(
        f"{size} x {size} loose loops in wale tension: Newton iterations", first.newton_iterations, 20
    )


ACROSS = {
    "yarn.transverse_modulus": 1e9,
    "yarn.transverse_poisson_ratio": 0.4,
    "yarn.axial_shear_modulus": 4e8,
}
TURN, SHIFT = np.array([0.3, -0.2, 0.5]), np.array([2e-3, -1e-3, 3e-3])


@pytest.fixture(scope="module")
def knit():
    scene = load_scene("dns-isotropic-wale-coarse")
    fabric = fabric_of(lay_out(scene))
    return scene, fabric, discretise(scene, fabric)


def test_yarns_follow_a_rigid_motion_of_the_beams(knit, verify):
    """Every coefficient turns with the knit, and those of the constant move with it."""
    scene, fabric, parts = knit
    beams = build(scene.vary(guided.BEAMS), fabric)
    guide = guided.BeamGuide(lambda: beams, fabric, parts.space, np.arange(len(parts.nodes)))
    stations = beams.stations
    rotation = exp(TURN)
    moved = stations.position @ rotation.T + SHIFT - stations.position
    way = np.hstack([moved, np.tile(TURN, (len(moved), 1))])
    guide.follow(stations, [0.0, 1.0], [np.zeros_like(way), way])
    change = guide(0.0, 1.0).reshape(-1, 3)
    expected = parts.nodes @ rotation.T - parts.nodes + parts.unity[:, None] * SHIFT
    off = np.abs(change - expected).max() / np.abs(expected).max()
    verify.at_most("spline yarns led by beams: a rigid motion, off by", off, 1e-3)
    assert guide(0.0, 1.1) is None, "the beams did not get there"


def test_what_beams_refuse_is_no_error(knit, monkeypatch):
    """A beam that is too long for a bend, and a yarn whose axis beams do not know."""
    scene, fabric, parts = knit
    monkeypatch.setattr(guided, "LARGE", 1)
    nodes = np.arange(len(parts.nodes))
    monkeypatch.setitem(guided.BEAMS, "mesh.beam_size", 3.0)
    assert guided.guide_of(scene, fabric, parts.space, nodes)(0.0, 1.0) is None
    directional = scene.vary({"yarn.material": "transversely_isotropic"} | ACROSS)
    assert guided.guide_of(directional, fabric, parts.space, nodes) is None


@pytest.mark.full
def test_forces_do_not_depend_on_a_guide(knit, verify, monkeypatch):
    scene, fabric, _ = knit
    alone = solve(scene, fabric)
    monkeypatch.setattr(guided, "LARGE", 1)
    led = solve(scene, fabric)
    assert led["newton_iterations"].sum() != alone["newton_iterations"].sum(), "it was led"
    verify.within(
        "spline yarns led by beams: force over that without", led["force"][-1] / alone["force"][-1], 1, 1e-6
    )
