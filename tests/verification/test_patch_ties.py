"""A cell whose crossings are tied on discs: one force, whatever its yarns are divided into."""

import numpy as np
import pytest
from pull import knit_and_mesh

from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.mesh.mesher import sampled_sections
from knitstudy.knit.simulate import solve
from knitstudy.run.configuration import load_scene

SMALL = {"pattern.loops": 1, "pattern.rows": 1, "load.strain": 5e-4, "solver.increments": 1}
"""A cell, and a strain at which its force is linear."""


@pytest.fixture(scope="module")
def scene():
    return load_scene("dns-tie-course").vary(SMALL)


def force_of_solid_yarns(scene, **degrees):
    chosen = scene.vary(
        {"fidelity": "spline_yarns"} | {f"mesh.{key}": value for key, value in degrees.items()}
    )
    knit = fabric_of(lay_out(chosen))
    return float(solve(chosen, knit, mesh=sampled_sections(knit))["force"][-1])


def force_of_hexahedra(scene, size, **changes):
    chosen = scene.vary({"mesh.size": size, "gates.elements_across": 2} | changes)
    knit, mesh = knit_and_mesh(chosen)
    return float(solve(chosen, knit, mesh=mesh)["force"][-1])


@pytest.fixture(scope="module")
def rich(scene):
    return force_of_solid_yarns(scene, degree=3, crossing_degree=6, crossing_span=0.4)


@pytest.mark.parametrize(("degree", "near", "bound"), [(2, 3, 0.01), (3, 4, 0.005)], ids=["p2-3", "p3-4"])
def test_low_degrees_meet_rich_ones(scene, rich, degree, near, bound, verify):
    force = force_of_solid_yarns(scene, degree=degree, crossing_degree=near)
    name = f"tied cell on discs, solid yarns p = {degree}, {near} at crossings against 6: force"
    verify.at_most(name, abs(force / rich - 1), bound)


def test_quadratic_hexahedra_tend_to_the_same(scene, rich, full, verify):
    """Errors of the patch fall with the square of the size."""
    if not full:
        pytest.skip("takes --full")
    sizes = np.array([1 / 2, 1 / 3])
    force = [force_of_hexahedra(scene, size, **{"mesh.element": "quadratic"}) for size in sizes]
    limit = (sizes[0] ** 2 * force[1] - sizes[1] ** 2 * force[0]) / (sizes[0] ** 2 - sizes[1] ** 2)
    assert force[0] > force[1] > limit
    verify.at_most(
        "tied cell on discs, limit of quadratic hexahedra against solid yarns", abs(limit / rich - 1), 0.01
    )
