"""A whole study, made up: four cases of tension with all models, and made-up results of each."""

from itertools import product

import numpy as np
import pandas as pd
import synthetic

from knitstudy.measures.reference import NEEDED, problem_of
from knitstudy.measures.response import FORCE as FORCES
from knitstudy.measures.response import LARGEST_U_Z, RMS_U_Z, STRAINS, rms_out_of_plane
from knitstudy.paper.columns import DOF
from knitstudy.paper.square_knits import (
    CELLS,
    FACTOR,
    FACTOR_MULTIPLIED,
    FRONT,
    MULTIPLIED,
    PLANAR,
    SIZES,
    SPATIAL,
    TIED,
    TOUCHING,
)
from knitstudy.run.configuration import load_scenes, load_study

CASES = [(kind, way) for kind in ("tie", "isotropic") for way in ("course", "wale")]

FORCE = {"tie": 12.0, "isotropic": 10.0}
LIFT = {"tie": 2e-4, "isotropic": 4e-4}
"""Force [N] and out-of-plane displacement [m] of direct simulations at full load."""

STRAIGHT = {"mesh.section_law": "straight"}

MODELS = {
    "dns-{}": ({"fidelity": "hexahedra", "mesh.size": 1 / 3}, 1.0, 1.0),
    "dns-{}-medium": ({"fidelity": "hexahedra", "mesh.size": 0.5}, 1.02, 1.0),
    "rom3d-{}": ({"fidelity": "rom3d", "rom.joint": "rigid", **STRAIGHT}, 1.2, 0.75),
    "rom2d-{}": ({"fidelity": "rom2d"}, 2.0, 0.0),
    "rom3d-printed-{}": ({"fidelity": "rom3d", "rom.joint": "printed", **STRAIGHT}, 1.5, 0.5),
    "rom3d-pinned-{}": ({"fidelity": "rom3d", "rom.joint": "pinned", **STRAIGHT}, 1.1, 0.9),
    "rom2d-doubled-{}": ({"fidelity": "rom2d", "rom.section": "doubled"}, 2.5, 0.0),
    "beam-{}": ({"fidelity": "beam", "beam.section": "rigid", "beam.tie": "rigid"}, 0.9, 1.0),
    "beam-pinned-{}": ({"fidelity": "beam", "beam.section": "rigid", "beam.tie": "pinned"}, 0.7, 1.0),
    "beam-hertz-{}": ({"fidelity": "beam", "beam.section": "hertz", "beam.tie": "rigid"}, 0.8, 1.0),
}
"""Keys by name, and force and lift over those of the direct simulation."""

COST = {
    "hexahedra": {"dof": 189_513, "memory_growth": 300e6, "wall_seconds": 100.0, "processor_seconds": 100.0},
    "rom3d": {"dof": 5_994, "memory_growth": 4e6, "wall_seconds": 0.5, "processor_seconds": 0.5},
    "rom2d": {"dof": 432, "memory_growth": 2e6, "wall_seconds": 0.1, "processor_seconds": 0.1},
    "beam": {"dof": 5_994, "memory_growth": 9e6, "wall_seconds": 4.0, "processor_seconds": 4.0},
}

ENERGY = {"external": 5e-3, "internal": 4e-3, "friction": 1e-3, "stabilisation": 0.0}  # at full load [J]

SPRINGS = {"course": (84.5e3, 67.6e3, 952.1e3), "wale": (73.4e3, 233.2e3, 600e3)}  # the paper's [N/m]


def counted():
    """Return the table of unknowns and memory of square knits, as the paper prints both."""
    memory = {TIED: 128.0, SPATIAL: 19.0, PLANAR: 17.0, TOUCHING: 1158.0}
    unknowns = {TIED: 189_513, SPATIAL: 5_994, PLANAR: 432, TOUCHING: 189_513}
    return pd.DataFrame(
        {
            "model": model,
            CELLS: n,
            DOF.head: unknowns[model] * n**2 / 9,
            MULTIPLIED: unknowns[model] * n**2 / 9 + 40_800 * n * (n - 2) if model == TOUCHING else np.nan,
            FRONT: memory[model],
            FACTOR: memory[model] * (n / 3) ** 2.13,
            FACTOR_MULTIPLIED: memory[model] * (n / 3) ** 2.13 if model == TOUCHING else np.nan,
        }
        for model in memory
        for n in SIZES
    )


def domain(plain):
    """Return scenes and histories of square knits of hexahedra, by name: as large as the paper's."""
    scenes, histories = {}, {}
    for kind, unknowns in (("tie", 189_513), ("isotropic", 311_913)):
        for cells in (3, 6, 8):
            name = f"domain-hexahedra-{kind}-course-{cells}x{cells}"
            keys = {
                "name": name,
                "fidelity": "hexahedra",
                "interaction": kind,
                "mesh.size": 1 / 3,
                "load.strain": 0.0125,
            }
            size = {"knit": f"plain{cells}", "pattern.loops": cells, "pattern.rows": cells}
            scenes[name] = plain.vary(keys | size)
            cost = {"dof": unknowns * cells**2 // 9, "memory_growth": 1158e6 * (cells / 3) ** 2.13}
            history = synthetic.history(lift=1e-4 * cells, scene=name, interaction=kind, **cost)
            seconds = np.full((3, 1), 0.1 * cells**2)
            histories[name] = history.assign(seconds=(("increment", "phase"), seconds))
    return scenes, histories


def scenes(plain):
    """Return all scenes by name, the main simulation of each case before its variants."""
    actual = {}
    for kind, way in CASES:
        for form, (keys, _, _) in MODELS.items():
            if keys["fidelity"] == "beam" and kind == "tie":
                continue
            name = form.format(f"{kind}-{way}")
            reduced = keys["fidelity"] in ("rom3d", "rom2d")
            source = {"rom.contacts_from": f"dns-{kind}-{way}"} if reduced else {}
            actual[name] = plain.vary(
                {"name": name, "interaction": kind, "load.direction": way} | source | keys
            )
    return actual


def histories(scenes, **changes):
    """Return made-up results of all scenes by name; changes replace arguments of `synthetic.history`."""
    actual = {}
    for kind, way in CASES:
        for form, (_, force, lift) in MODELS.items():
            name = form.format(f"{kind}-{way}")
            if name not in scenes:
                continue
            last = force * FORCE[kind]
            arguments = {"force": (0, last / 2, last), "lift": lift * LIFT[kind], "scene": name}
            actual[name] = history(**arguments | COST[scenes[name].fidelity] | changes.get(name, {}))
    return actual


def history(**arguments):
    """Return a history with its forms of energy."""
    made = synthetic.history(**arguments)
    share = np.linspace(0, 1, made.sizes["increment"])
    energy = share[:, None] * np.array(list(ENERGY.values()))
    return made.assign(energy=(("increment", "form"), energy), form=list(ENERGY))


ROUGH = (11.0, 3e-4)
"""Force and out-of-plane displacement with rough contact, of which only the reference speaks."""


def reference(scenes, uncertainty=0.02):
    """Return a reference that the direct simulations meet, with one relative uncertainty for everything."""
    known = {kind: (FORCE[kind], LIFT[kind]) for kind in FORCE} | {"rough": ROUGH}
    rows = []
    for kind, way in [*CASES, ("rough", "course")]:
        solid = scenes[f"dns-isotropic-{way}" if kind == "rough" else f"dns-{kind}-{way}"]
        problem = problem_of(solid.replace("interaction", kind))
        force, lift = known[kind]
        rms = rms_out_of_plane(history(lift=lift))[-1]
        for quantity, full in ((FORCES, force), (LARGEST_U_Z, 2 * lift), (RMS_U_Z, rms)):
            for strain in STRAINS:
                value = full * strain / STRAINS[-1]
                rows.append((problem, quantity, strain, value, uncertainty * value))
    return pd.DataFrame(rows, columns=NEEDED)


INPUTS = {
    "yarns-{}-course": {},
    "inputs-friction010-{}-course": {"contact.friction": 0.1},
    "inputs-friction150-{}-course": {"contact.friction": 1.5},
    "inputs-untied-{}-course": {"contact.tied_edges": "none"},
    "inputs-clearance0040-{}-course": {"pattern.clearance": 0.04},
    "inputs-lateral-free-{}-course": {"load.lateral": "free"},
}
"""Inputs that are changed one at a time, by the names of their scenes."""


def varied(plain):
    """Return scenes of contact and ties in course tension with one input changed at a time, by name."""
    actual = {}
    for name, keys in INPUTS.items():
        for kind in ("tie", "rough", "isotropic"):
            scene = plain.vary({"name": name.format(kind), "fidelity": "hexahedra", "interaction": kind})
            if all(scene.value(key) is not None for key in keys):
                actual[scene.name] = scene.vary(keys)
    return actual


def in_contact(history, kind, force=1.0, lift=1.0):
    """Return a history of a knit in contact that the reference meets, times factors of its force and its motion."""
    whole, far = {"rough": ROUGH}.get(kind) or (FORCE[kind], LIFT[kind])
    motion = history["centreline_displacement"]
    up = motion[..., 2]
    u_z = lift * 2 * far / float(abs(up[-1]).max())
    return history.assign(
        force=history["force"] * (force * whole / float(history["force"][-1])),
        centreline_displacement=motion * [1.0, 1.0, u_z],
    ).assign_attrs(interaction=kind, digest="beef")


NO_REFERENCE = pd.DataFrame(columns=NEEDED)


def sprung(contacts):
    """Return the contacts of the direct simulations with friction, with the paper's springs."""
    return {
        f"dns-isotropic-{way}": synthetic.contacts_with_springs(contacts, np.array(stiffness), "local")
        for way, stiffness in SPRINGS.items()
    }


SWEPT = ("yarns-{}-course", "yarns-{}-course-p3", "dns-{}-course")  # simulations of the drawn knit
DRAWN_LIFT, SURE = 4e-4, 0.01
"""Of the loop as it is drawn [m], of which the largest |u_z| is twice, and the reference's relative uncertainty."""


def swept_scenes():
    """Return the scenes of all sweeps of the study by name."""
    known = load_scenes()
    drawn = [name.format(kind) for name in SWEPT for kind in ("tie", "isotropic")]
    return {name: known[name] for name in load_study("full") if name in drawn or name.startswith("sweep-")}


def swept_reference(scenes):
    """Return a reference that the loop as it is drawn meets."""
    problem = problem_of(scenes["yarns-isotropic-course"])
    return pd.DataFrame([(problem, LARGEST_U_Z, 0.05, 2 * DRAWN_LIFT, SURE * 2 * DRAWN_LIFT)], columns=NEEDED)


def swept_histories(scenes, slopes):
    """Return histories whose u_z depends on the spacing's ratio, and on the diameter over the drawn one, by a slope."""

    def lift(scene):
        ratio, thick = scene.pattern.course_ratio, scene.yarn.diameter / 1.8e-3
        slope = slopes.get(scene.pattern.keep, slopes["shape"])
        return DRAWN_LIFT * (1 + slope * (ratio - 1) - slope * (thick - 1))

    return {name: history(lift=lift(scene), scene=name) for name, scene in scenes.items()}


def room_around(figure):
    """Return the room [inches] on the left, below, on the right and above what a figure shows; below 0 is cut off."""
    (width, height), box = figure.get_size_inches(), figure.get_tightbbox()
    return box.x0, box.y0, width - box.x1, height - box.y1


def mechanisms():
    """Return networks whose motion grows with the outer lever, and falls a little with the spacing at one lever."""
    rows, steps = [], np.arange(6.0)

    def add(sweep, values, inner, outer):
        for value, low, high in zip(values, inner + 0 * values, outer + 0 * values, strict=True):
            for kind, joint in product(("isotropic", "tie"), ("rigid", "pinned")):
                stiff = 1.2 / value if "alone" in sweep or "bending" in sweep else 1.0
                motion = 1e-4 * stiff * (high - 0.2 * (low + high))
                place = (low + high, low, high, kind, joint, motion, stiff)
                rows.append((sweep, value, *place))

    for sweep in ("bending and torsion", "torsion alone", "bending alone", "bending and stretching"):
        add(sweep, np.linspace(1.2, 1.95, 6), 4.0, 9.0)
    for held in ("drawn shape", "wale spacing", "yarn in a loop"):
        add(f"spacing, {held} held", steps, 4.0 + 0.3 * steps, 9.0 + 0.7 * steps)
    add("spacing, inner lever fixed", steps, 4.0, 9.0 + steps)
    add("spacing, outer lever fixed", steps, 4.0 + steps, 9.0)
    add("levers, spacing fixed", steps, 4.0 + steps, 9.0 - steps)
    levers = ["course spacing [m]", "inner lever [m]", "outer lever [m]"]
    columns = ["sweep", "value", *levers, "interaction", "joint", "largest |u_z| [m]", "mean spin [deg]"]
    return pd.DataFrame(rows, columns=columns)
