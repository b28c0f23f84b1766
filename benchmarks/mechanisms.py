"""The two mechanisms that the paper gives for Fig. 11, by networks of beams in which one thing at a time is changed.

``python benchmarks/mechanisms.py`` (`make mechanisms`) keeps the networks in resources/reference/mechanisms.csv, by
which claims K16 and K17 are judged. No key of a scene changes a lever alone, or EI without EA: networks are made here,
of the parts that the 3D network is made of. Sections are those of straight rods. Joints of ties are rigid, yield as
tied areas do (patch), or let sections turn (pinned), as section 2.6 of the paper says. Springs are the averaged ones of
the direct simulation with friction, beside pinned ties those of the paper's own elements and penalty.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import product

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from knitstudy.errors import KnitstudyError
from knitstudy.knit.contacts.kinematics import twist
from knitstudy.knit.geometry.crossings import tied_crossings
from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.geometry.loop import Loop
from knitstudy.knit.geometry.optimise import optimise
from knitstudy.knit.geometry.specimens import KNITS
from knitstudy.knit.loading.solve import Reported, settings_of, solve_load_path
from knitstudy.knit.models.rom3d.build import PIN
from knitstudy.knit.scene.documents import RESOURCES
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.scene.sections import Yarn
from knitstudy.knit.yarns.joints import (
    CrossingJoints,
    contacts_of_crossings,
    joint_points,
    patch_stiffness,
    spring_axes,
    springs,
)
from knitstudy.knit.yarns.network import NetworkObserver, loaded, spatial_network
from knitstudy.measures.response import largest_out_of_plane
from knitstudy.mechanics.beams.beam import BeamSection
from knitstudy.mechanics.beams.beam_model import BeamModel
from knitstudy.mechanics.core.arrays import Floats, Ints
from knitstudy.mechanics.core.increment import Increment
from knitstudy.paper.sweeps import HELD
from knitstudy.run.behaviour import group_of
from knitstudy.run.committed_tables import keep_table
from knitstudy.run.configuration import load_scene
from knitstudy.run.plan import Plan
from knitstudy.run.simulations import simulate

RUNS = "runs"  # Folder of the solids, unless the study has them
KEPT = RESOURCES / "reference" / "mechanisms.csv"
SCENE = "rom3d-tie-course"  # of the knit, its load and beams
INTERACTIONS = ("isotropic", "tie")
# Of the springs, by the joints of ties
SOLIDS = dict.fromkeys(("rigid", "patch"), "yarns-isotropic-course")
SOLIDS |= {"pinned": "reading-as-printed-yarns-isotropic-course"}
DIAMETERS = (1.2, 1.35, 1.5, 1.65, 1.8, 1.95)  # whose stiffness yarns of 1.8 mm are given [mm]
DRAWN = 1.8  # [mm]
RATIOS = (0.75, 0.8, 0.85, 0.9, 0.95, 1.0)  # course spacing over the drawn one
WIDER = (0.8, 0.9, 1.0, 1.1, 1.2)  # the same where the wale spacing or the yarn in a loop is held
LEG = 4e-3  # Control points of a loop nearer to the middle of its legs move by their share of this height [m]


@dataclass(frozen=True, eq=False)
class SpinObserver(NetworkObserver):
    """Notes by how much sections at crossings have spun about their yarns, besides what others report."""

    at: Ints  # (K, 2) stations of the joints
    axes: Floats  # (K, 2, 3) tangents of the yarns there
    spins: list[Floats] = field(default_factory=list)  # (K, 2) of every increment [rad]

    def record(self, increment: Increment) -> Reported:
        """Return columns of the history."""
        rotation = increment.state.rotation[self.network.station_node[self.at]]
        self.spins.append(np.abs(twist(rotation, self.axes)))
        return super().record(increment)


@dataclass(frozen=True)
class Stiffness:
    """Factors of the stiffness of a yarn."""

    bending: float = 1.0
    torsion: float = 1.0
    stretching: float = 1.0

    def section(self, yarn: Yarn, length: float) -> BeamSection:
        """Return the section of beams of a length [m]; their stiffness in shear is that of the yarn."""
        base = BeamSection.circular(yarn.diameter, yarn.youngs_modulus, yarn.poisson_ratio)
        shear = base.kGA / (1 + base.slenderness * length**2 * base.EA / (12 * base.EI))
        return BeamSection(self.stretching * base.EA, shear, self.bending * base.EI, self.torsion * base.GJ)


class Networks:
    """Knits of one scene as networks of beams, with springs or ties."""

    def __init__(self) -> None:
        self.scene = load_scene(SCENE)
        self.base = fabric_of(lay_out(self.scene))

    @cached_property
    def springs(self) -> dict[str, Floats]:
        """Averaged stiffness (3,) of the springs [N/m] by the joints of ties; their solids are simulated or found."""
        plan = Plan.of()
        contacts = {name: simulate(load_scene(name), RUNS, plan=plan).contacts for name in SOLIDS.values()}
        return {joint: springs(contacts[name], "interface").averaged for joint, name in SOLIDS.items()}

    @cached_property
    def levers(self) -> tuple[float, float]:
        """Levers of the knit as it is drawn."""
        return levers(self.base)

    def pull(self, fabric: Fabric, interaction: str, joint: str, stiffness: Stiffness) -> dict[str, float]:
        """Return the largest out-of-plane motion, the mean spin at crossings without ties, and the force."""
        scene = self.scene
        yarn = self.scene.yarn
        contacts = contacts_of_crossings(fabric, scene.tie.radius)
        points = joint_points(fabric, contacts)
        touching = interaction == "isotropic"
        tied = tied_crossings(fabric.crossings, touching, "outer", scene.load.direction)
        joints = CrossingJoints.all_tied(len(tied))
        if touching:
            axes = spring_axes(contacts["normal"].to_numpy(), "local")
            matrices = np.einsum("a,kai,kaj->kij", self.springs[joint], axes, axes)
            joints = replace(joints, stiffness=np.where(tied[:, None, None], np.nan, matrices))
        if joint == "patch":
            joints = joints.pinned(patch_stiffness(fabric, points, contacts, yarn))
        elif joint == "pinned":
            joints = joints.pinned(PIN * yarn.youngs_modulus * yarn.radius)
        stops = fabric.grip_ends(scene.load.direction)
        network = spatial_network(fabric, points, scene.mesh.beam_size, "rigid", joints, stops)
        section = stiffness.section(yarn, scene.mesh.beam_size * yarn.radius)
        joined = network.offsets, network.arms_turn, network.springs
        model = BeamModel(network.nodes, network.ends, section, yarn.radius, *joined)
        at = network.stations.nearest(points.yarn, points.arc_length)
        places = zip(points.yarn.ravel(), points.arc_length.ravel(), strict=True)
        tangent = np.concatenate([fabric.centrelines[i].tangent(np.array([s])) for i, s in places])
        observer = SpinObserver(network, model, at, tangent.reshape(*at.shape, 3))
        settings = settings_of(scene.solver, touches=False)
        history = solve_load_path(
            loaded(scene, fabric, network, {}, model=model, observer=observer, settings=settings)
        )
        free = ~tied if touching else np.ones_like(tied)
        return {
            "largest |u_z| [m]": largest_out_of_plane(history),
            "mean spin [deg]": float(np.degrees(observer.spins[-1][free].mean())),
            "force [N]": float(history["force"][-1]),
        }

    def stretched(self, height: float, wider: float = 0.0) -> Fabric:
        """Return the knit whose loops are optimised again with halves `height` apart, and rows `wider` apart [m]."""
        loop = self.base.loop
        assert isinstance(loop, Loop), "a plain knit has a loop"
        points = loop.control_points.copy()
        points[:, 1] += 0.5 * height * np.clip(points[:, 1] / LEG, -1, 1)
        moved = replace(loop, control_points=points, course_spacing=loop.course_spacing + wider)
        return KNITS[self.scene.specimen](optimise(moved, self.scene.geometry)[0], *self.base.cells)

    def with_lever(self, which: int, wider: float) -> Fabric:
        """Return the knit with rows `wider` apart [m] whose inner (0) or outer (1) lever is the drawn knit's."""
        if not wider:
            return self.base
        knits: dict[float, Fabric] = {}

        def off(height: float) -> float:
            knits[height] = self.stretched(height, wider)
            return levers(knits[height])[which] - self.levers[which]

        low, high = sorted(share * wider for share in ((0.8, 1.2), (1.3, 2.1))[which])
        return knits[brentq(off, low, high, xtol=1e-5, rtol=1e-4)]

    def sweeps(self) -> Iterator[tuple[str, float, Callable[[], Fabric], Stiffness]]:
        """Yield sweep, value, how its knit is made, and the stiffness of its yarns."""
        for diameter in DIAMETERS:
            factor = (diameter / DRAWN) ** 4
            yield "bending and torsion", diameter, lambda: self.base, Stiffness(factor, factor)
            yield "torsion alone", diameter, lambda: self.base, Stiffness(torsion=factor)
            yield "bending alone", diameter, lambda: self.base, Stiffness(bending=factor)
            # As a modulus along the yarn changes them, in solids
            with_length = Stiffness(bending=factor, stretching=factor)
            yield "bending and stretching", diameter, lambda: self.base, with_length
        for ratio in RATIOS:
            scene = self.scene.vary({"pattern.course_ratio": ratio})
            yield f"spacing, {HELD['shape']}", ratio, partial(laid_out, scene), Stiffness()
        for keep in ("wale_spacing", "length"):
            free = ["xyz"] * len(self.scene.pattern.control_points)
            scene = self.scene.vary({"pattern.keep": keep, "geometry.free": free})
            for ratio in WIDER:
                scene = scene.vary({"pattern.course_ratio": ratio})
                yield f"spacing, {HELD[keep]}", ratio, partial(laid_out, scene), Stiffness()
        for wider in (-2e-3, -1e-3, 0.0, 1e-3, 2e-3):
            yield "spacing, inner lever fixed", 1e3 * wider, partial(self.with_lever, 0, wider), Stiffness()
        for wider in (0.0, 0.5e-3, 1e-3, 1.5e-3, 2e-3, 3e-3):
            yield "spacing, outer lever fixed", 1e3 * wider, partial(self.with_lever, 1, wider), Stiffness()
        for height in (0.0, 0.5e-3, 1e-3, 2e-3, 3e-3, 4e-3):
            yield "levers, spacing fixed", 1e3 * height, partial(self.stretched, height), Stiffness()

    def table(self) -> pd.DataFrame:
        """Return one row a network of every sweep, interaction and joint."""
        rows = []
        for sweep, value, make, stiffness in self.sweeps():
            fabric = make()
            inner, outer = levers(fabric)
            place = {"sweep": sweep, "value": value, "course spacing [m]": inner + outer}
            place |= {"inner lever [m]": inner, "outer lever [m]": outer}
            for interaction, joint in product(INTERACTIONS, SOLIDS):
                kind = {"interaction": interaction, "joint": joint}
                rows.append(place | kind | self.pull(fabric, interaction, joint, stiffness))
        return pd.DataFrame(rows)


def laid_out(scene: Scene) -> Fabric:
    """Return the fabric of a scene."""
    return fabric_of(lay_out(scene))


def levers(fabric: Fabric) -> tuple[float, float]:
    """Return inner lever, along y between both contacts of a side of an interlock, and outer, the rest of a row [m]."""
    crossings, loop = fabric.crossings, fabric.loop
    assert loop is not None, "a plain knit has a loop"
    labels = zip(crossings.row, crossings.column, crossings.zone, strict=True)
    y = dict(zip(labels, crossings.point.mean(axis=1)[:, 1], strict=True))
    sides = [y[r, k, zone + 2] - low for (r, k, zone), low in y.items() if (r, k, zone + 2) in y]
    return float(np.mean(sides)), float(loop.course_spacing - np.mean(sides))


if __name__ == "__main__":
    try:
        table = Networks().table()
    except KnitstudyError as error:
        sys.exit(f"error: {error}")
    keep_table(
        table, KEPT, "make mechanisms", {group_of(load_scene(name)) for name in (SCENE, *SOLIDS.values())}
    )
    print(f"{len(table)} networks: {KEPT}")
