"""Every variable of histories, contacts and stresses: dimensions, unit and meaning, in one place.

What is written comes from these tables, and so do the tables of docs/architecture.md (`docs/columns.py`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from knitstudy.errors import DataFileError


@dataclass(frozen=True)
class Column:
    """A variable of a file.

    Attributes
    ----------
    dims : tuple of str
    unit : str
    meaning : str
    where : str
        Which files have it; all if empty.
    """

    dims: tuple[str, ...]
    unit: str
    meaning: str
    where: str = ""


@dataclass(frozen=True)
class Columns:
    """The variables that one kind of file may hold, by name."""

    kind: str
    table: dict[str, Column]

    def __getitem__(self, name: str) -> Column:
        """Return a column.

        Raises
        ------
        DataFileError
            If there is none of this name.
        """
        self.require([name])
        return self.table[name]

    def require(self, names: Iterable[str]) -> None:
        """Refuse names that the table does not have.

        Raises
        ------
        DataFileError
            For the first of them.
        """
        for name in names:
            if name not in self.table:
                raise DataFileError(
                    f"a {self.kind} has no variable {name!r}; "
                    "give its dimensions, unit and meaning in knitstudy.loading.columns"
                )

    def variables(self, values: Mapping[str, np.ndarray]) -> dict[str, tuple]:
        """Return arrays as variables of a dataset, in the order of the table.

        Raises
        ------
        DataFileError
            If the table does not have one of them.
        """
        self.require(values)
        return {
            name: (column.dims, values[name], {"units": column.unit, "long_name": column.meaning})
            for name, column in self.table.items()
            if name in values
        }


_INCREMENT = ("increment",)
_VECTOR = ("increment", "xyz")
_CROSSING = ("increment", "crossing")
_SIDE = ("increment", "crossing", "side")
_YARN = ("increment", "yarn_number", "xyz")
_PLANE = ("increment", "plane")
_SHELL = ("plane", "of_plane")
_TOUCHING = "dns with contact"
_CELL = "cell"

HISTORY = Columns(
    "history",
    {
        "load": Column(_INCREMENT, "1", "load factor"),
        "strain": Column(_INCREMENT, "1", "applied strain"),
        "displacement": Column(_INCREMENT, "m", "displacement of the driven side along the load"),
        "driven_displacement": Column(_VECTOR, "m", "displacement of the driven side"),
        "force": Column(_INCREMENT, "N", "reaction of the driven side along the load"),
        "reaction": Column(_VECTOR, "N", "reaction of the driven side"),
        "energy": Column(
            ("increment", "form"),
            "J",
            "ledger of energies: external, internal, hourglass, penalty, friction, stabilisation",
        ),
        "newton_iterations": Column(_INCREMENT, "1", "Newton iterations"),
        "krylov_iterations": Column(_INCREMENT, "1", "Krylov iterations"),
        "residual": Column(_INCREMENT, "1", "largest unbalanced force over mean internal force"),
        "correction": Column(_INCREMENT, "1", "largest last correction over element size"),
        "seconds": Column(
            ("increment", "phase"),
            "s",
            "time by phase of the Newton iterations: elements, assembly, constraints, setup, solve",
        ),
        "yarn": Column(("station",), "1", "yarn"),
        "arc_length": Column(("station",), "m", "arc length"),
        "centreline": Column(
            ("station", "xyz"), "m", "undeformed centreline: centres of sections, or nodes of beams"
        ),
        "centreline_displacement": Column(
            ("increment", "station", "xyz"), "m", "displacement of the centreline"
        ),
        "node_displacement": Column(
            ("node", "xyz"),
            "m",
            "displacement of all nodes at full load, of solid yarns its coefficients",
            'dns with output "fields"',
        ),
        "crossing_force": Column(
            (*_CROSSING, "xyz"), "N", "force of the interaction on the lower row's yarn", "dns, beam"
        ),
        "crossing_displacement": Column(
            (*_SIDE, "xyz"), "m", "mean displacement of the facets at the crossing", "dns, beam"
        ),
        "crossing_gap": Column(
            _CROSSING, "m", "gap of the contact, or of the tied points, at the crossing", "beam"
        ),
        "crossing_slip": Column(_CROSSING, "m", "length slipped since first contact", "beam"),
        "crossing_tied": Column(("crossing",), "1", "1 where the crossing is tied", "dns, beam"),
        "tied_area": Column(("crossing",), "m2", "tied area, nan where none is", "dns"),
        "tied_centroid": Column(("crossing", "xyz"), "m", "its centroid", "dns"),
        "cell_strain": Column(_PLANE, "1", "strains in the plane: course, wale, angle of shear", _CELL),
        "force_per_width": Column(
            _PLANE, "N/m", "forces per undeformed width that do work on these strains", _CELL
        ),
        "tangent_per_width": Column(
            (*_PLANE, "of_plane"), "N/m", "derivatives of these forces by these strains", _CELL
        ),
        "membrane_stiffness": Column(
            _SHELL, "N/m", "at rest: forces per width by strains in the plane, A of a shell", _CELL
        ),
        "coupling_stiffness": Column(_SHELL, "N", "at rest: forces per width by curvatures, B", _CELL),
        "bending_stiffness": Column(_SHELL, "N m", "at rest: moments per width by curvatures, D", _CELL),
        "section_gradient": Column(
            (*_SIDE, "xyz", "undeformed_xyz"),
            "1",
            "mean deformation gradient of the yarn's section at the crossing",
            "dns",
        ),
        "section_displacement": Column(
            (*_SIDE, "xyz"), "m", "displacement of the centreline's point at the crossing", "dns"
        ),
        "yarn_force": Column(_YARN, "N", "net force of the interactions on a yarn", "dns"),
        "yarn_moment": Column(
            _YARN, "N m", "their net moment about the mean of the yarn's centreline", "dns"
        ),
        "smallest_gap": Column(
            _INCREMENT,
            "m",
            "smallest gap of all pieces of yarn that are near each other",
            "dns with contact, beam",
        ),
        "gap_beside_ties": Column(
            _INCREMENT, "m", "smallest gap of tied yarns beside their ties", "dns with contact and ties"
        ),
        "augmentations": Column(_INCREMENT, "1", "updates of the contact multipliers", _TOUCHING),
        "joint_couple": Column(
            _VECTOR,
            "N m",
            "couple that the joints leave without balance, summed: it cancels on a symmetric knit",
            "rom2d, rom3d",
        ),
        "joint_couple_magnitude": Column(
            _INCREMENT,
            "N m",
            "sum of the magnitudes of these couples: 0 for rigid ties, small for springs between arms",
            "rom2d, rom3d",
        ),
        "joint_stiffness": Column(
            ("crossing", "xyz", "displacement_xyz"),
            "N/m",
            "force over displacement of the springs, nan where there are none",
            "rom3d",
        ),
        "window_crossing": Column(("crossing",), "1", "1 in the cells that a window is asked for", "window"),
        "seam_yarn": Column(
            ("seam",), "1", "yarn that is solid on one side of it and beam on the other", "window"
        ),
        "seam_arc_length": Column(("seam",), "m", "where along the yarn", "window"),
        "seam_force": Column(
            ("increment", "seam", "xyz"), "N", "force of the beam on the solid yarn", "window"
        ),
        "seam_moment": Column(
            ("increment", "seam", "xyz"),
            "N m",
            "moment of the beam on the section of the solid yarn",
            "window",
        ),
        "seam_jump": Column(
            _INCREMENT, "N", "largest difference of the forces on either side of a seam", "window"
        ),
        "contact_increment": Column(("point",), "1", "increment that it belongs to", _TOUCHING),
        "contact_crossing": Column(
            ("point",), "1", "nearest crossing of the two yarns, -1 away from all", _TOUCHING
        ),
        "contact_side": Column(
            ("point",), "1", "0: on the lower row's yarn, 1: on the upper row's", _TOUCHING
        ),
        "contact_yarn": Column(("point",), "1", "yarn that carries the point", _TOUCHING),
        "contact_target": Column(("point",), "1", "yarn that it touches", _TOUCHING),
        "contact_cell": Column(
            ("point", "grid"), "1", "its facet: layer along the yarn, place around it", _TOUCHING
        ),
        "contact_position": Column(("point", "xyz"), "m", "current position", _TOUCHING),
        "contact_reference": Column(("point", "xyz"), "m", "undeformed position", _TOUCHING),
        "contact_area": Column(("point",), "m2", "undeformed area that the point stands for", _TOUCHING),
        "contact_cell_area": Column(("point",), "m2", "undeformed area of its facet", _TOUCHING),
        "contact_normal": Column(("point", "xyz"), "1", "outward normal of the touched surface", _TOUCHING),
        "contact_pressure": Column(("point",), "Pa", "contact pressure", _TOUCHING),
        "contact_traction": Column(
            ("point", "xyz"), "Pa", "tangential traction on the yarn that carries the point", _TOUCHING
        ),
        "contact_gap": Column(
            ("point",), "m", "gap, negative where surfaces penetrate each other", _TOUCHING
        ),
        "contact_slip": Column(("point",), "m", "length slipped since the point first touched", _TOUCHING),
        "contact_sticks": Column(("point",), "1", "1 sticks, 0 slips", _TOUCHING),
    },
)
"""Histories of all fidelities; `contact_...` has a row for every point that touches at every increment."""

CONTACTS = Columns(
    "file of contacts",
    {
        "strain": Column(_INCREMENT, "1", "applied strain"),
        "row": Column(("crossing",), "1", "interlock row"),
        "column": Column(("crossing",), "1", "loop column"),
        "zone": Column(("crossing",), "1", "0 left lower, 1 right lower, 2, 3 upper"),
        "yarn": Column(("crossing", "side"), "1", "the lower row's yarn, the upper row's"),
        "arc_length": Column(("crossing", "side"), "m", "of the crossing along its yarns"),
        "centroid": Column(
            ("crossing", "xyz"),
            "m",
            "undeformed centroid of the contact area: weighted with the pressure at the last increment in contact "
            "(tie: of the tied area; never in contact: halfway between the closest points)",
        ),
        "normal": Column(
            ("crossing", "xyz"),
            "1",
            "from the lower row's yarn to the upper row's, undeformed: the line of the closest points",
        ),
        "area": Column(("crossing",), "m2", "contact area at the last increment"),
        "tied": Column(("crossing",), "1", "1 where the crossing is tied"),
        "force": Column((*_CROSSING, "xyz"), "N", "on the lower row's yarn: the sum of the two resultants"),
        "normal_resultant": Column(
            (*_CROSSING, "xyz"), "N", "of the pressure on the lower row's yarn (tie: along `normal`)"
        ),
        "tangential_resultant": Column(
            (*_CROSSING, "xyz"), "N", "of the friction on the lower row's yarn (tie: across `normal`)"
        ),
        "centroid_displacement": Column((*_SIDE, "xyz"), "m", "of the facets at the crossing"),
        "relative_displacement": Column(
            (*_CROSSING, "xyz"), "m", "of the upper row's side to the lower row's"
        ),
        "zones": Column(
            _CROSSING,
            "1",
            "groups of touching facets that share edges or corners: the larger number of the two sides",
        ),
        "contact_area": Column(_CROSSING, "m2", "undeformed, mean of the two sides"),
        "contact_centroid": Column((*_CROSSING, "xyz"), "m", "where the pressure is now, nan where open"),
        "contact_normal": Column(
            (*_CROSSING, "xyz"),
            "1",
            "mean under pressure, from the lower row's yarn to the upper row's, nan where open",
        ),
        "slip": Column(_CROSSING, "m", "mean length slipped since first contact, nan where open"),
        "stick_share": Column(_CROSSING, "1", "share of the contact area that sticks, nan where open"),
        "largest_pressure": Column(
            _CROSSING, "Pa", "largest mean pressure of a facet, 0 where open, nan where tied"
        ),
        "yarn_force": Column(_YARN, "N", "net force of all interactions on a yarn"),
        "yarn_moment": Column(_YARN, "N m", "their moment about the mean of its centreline"),
        "section_rotation": Column((*_SIDE, "xyz"), "rad", "rotation vector of the yarn's section"),
        "relative_rotation": Column(
            (*_CROSSING, "xyz"),
            "rad",
            "rotation vector of the upper row's section against the lower row's",
        ),
        "tilt": Column(_SIDE, "rad", "angle between the yarn's axis before and now"),
        "spin": Column(_SIDE, "rad", "twist of the section about the yarn's own axis (swing and twist)"),
        "segment_contraction": Column(
            (*_SIDE, "neighbour"),
            "1",
            "loss of length of the chord to the crossing before and to the one after it on the yarn, nan at its ends",
        ),
        "section_contraction": Column(_SIDE, "1", "loss of area of the yarn's section"),
        "axial_stretch": Column(_SIDE, "1", "stretch of the section along the yarn"),
        "normal_stretch": Column(_SIDE, "1", "stretch of the section along the line of the closest points"),
        "across_stretch": Column(_SIDE, "1", "stretch of the section across that line"),
        "centreline_relative_displacement": Column(
            (*_CROSSING, "xyz"),
            "m",
            "of the upper row's centreline to the lower row's at the crossing",
        ),
        "sliding": Column(
            _SIDE,
            "m",
            "way of the upper row's surface over the lower row's along the yarn since first contact, 0 where tied, "
            "nan where open",
        ),
        "contact_travel": Column(
            _SIDE,
            "m",
            "way of the contact area along the yarn since first contact, 0 where tied, nan where open",
        ),
        "contact_spin": Column(
            _SIDE,
            "rad",
            "angle of the contact area about the yarn's centreline since first contact, 0 where tied, nan where open",
        ),
    },
)
"""What is found at the crossings of solid yarns."""

_EXTENT = ("segment", "extent")

STRESSES = Columns(
    "file of stresses",
    {
        "cell_stress": Column(
            ("cell", "component"),
            "Pa",
            "mean Cauchy stress of a hexahedron of the mesh: xx, yy, zz, xy, yz, xz",
        ),
        "cell_volume": Column(("cell",), "m3", "its deformed volume"),
        "cell_place": Column(("cell", "xyz"), "m", "its deformed middle"),
        "cell_yarn": Column(("cell",), "1", "its yarn"),
        "piece_yarn": Column(("piece",), "1", "yarn of a piece between two neighbouring crossings"),
        "piece_arc_length": Column(("piece", "end"), "m", "where it begins and ends"),
        "piece_segment": Column(("piece",), "1", "segment that it is part of, -1 where there is none"),
        "piece_stress": Column(
            ("piece", "extent", "xyz", "normal_xyz"),
            "Pa",
            "mean Cauchy stress of the piece, and of its middle half",
        ),
        "piece_volume": Column(("piece", "extent"), "m3", "deformed volume"),
        "segment_kind": Column(
            ("segment",),
            "1",
            "0 head, 1 and 2 left and right interlock, 3 and 4 left and right leg, 5 sinker",
        ),
        "segment_row": Column(("segment",), "1", "interlock row of its lower or left end"),
        "segment_column": Column(("segment",), "1", "loop column of its lower or left end"),
        "segment_central": Column(("segment",), "1", "1 where it ends in the centre cell"),
        "segment_stress": Column(
            (*_EXTENT, "xyz", "normal_xyz"), "Pa", "mean Cauchy stress of all its pieces, by deformed volume"
        ),
        "segment_volume": Column(_EXTENT, "m3", "their deformed volume"),
        "segment_principal": Column(
            (*_EXTENT, "principal"), "Pa", "principal values of that mean, the largest first"
        ),
        "segment_axis": Column(
            (*_EXTENT, "principal", "xyz"), "1", "their axes in space: lines without a sign"
        ),
        "segment_rotation": Column(
            ("segment", "xyz", "undeformed_xyz"),
            "1",
            "rotation of the affine motion that fits the segment best",
        ),
    },
)
"""What a file of stresses may hold."""
