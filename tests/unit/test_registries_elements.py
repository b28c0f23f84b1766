"""Elements and laws of materials register themselves, from inside or outside of the package."""

import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.mechanics.elements import ELEMENTS, element
from knitstudy.mechanics.elements.hexahedron import OnePointHexahedron
from knitstudy.mechanics.materials import MATERIALS
from knitstudy.mechanics.materials.isotropic import Hencky, StVenantKirchhoff
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

    @MATERIALS.register
    class ToyLaw(StVenantKirchhoff):
        name, meaning = "toy_law", "twice as stiff"

        def respond(self, strain, tangent, axes=None):
            return StVenantKirchhoff(2 * self.youngs_modulus, self.poisson_ratio).respond(strain, tangent)

    yield
    ELEMENTS.forget("toy_element")
    MATERIALS.forget("toy_law")


@pytest.fixture
def pull(plain_scene, knit_of):
    """Return the force of one cell of a knit, pulled a little."""

    def pull(**changes):
        keys = {
            "fidelity": "hexahedra",
            "pattern.loops": 1,
            "pattern.rows": 1,
            "load.strain": 0.002,
            "yarn.material": "st_venant_kirchhoff",
            "solver.increments": 1,
        } | {key.replace("__", "."): value for key, value in changes.items()}
        if keys["fidelity"] == "hexahedra":
            # A toy law leaves the hourglass control as it is.
            keys = {"mesh.size": 0.6e-3, "gates.elements_across": 2.0, "solver.hourglass": 0.01} | keys
        scene = plain_scene.vary(keys)
        knit = knit_of(scene)
        mesh = mesh_fabric(knit, scene.value("mesh.size") or scene.yarn.radius)
        return float(solve(scene, knit, mesh=mesh)["force"][-1])

    return pull


def test_a_toy_element_goes_through_a_simulation(toys, pull):
    assert pull(mesh__element="toy_element") == pytest.approx(
        2 * pull(), rel=1e-3
    )  # springs of ties stay as they are


def test_a_toy_law_goes_through_a_simulation(toys, pull):
    stiff = pull(yarn__material="toy_law", solver__hourglass=0.02)
    assert stiff == pytest.approx(2 * pull(), rel=1e-3)  # springs of ties stay as they are


@pytest.mark.parametrize("fidelity", ["hexahedra", "spline_yarns"])
def test_a_yarn_with_an_axis_goes_through_a_simulation(pull, fidelity):
    """Of equal constants it carries what Hencky's law does; softer in shear it carries less."""
    yarn = {"fidelity": fidelity, "yarn__material": "transversely_isotropic"}
    force = pull(**yarn)
    assert force == pytest.approx(pull(fidelity=fidelity, yarn__material="hencky"), rel=1e-9)
    assert 0.4 * force < pull(**yarn, yarn__axial_shear_modulus=1e8) < 0.95 * force


def test_names_say_what_they_mean():
    assert {"one_point", "quadratic"} <= set(ELEMENTS.names())
    assert {"hencky", "neo_hookean", "st_venant_kirchhoff"} <= set(MATERIALS.names())
    assert "one_point (with hourglass control)" in ELEMENTS.allowed()


def test_only_some_elements_take_hourglass_control():
    assert ELEMENTS.find("one_point").hourglass
    assert not ELEMENTS.find("quadratic").hourglass


def test_an_unknown_name_is_answered_with_those_there_are():
    with pytest.raises(ConfigurationError, match=r"mesh.element 'two_point'.*one_point.*quadratic"):
        ELEMENTS.find("two_point")
    with pytest.raises(ConfigurationError, match=r"yarn.material 'hooke'.*hencky"):
        MATERIALS.find("hooke")


def test_a_name_is_registered_once():
    with pytest.raises(ConfigurationError, match="'hencky' is registered twice"):
        MATERIALS.register(Hencky)
