"""The simulation of a scene by its model (`knitstudy.knit.scene.kinds.MODELS`)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from knitstudy.knit.geometry.fabric import Fabric
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.specimens import plain_knit
from knitstudy.knit.loading.gates import fewest_across, require_elements_across, require_fine_beams
from knitstudy.knit.loading.history import Meter
from knitstudy.knit.loading.run import IN_MEMORY, Run
from knitstudy.knit.loading.solve import Problem, solve_load_path
from knitstudy.knit.mesh.mesher import check_shape, mesh_fabric
from knitstudy.knit.mesh.section import GROWTH
from knitstudy.knit.mesh.sweep import SweptMesh
from knitstudy.knit.models.hexahedra import HexahedralScene
from knitstudy.knit.scene.kinds import MODELS
from knitstudy.knit.scene.scene import Scene
from knitstudy.knit.yarns.joints import JointPoints
from knitstudy.knit.yarns.network import spatial_network


def build(scene: Scene, fabric: Fabric, mesh: SweptMesh | None = None, **data: xr.Dataset | None) -> Problem:
    """Return a scene as a problem by its model; raises the KnitstudyErrors of the model.

    Parameters
    ----------
    mesh : SweptMesh, optional
        Of solid yarns.
    **data
        Results of other simulations that the model takes: contacts, springs or stresses; None counts as left out.

    Examples
    --------
    >>> from knitstudy import load_scene
    >>> from knitstudy.knit.geometry.fabric_file import fabric_of
    >>> from knitstudy.knit.geometry.lay_out import lay_out
    >>> cell = load_scene("yarns-tie-course").vary({"pattern.loops": 1, "pattern.rows": 1})
    >>> build(cell, fabric_of(lay_out(cell))).model.size  # unknowns
    1386
    """
    meter = Meter()
    given = {name: dataset for name, dataset in {"mesh": mesh, **data}.items() if dataset is not None}
    return replace(
        MODELS.find(scene.fidelity, f"scene {scene.name!r}").build(scene, fabric, **given), meter=meter
    )


def require_resolution(scene: Scene, fabric: Fabric) -> str:
    """Divide the yarns of a scene without simulating them, and return a description of the discretisation.

    Raises MeshError where yarns overlap or bend too tightly, or gates refuse the size of hexahedra or beams.
    """
    check_shape(fabric)
    if (size := scene.value("mesh.beam_size")) is not None:
        every = np.ones(len(fabric.crossings.row), dtype=bool)
        points = JointPoints.at_crossings(fabric.crossings, every)
        stiffer = spatial_network(fabric, points, size).polygon
        require_fine_beams(scene.value("gates.polygon"), size, stiffer)
        return f"straight beams in bent yarns are some {stiffer:.1%} too stiff"
    if isinstance(scene, HexahedralScene) and fabric.loop is not None:
        size = scene.mesh.size
        fewest = scene.gates.elements_across or fewest_across(scene.specimen, scene.mesh.refinement)
        require_elements_across(size, fewest)
        one = plain_knit(fabric.loop, fabric.loop.columns, fabric.loop.rows)
        mesh_fabric(one, size, GROWTH, scene.mesh.refinement)
        return f"{2 / size:.3g} elements across a yarn"
    return "no further checks before a run"


def solve(scene: Scene, fabric: Fabric, run: Run = IN_MEMORY, **data: Any) -> xr.Dataset:
    """Return the history of a scene; arguments and errors as of `build` and `solve_load_path`.

    Examples
    --------
    >>> from knitstudy import load_scene
    >>> from knitstudy.knit.geometry.lay_out import lay_out
    >>> scene = load_scene("rom2d-tie-course")
    >>> solve(scene, fabric_of(lay_out(scene)))["force"][-1].round(1).item()  # [N]
    78.0
    """
    return solve_load_path(build(scene, fabric, **data), run)


def simulate(
    scene: Scene,
    geometry: xr.Dataset,
    mesh: xr.Dataset | None = None,
    contacts: xr.Dataset | None = None,
    springs: xr.Dataset | None = None,
    stresses: xr.Dataset | None = None,
    rest: xr.Dataset | None = None,
    run: Run = IN_MEMORY,
) -> xr.Dataset:
    """Return the history of a scene from the results of other stages, in the formats of docs/reference/files.md.

    Solid yarns have a mesh, cells that start from it a shape at rest. Contacts, springs and stresses come from the
    simulations that ``rom.contacts_from``, ``rom.springs_from`` and ``rom.stress_from`` name. Raises as `build` and
    `solve_load_path`.

    Examples
    --------
    >>> from knitstudy import load_scene
    >>> from knitstudy.knit.geometry.lay_out import lay_out
    >>> scene = load_scene("rom3d-tie-course").vary({"load.strain": 0.01})
    >>> history = simulate(scene, lay_out(scene))
    >>> history["strain"][-1].item(), history["force"][-1].round(1).item()  # [N]
    (0.01, 5.5)
    """
    swept = None if mesh is None else SweptMesh.from_dataset(mesh)
    data = {"mesh": swept, "contacts": contacts, "springs": springs, "stresses": stresses, "rest": rest}
    return solve(scene, fabric_of(geometry), run, **data)
