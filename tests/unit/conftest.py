"""A small configuration folder that tests may write into."""

import numpy as np
import pytest
import yaml

DEFAULTS = {
    "specimen": "knit",
    "fidelity": "hexahedra",
    "interaction": "tie",
    "pattern": {"loop": "loop.yaml", "loops": 3, "rows": 3, "clearance": 0.01},
    "pair": {"angle": 90.0, "length": 10e-3, "clearance": 0.01, "support": "back"},
    "yarn": {
        "youngs_modulus": 1.3e9,
        "poisson_ratio": 0.42,
        "material": "hencky",
    },
    "geometry": {"alpha": 1.0, "beta": 1.0, "gamma": 1.0, "beta_0": 1.0, "samples": 50},
    "load": {"direction": "course", "strain": 0.05, "lateral": "fixed", "stops": []},
    "mesh": {
        "size": 0.3e-3,
        "growth": 1.2,
        "element": "one_point",
        "beam_size": 0.5e-3,
        "section_law": "curved",
    },
    "contact": {
        "friction": 0.76,
        "normal_stiffness": 10.0,
        "tangential_stiffness": 10.0,
        "penetration": 0.01,
        "augmentations": 10,
        "points": 2,
        "tied_edges": "outer",
    },
    "solver": {
        "increments": 10,
        "residual_tolerance": 1e-6,
        "correction_tolerance": 1e-6,
        "hourglass": 0.005,
        "stabilisation": 0.0,
        "linear": "auto",
    },
    "rom": {
        "joint": "rigid",
        "springs_from": None,
        "springs": "averaged",
        "stiffness": [],
        "axes": "local",
        "displacement": "interface",
        "section": "single",
    },
    "beam": {"section": "rigid", "tie": "rigid", "stiffness": 10.0},
    "outputs": [],
}

FAMILY = """\
keys:
  knit: plain
scenes:
- name: dns-a
  studies: [reduced, ci]
  keys:
    outputs: [fields, vtu]
- name: rom3d-a
  studies: reduced
  keys:
    fidelity: rom3d
    rom.contacts_from: dns-a
    load.strain: 2e-2
"""


def loop_points(count: int = 8) -> np.ndarray:
    """Return control points of a plain loop whose yarn is 1.8 mm thick, (count, 3) in m."""
    u = np.arange(count) / count
    return 1e-3 * np.stack(
        [
            13.4 * u + 2 * np.sin(4 * np.pi * u),
            9 * (1 - np.cos(2 * np.pi * u)),
            -2 * np.cos(4 * np.pi * u),
        ],
        axis=-1,
    )


@pytest.fixture
def config(tmp_path):
    """Folder with defaults, a family of one solid and one reduced scene, and a loop."""
    loop = {
        "control_points": loop_points().tolist(),
        "course_spacing": 10.4e-3,
        "wale_spacing": 13.4e-3,
        "diameter": 1.8e-3,
        "free": ["z"] * 8,
    }
    (tmp_path / "loop.yaml").write_text(yaml.safe_dump(loop))
    (tmp_path / "defaults.yaml").write_text(yaml.safe_dump(DEFAULTS))
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes" / "small.yaml").write_text(FAMILY)
    return tmp_path
