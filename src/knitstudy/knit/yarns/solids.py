"""Solid yarns of a fabric under load, of any discretisation: ties, contact, load, solver and history.

Sections 2.2 and 2.3 of the paper. `hexahedra` and `spline_yarns` divide the yarns; `assemble` joins them at their
crossings, and `problem` adds grips, load, observers and checks.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import scipy.sparse as sp

from knitstudy.knit.contacts.facets import (
    CrossingFacets,
    crossing_forces,
    touching_points,
)
from knitstudy.knit.contacts.kinematics import section_motion
from knitstudy.knit.geometry.crossings import tied_crossings
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.loading.gates import require_sound
from knitstudy.knit.loading.history import Motion, Stations, load_path
from knitstudy.knit.loading.solve import Check, Problem, Reported, settings_of
from knitstudy.knit.mesh.sweep import SweptMesh
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.scene.shared_sections import Tie
from knitstudy.knit.yarns.discretisation import Discretisation
from knitstudy.knit.yarns.interactions import (
    Ties,
    drag_of,
    tie_crossings,
)
from knitstudy.mechanics.contact.interaction import Contact
from knitstudy.mechanics.contact.solid import SolidModel, SolidState
from knitstudy.mechanics.core.arrays import Bools, Floats, Ints
from knitstudy.mechanics.core.increment import Increment, PrescribedDisplacement
from knitstudy.mechanics.core.linear import LU, LinearSolver
from knitstudy.mechanics.core.linear.krylov import Krylov
from knitstudy.mechanics.core.linear.three_scale import AlgebraicMultigrid, KnitStructure, ThreeScale
from knitstudy.mechanics.core.model import Stabilisation, transformation

CONTACT_POINTS = 3
"""Gauss points along each side of a facet or cell: an odd number, as yarns touch first over the middle of a facet.

With 2, contact of a pressed pair begins late (force -13 %); fewer than 3 miss 5 % or more of a wave of pressure as long
as a cell (24 % with 2, 2.2 % with 3).
"""
# Distance up to which pairs of points and surfaces are followed, over the yarn's radius
MARGIN = 0.3

# Up to here sparse LU replaces iterations that fail; beyond, it takes too much time and memory
DIRECT_UNKNOWNS = 20_000


@dataclass(frozen=True, eq=False)
class SolidYarns:
    """The solid yarns of a fabric, joined at their crossings."""

    parts: Discretisation  # nodes and elements of the yarns
    model: SolidModel
    ties: Ties
    facets: CrossingFacets
    retained: Ints  # (n,) nodes that depend on no others, ascending

    @cached_property
    def unknown(self) -> Ints:
        """Position of every node (N,) among those retained, -1 where it depends on others."""
        position = np.full(len(self.parts.nodes), -1)
        position[self.retained] = np.arange(len(self.retained))
        return position

    @property
    def touches(self) -> bool:
        """Whether yarns touch."""
        return self.model.contact is not None

    @property
    def stride(self) -> float:
        """Largest correction [m]: the distance within which contact is searched."""
        return np.inf if self.model.contact is None else self.model.contact.margin

    @property
    def elements(self) -> int:
        """Number of elements."""
        return sum(len(group.connectivity) for group in self.model.groups)

    def attributes(self) -> dict[str, float]:
        """Return the attributes of a history for ties and contact."""
        attributes = self.ties.attributes()
        contact = self.model.contact
        if contact is not None:
            limit = self.model.penetration.limit
            attributes |= {"facets_around": int(contact.surfaces.cells[0, 1]), **contact.law.attributes()}
            attributes |= {"friction": contact.law.friction, "penetration_limit": limit}
        return attributes

    def fields(self, state: SolidState) -> dict[str, Floats]:
        """Return the variables of a history that are known at its last increment alone."""
        return {"node_displacement": self.model.node_displacement(state)}

    def record(self, increment: Increment) -> Reported:
        """Return columns of the history, and of the points in contact, with the net forces on every yarn.

        Net force (Y, 3) [N] and moment (Y, 3) [N m] of all interactions on every yarn (Fig. 10a): at a free node the
        internal force equals the force of the interactions; grips are left out. Moments are about the mean of the
        yarn's stations.
        """
        parts = self.parts
        mesh = self.parts.mesh
        node_force = increment.response.node_force
        assert node_force is not None  # of solids
        columns, points = self.columns(increment.state)
        force = node_force.copy()
        force[np.concatenate([parts.ends.held, parts.ends.driven])] = 0
        position = parts.nodes + self.model.node_displacement(increment.state)
        stations = mesh.centres + columns["centreline_displacement"]
        resultant, moment = np.zeros((2, mesh.yarns, 3))
        for yarn in range(mesh.yarns):
            here = parts.nodes_of(yarn)
            centre = stations[mesh.yarn_of_slice == yarn].mean(axis=0)
            arm = position[here] - parts.unity[here, None] * centre
            resultant[yarn] = parts.unity[here] @ force[here]
            moment[yarn] = np.cross(arm, force[here]).sum(axis=0)
        return columns | {"yarn_force": resultant, "yarn_moment": moment}, points

    def columns(self, state: SolidState) -> Reported:
        """Return the motion of stations and crossings and the forces at crossings, and the points in contact."""
        parts, facets = self.parts, self.facets
        moved = self.model.node_displacement(state)
        displacement = parts.sampled(moved)
        force = self.ties.resultants(moved)
        touching = {}
        points = {}
        contact = self.model.contact
        if contact is not None:
            near = self.model.contact_points(state)
            points = touching_points(contact, near, facets, parts.rings)
            force += crossing_forces(points, len(force))
            gap = contact.smallest_gap(near)
            # Where nothing is near there is no gap.
            touching = {
                "smallest_gap": gap if np.isfinite(gap) else np.nan,
                "augmentations": state.augmentations,
            }
        sections = section_motion(facets.crossings, parts.mesh, parts.sampled(parts.nodes), displacement)
        columns = {
            "centreline_displacement": parts.mesh.ring_means(displacement),
            "crossing_force": force,
            "crossing_displacement": facets.displacement(displacement),
            "section_gradient": sections.gradient,
            "section_displacement": sections.displacement,
        }
        return columns | touching, points


def assemble(
    scene: Scene,
    tie: Tie,
    fabric: Fabric,
    parts: Discretisation,
    tied: Bools | None = None,  # (K,) crossings that are tied; by default as the scene says
    spread: sp.csr_matrix | None = None,  # (N, n) nodes as sums of the retained ones, where all are retained
    # bool (Y, Y), which yarns may touch; by default all, themselves included
    meets: Bools | None = None,
) -> SolidYarns:
    """Return the solid yarns of a scene: tied at some crossings, in contact elsewhere if the scene says so.

    Raises MeshError if an element is folded, a crossing cannot be tied, or yarns overlap.
    """
    if tied is None:
        edges, direction = scene.value("contact.tied_edges"), scene.value("load.direction")
        tied = tied_crossings(fabric.crossings, scene.kind.interaction.touches, edges, direction)
    ties = tie_crossings(parts, fabric, tied, tie.radius, scene.yarn.youngs_modulus)
    facets = CrossingFacets.of(fabric.crossings, parts.mesh)
    groups = parts.groups(parts.nodes)
    volume = parts.volume(groups)
    retained = np.arange(len(parts.nodes))
    if parts.dependence is not None:
        spread, retained = transformation(parts.dependence)
    stabilisation = None
    viscosity = scene.value("solver.stabilisation")
    if viscosity:
        own = volume if spread is None else spread.T @ volume
        stabilisation = Stabilisation.of(viscosity, scene.yarn.youngs_modulus, parts.size, own)
    solids = (parts.nodes, groups, parts.size, spread, stabilisation, ties.links)
    if parts.contact is None:
        return SolidYarns(parts, SolidModel(*solids), ties, facets, retained)
    # A driven grip that is free across the load holds no yarn.
    grips = [parts.ends.held] + [parts.ends.driven] * (scene.load.lateral == "fixed")
    fixed = np.concatenate([*grips, ties.joined])
    slave = scene.value("contact.slave") or "both"
    if slave != "both":
        row = np.arange(len(parts.surfaces.cells))
        own = row[:, None] < row if slave == "lower" else row[:, None] > row
        meets = own if meets is None else own & meets
    model = SolidModel(
        *solids,
        contact=Contact(
            parts.nodes,
            parts.surfaces,
            parts.contact.law,
            meets=meets,
            one_pass=slave != "both",
            free=ties.free,
            points=CONTACT_POINTS,
            splits=scene.specimen != "cell",  # cells are solved directly
            margin=MARGIN * parts.mesh.radius,
            overlap=parts.contact.overlap,
        ),
        penetration=parts.contact.penetration,
        drag=None if viscosity else drag_of(parts, fixed, volume, scene.yarn.youngs_modulus),
    )
    return SolidYarns(parts, model, ties, facets, retained)


def problem(scene: Scene, fabric: Fabric, yarns: SolidYarns) -> Problem:
    """Return solid yarns with the load of a scene, observers and checks."""
    model = yarns.model
    motion = load_path(scene, fabric)
    prescribed, driven = _prescribed(yarns, motion, scene.load.lateral)
    return Problem(
        scene=scene,
        model=model,
        prescribed=prescribed,
        solver=linear_solver("auto", yarns, prescribed),
        settings=settings_of(scene.solver, yarns.touches, yarns.stride),
        motion=motion,
        driven=driven,
        stations=stations_of(yarns.parts.mesh),
        observer=yarns,
        checks=(sound(scene, model),),
        constants=yarns.ties.constants(),
        fields=yarns.fields if "fields" in scene.outputs else None,
        attributes={"dof": yarns.parts.nodes.size, "elements": yarns.elements, **yarns.attributes()},
    )


def sound(scene: Scene, model: SolidModel) -> Check:
    """Return the check of increments of solid yarns by the gates of a scene."""
    harder = "Use a larger contact.normal_stiffness and tangential_stiffness"
    return partial(
        require_sound,
        gates=scene.gates,
        yarn=scene.yarn,
        harder=harder,
        hourglass=scene.value("solver.hourglass") or 0.0,
        stabilisation=scene.value("solver.stabilisation") or 0.0,
        loaded=model.loaded,
    )


def stations_of(mesh: SweptMesh) -> Stations:
    """Return the centres of sections."""
    return Stations(mesh.yarn_of_slice, mesh.arc_length, mesh.centres)


def _prescribed(yarns: SolidYarns, motion: Motion, lateral: str) -> tuple[PrescribedDisplacement, Ints]:
    """Return prescribed unknowns, and the unknowns of driven nodes (k, 3) whose forces add up to the reaction."""
    ends, unity = yarns.parts.ends, yarns.parts.unity
    held, driven = (3 * yarns.unknown[nodes][:, None] + np.arange(3) for nodes in (ends.held, ends.driven))
    axes = range(3) if lateral == "fixed" else [motion.axis]
    components = driven[:, axes]
    moved = motion.displacement[:, axes]
    fixed = np.concatenate([held.ravel(), components.ravel()])
    value = np.zeros((len(moved), len(fixed)))
    value[:, held.size :] = (unity[ends.driven][:, None] * moved[:, None]).reshape(len(moved), -1)
    return PrescribedDisplacement(fixed, value, motion.corners, motion.stops), driven[unity[ends.driven] == 1]


def structure(yarns: SolidYarns, prescribed: PrescribedDisplacement) -> KnitStructure:
    """Return where the unknowns lie; a patch reaches one element around nodes that are joined or touch.

    Where nodes are coefficients there are no patches: each has a share in whole sections and several spans, so that
    patches would take in most of the yarns.
    """
    parts, kept = yarns.parts, yarns.retained
    patches = bool(np.all(parts.unity == 1))
    inside = np.zeros(len(kept), dtype=bool)
    if patches:
        joined = yarns.unknown[yarns.ties.joined]
        inside[joined[joined >= 0]] = True
        inside = yarns.model.assembly.connection() @ inside > 0
    return KnitStructure(
        position=parts.nodes[kept],
        unity=parts.unity[kept],
        yarn=parts.yarn[kept],
        station=parts.station[kept],
        bandwidth=parts.bandwidth,
        patch=np.flatnonzero(inside) if patches else None,
        fixed=prescribed.fixed,
    )


def linear_solver(name: str, yarns: SolidYarns, prescribed: PrescribedDisplacement) -> LinearSolver:
    """Return a linear solver by its name: three_scale, amg, lu, or auto.

    `auto` takes three scales, and LU where they fail in a small model.
    """
    if name == "lu":
        return LU()
    layout = structure(yarns, prescribed)
    small = name == "auto" and yarns.model.size <= DIRECT_UNKNOWNS
    preconditioner = AlgebraicMultigrid(layout) if name == "amg" else ThreeScale(layout)
    return Krylov(preconditioner, LU() if small else None)
