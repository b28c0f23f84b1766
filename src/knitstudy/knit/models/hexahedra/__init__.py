"""The model `hexahedra`: solid yarns of linear hexahedra as in the paper (section 2.3), or of quadratic ones."""

from __future__ import annotations

from typing import Annotated, ClassVar

from knitstudy.knit.scene.keys import OneOf, Section, numerics, resolution, section
from knitstudy.knit.scene.kinds import MODELS, FidelityModel
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.scene.sections import SolidYarn
from knitstudy.knit.scene.shared_sections import FacetContact, Size, SolidGates, SolidNewton, Tie, TiedEdges
from knitstudy.knit.scene.specimens import Crossing, Knit
from knitstudy.mechanics.solids.elements import ELEMENTS
from knitstudy.registry import lazy_import


class SolidMesh(Section, group="mesh"):
    """Sizes of solid elements across the yarn and at crossings, and the element."""

    size: Size = resolution("stated", unit="yarn radii")
    """Table 5: 0.3 mm, of a radius of 0.9 mm. Checked: 0.25 to 0.67: force +7 % at 0.67 (docs/notes/sensitivity.md)."""
    refinement: float = numerics(
        "assumed", meaning="size over the size of elements at crossings", default=1.0, ge=1, le=3
    )
    """Slices are closer, and sections finer towards the other yarn (docs/notes/refinement.md). Checked: 1 to 3."""
    element: Annotated[str, OneOf(ELEMENTS.all)] = numerics("stated")
    """Section 2.3: linear hexahedra with reduced integration; quadratic hexahedra are for the reference. Checked: over
    quadratic, tied cell of size 1/3: one_point -3 % in force."""

    @property
    def smallest(self) -> float:
        """Size of elements at crossings in yarn radii: the length scale of contact."""
        return self.size / self.refinement


class FacetKnitContact(TiedEdges, FacetContact):
    """Contact of knits of hexahedra."""


class HexahedralNewton(SolidNewton):
    """Further settings of hexahedra: the coefficient `hourglass`, relative to the shear modulus."""

    hourglass: float = numerics("assumed", unit="shear moduli", meaning="times the shear modulus", gt=0, le=1)
    """Abaqus's default stiffness of C3D8R, 0.005 G. Checked: 0.0025 to 0.05: force -1.4 to +3.8 %
    (docs/notes/sensitivity.md)."""


class HexahedralGates(SolidGates):
    """Additional limits of hexahedra."""

    hourglass: float = numerics("choice", meaning="over the internal energy", default=0.05, gt=0)
    """5 % is the field's rule; at least the usual stiffness of 0.005 G is counted. Checked: 0.05."""
    elements_across: float | None = numerics(
        "choice",
        allowed="a number > 0 of elements of mesh.size across the yarn, or null for 3 of a knit and 7 of a pair",
        default=None,
        gt=0,
    )
    """Force of a tied knit +5 % at 3.3, of a pressed pair within 8 % from 8 on, gates.md. Checked: 2 to 12."""


class HexahedralScene(Scene):
    """Scenes of solid yarns of hexahedra."""

    yarn: SolidYarn = section()
    mesh: SolidMesh = section()
    tie: Tie = section()
    solver: HexahedralNewton = section()
    gates: HexahedralGates = section()


class TiedHexahedra(HexahedralScene, Knit):
    """Knits of tied solid yarns of hexahedra."""

    touches = False


class Hexahedra(HexahedralScene, Knit):
    """Knits of solid yarns of hexahedra in contact."""

    touches = True

    contact: FacetKnitContact = section()


class TiedPairOfHexahedra(HexahedralScene, Crossing):
    """Two tied solid yarns of hexahedra."""

    touches = False


class PairOfHexahedra(HexahedralScene, Crossing):
    """Two solid yarns of hexahedra in contact."""

    touches = True
    implied: ClassVar = {"contact.tied_edges": "outer"}

    contact: FacetContact = section()


MODELS.register(
    FidelityModel(
        name="hexahedra",
        meaning="solid yarns of hexahedra",
        parts=(TiedHexahedra, Hexahedra, TiedPairOfHexahedra, PairOfHexahedra),
        solid=True,
        outputs=("fields", "vtu", "deck"),
        build=lazy_import("knitstudy.knit.models.hexahedra.build:build"),
    )
)
