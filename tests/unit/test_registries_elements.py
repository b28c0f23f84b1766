"""Elements and laws of materials register themselves, from inside or outside of the package."""

import numpy as np
import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.mechanics.elements import ELEMENTS, element
from knitstudy.mechanics.elements.hexahedron import OnePointHexahedron
from knitstudy.mechanics.materials import LAWS, Material, law
from knitstudy.mechanics.materials.isotropic import st_venant_kirchhoff
from knitstudy.mesh.mesher import mesh_fabric
from knitstudy.models.simulate import solve


@pytest.fixture
def toys():
    """An element that carries nothing but forces of its neighbour's doubled, and a law twice as stiff as its like."""

    @element("toy_element", "one point, twice as stiff", hourglass=True)
    class ToyElement(OnePointHexahedron):
        def respond(self, batch, displacement, stiffness, out=None):
            answer = super().respond(batch, displacement, stiffness)
            return type(answer)(
                force=2 * answer.force,
                internal=2 * answer.internal,
                hourglass=2 * answer.hourglass,
                stiffness=2 * answer.stiffness if stiffness else None,
            )

    @law("toy_law", "twice as stiff")
    def toy_law(strain, mu, lame, tangent):
        return st_venant_kirchhoff(strain, 2 * mu, 2 * lame, tangent)

    yield
    ELEMENTS.forget("toy_element")
    LAWS.forget("toy_law")


@pytest.fixture
def pull(plain_scene, knit_of):
    """Return the force of one cell of a knit, pulled a little."""

    def pull(**changes):
        scene = plain_scene.vary(
            {
                "fidelity": "hexahedra",
                "pattern.loops": 1,
                "pattern.rows": 1,
                "load.strain": 0.002,
                "mesh.size": 0.6e-3,
                "gates.elements_across": 2.0,
                "yarn.material": "st_venant_kirchhoff",
                "solver.increments": 1,
                # The toy law leaves the hourglass control as it is.
                "solver.hourglass": 0.01,
            }
            | {key.replace("__", "."): value for key, value in changes.items()}
        )
        knit = knit_of(scene)
        return float(solve(scene, knit, mesh=mesh_fabric(knit, scene.mesh.size))["force"][-1])

    return pull


def test_a_toy_element_goes_through_a_simulation(toys, pull):
    assert pull(mesh__element="toy_element") == pytest.approx(
        2 * pull(), rel=1e-3
    )  # springs of ties stay as they are


def test_a_toy_law_goes_through_a_simulation(toys, pull):
    stiff = pull(yarn__material="toy_law", solver__hourglass=0.02)
    assert stiff == pytest.approx(2 * pull(), rel=1e-3)  # springs of ties stay as they are


def test_names_say_what_they_mean():
    assert {"one_point", "quadratic"} <= set(ELEMENTS.names())
    assert {"hencky", "neo_hookean", "st_venant_kirchhoff"} <= set(LAWS.names())
    assert "one_point (with hourglass control)" in ELEMENTS.allowed()


def test_only_some_elements_take_hourglass_control():
    assert ELEMENTS.find("one_point").hourglass
    assert not ELEMENTS.find("quadratic").hourglass


def test_an_unknown_name_is_answered_with_those_there_are():
    with pytest.raises(ConfigurationError, match=r"mesh.element 'two_point'.*one_point.*quadratic"):
        ELEMENTS.find("two_point")
    with pytest.raises(ConfigurationError, match=r"yarn.material 'hooke'.*hencky"):
        Material("hooke", 1.0, 0.3)


def test_a_name_is_registered_once():
    with pytest.raises(ConfigurationError, match="'hencky' is registered twice"):
        law("hencky", "another")(np.zeros_like)
