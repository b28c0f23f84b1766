"""States of the cells of five fabrics, of the jersey of docs/tutorial/jersey.md and others; fabric_states.csv.

``python tests/fabric_states.py`` makes the table again, in four minutes where nothing is kept.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from knitstudy.datasets import STRAINS, write_table

PATH = Path(__file__).with_suffix(".csv")
FORCES = [f"{way}_N_m" for way in STRAINS]
STATES = 12  # of a path at most
BOTH = {"load.deformation": "biaxial", "load.ratio": 1.0, "load.strain": 0.1}


def cells_of_knits() -> dict[str, dict[str, xr.Dataset]]:
    """Return histories of cells by fabric and path."""
    table = pd.read_csv(PATH)
    return {
        fabric: {
            path: xr.Dataset(
                {
                    "cell_strain": (("increment", "plane"), states[list(STRAINS)].to_numpy()),
                    "force_per_width": (("increment", "plane"), states[FORCES].to_numpy()),
                }
            )
            for path, states in paths.groupby("path", sort=False)
        }
        for fabric, paths in table.groupby("fabric", sort=False)
    }


def simulated(folder: str = "runs"):
    """Yield fabric, path and history of every cell."""
    from knitstudy import CellOfBeams, CellStrain, Friction, Pattern, SetYarn, load_scene, simulate

    jersey = CellOfBeams(
        pattern=Pattern(course_spacing=0.9e-3, wale_spacing=1.1e-3, loops=1, rows=1),
        yarn=SetYarn(diameter=0.25e-3, youngs_modulus=200e6),
        load=CellStrain(deformation="course", strain=0.1, lateral="free"),
        contact=Friction(friction=0.3),
    )
    paths = {
        "course": {},
        "wale": {"load.deformation": "wale"},
        "shear": {"load.deformation": "shear", "load.strain": 0.05},
        "both": BOTH | {"load.ratio": 0.5},
    }
    for path, changes in paths.items():
        yield "jersey", path, simulate(jersey.vary(changes), folder).history
    for path in ("course", "wale", "shear", "biaxial"):
        yield "tied", path, simulate(load_scene(f"cell-{path}"), folder).history
    for stitch in ("stockinette", "rib", "garter"):
        for path in STRAINS:
            scene = load_scene(f"fabric-acrylic-{stitch}-{path}-free")
            yield f"acrylic {stitch}", path, simulate(scene, folder).history
        scene = load_scene(f"fabric-acrylic-{stitch}-course-free").vary({"name": f"{stitch}-both"} | BOTH)
        yield f"acrylic {stitch}", "both", simulate(scene, folder).history


if __name__ == "__main__":
    parts = []
    for fabric, path, history in simulated():
        stretch, force = (history[name].to_numpy() for name in ("cell_strain", "force_per_width"))
        last = np.argmax(np.linalg.norm(stretch, axis=1))  # without unloading
        chosen = np.unique(np.linspace(0, last, STATES + 1).round().astype(int))[1:]
        part = pd.DataFrame(np.hstack([stretch[chosen], force[chosen]]), columns=[*STRAINS, *FORCES])
        part.insert(0, "path", path)
        part.insert(0, "fabric", fabric)
        parts.append(part)
    write_table(pd.concat(parts), PATH)
