"""Joints of the 3D network with either law of its sections, with its own springs or those of Table 2, and all ties.

Every network is compared with the solids whose contacts it has: what is left is the joint, the beams and the springs.
"""

from __future__ import annotations

from typing import Any

import pandas as pd

from knitstudy.knit.scene.scene import Scene
from knitstudy.measures import response
from knitstudy.measures.reference import made_of, reference_by
from knitstudy.paper.claims import COMPARABLE
from knitstudy.paper.columns import FORCE, RMS_U_Z, U_Z, Simulation, rows_of
from knitstudy.paper.scene_names import CASES, INTERACTIONS, of_cases
from knitstudy.run.catalogue import TABLES, Datasets, Scenes, several

JOINTS = {  # by ``rom.joint``; separated: springs or ties of points that lie a diameter apart, as Table 2 prints
    "printed": "separated",
    "rigid": "rigid arms",
    "pinned": "pinned",
    "patch": "yielding",
}
OWN, PRINTED, NO_SPRINGS = "own", "Table 2", "none"
SOLIDS = ("yarns-{case}", "inputs-tie*-{case}", "reading-as-printed-yarns-{case}")
NETWORKS = (
    *("rom3d-{case}", "rom3d-*-{case}"),
    *("inputs-tie*-rom3d-{case}", "inputs-tie*-rom3d-*-{case}"),
    *("reading-as-printed-rom3d-{case}", "reading-as-printed-rom3d-*-{case}"),
)
DISTANCE = "L2 distance of force to the solids' [1]"


def is_joint(scene: Scene) -> bool:
    """Return whether a network differs from the base in its joints, sections, springs and ties alone."""
    usual = {"rom.normal": "normal_resultant", "rom.displacement": "interface", "rom.springs_from": None}
    if scene.kind.fidelity.name != "rom3d" or any(
        scene.value(key) not in (None, value) for key, value in usual.items()
    ):
        return False
    return scene.value("rom.axes") != "local" or not scene.value("rom.stiffness")


NAMED = of_cases(CASES, NETWORKS)
RESULTS = {
    "networks": several("simulation", *NAMED, where=is_joint, fewest=2),
    "solids": several("simulation", *of_cases(CASES, SOLIDS), where=lambda scene: scene.kind.direct),
}


@TABLES.add("joints", "Joints, sections and springs of the 3D network", results=RESULTS, order=7.5)
def tabulate(networks: Datasets, solids: Datasets, scenes: Scenes) -> pd.DataFrame:
    """Return one row a network whose solids are there, in the order of the cases and joints."""
    direct = rows_of(scenes, solids)
    rows = [
        _row(network, direct[source])
        for network in rows_of(scenes, networks).values()
        if (source := network.scene.value("rom.contacts_from")) in direct
    ]
    table = pd.DataFrame(rows)
    order = {name: place for place, name in enumerate(JOINTS.values())}
    return table.sort_values(
        ["case", "solids", "radius of ties over R [1]", "joints"],
        key=lambda column: column.map(order) if column.name == "joints" else column,
        kind="stable",
        ignore_index=True,
    )


def _row(network: Simulation, solids: Simulation) -> dict[str, Any]:
    scene = network.scene
    reference = reference_by(solids.history)
    distance = reference.force_distance(network.history).value
    springs = PRINTED if scene.value("rom.stiffness") else OWN
    return {
        "case": f"{INTERACTIONS[scene.interaction]}, {scene.value('load.direction')}",
        "solids": made_of(solids.scene),
        "radius of ties over R [1]": solids.scene.value("tie.radius"),
        "clearance over R [1]": solids.scene.value("pattern.clearance"),
        "joints": JOINTS[scene.value("rom.joint")],
        "sections": scene.value("mesh.section_law"),
        "springs": NO_SPRINGS if scene.interaction == "tie" else springs,
        "scene": scene.name,
        FORCE.head: network[FORCE],
        "force over the solids' [1]": reference.force_ratio(network.history).value,
        DISTANCE: distance,
        "amplitude of u_z over the solids' [1]": reference.ratio(
            network.history, response.RMS_U_Z, network[RMS_U_Z]
        ).value,
        "correlation of u_z with the solids' [1]": response.out_of_plane_correlation(
            network.history, solids.history
        ),
        U_Z.head: network[U_Z],
        f"comparable: within a factor of {COMPARABLE:g}": distance <= COMPARABLE - 1,
    }
