"""A small configuration folder that tests may write into."""

import numpy as np
import pytest
import yaml

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
def config(tmp_path, defaults_with):
    """Folder with defaults, a family of one solid and one reduced scene, and a loop."""
    loop = {
        "control_points": loop_points().tolist(),
        "course_spacing": 10.4e-3,
        "wale_spacing": 13.4e-3,
        "diameter": 1.8e-3,
        "free": ["z"] * 8,
    }
    (tmp_path / "loop.yaml").write_text(yaml.safe_dump(loop))
    (tmp_path / "defaults.yaml").write_text(yaml.safe_dump(defaults_with(pattern={"loop": "loop.yaml"})))
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes" / "small.yaml").write_text(FAMILY)
    return tmp_path
