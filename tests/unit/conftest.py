"""A small configuration folder that tests may write into, knits, and processes of their own."""

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import study
import yaml

from knitstudy import registry
from knitstudy.datasets import read_table
from knitstudy.knit.geometry.specimens import yarn_pair


def loop_points(count: int = 8) -> np.ndarray:
    """Return control points of a plain loop whose yarn is 1.8 mm thick, (count, 3) in m."""
    u = np.arange(count) / count
    return 1e-3 * np.stack(
        [13.4 * u + 2 * np.sin(4 * np.pi * u), 9 * (1 - np.cos(2 * np.pi * u)), -2 * np.cos(4 * np.pi * u)],
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
    shutil.copy(Path(__file__).parent / "families" / "small.yaml", tmp_path / "scenes")
    return tmp_path


@pytest.fixture(scope="session")
def touching_cell(plain_scene):
    """Scene of one cell of beams with friction, untied and flattened until its yarns nearly touch."""
    flat = np.array(plain_scene.pattern.control_points) * [1, 1, 0.985]
    contact = {"fidelity": "beam", "interaction": "isotropic", "contact.tied_edges": "none"}
    size = {"pattern.loops": 1, "pattern.rows": 1, "pattern.control_points": flat.tolist()}
    return plain_scene.vary(contact | size)


@pytest.fixture(scope="session")
def pair():
    """Two straight yarns that cross at 60 degrees."""
    return yarn_pair(0.9e-3, 60.0, 6e-3, 0.01)


RESOURCES = Path(__file__).resolve().parents[2] / "resources" / "reference"


@pytest.fixture(scope="session")
def paper():
    """Numbers that the paper prints."""
    return read_table(RESOURCES / "paper_tables.csv")


@pytest.fixture(scope="session")
def cases(plain_scene):
    """Made-up scenes of the four cases of tension with all models."""
    return study.scenes(plain_scene)


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    """Function that writes the files of a plugin and loads it; it and its entries in registries are gone afterwards.

    Files are called by their names, of which the first one's is the plugin's; `a__b` is the file b of a folder a.
    """
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(registry, "_imported", {})

    def load(*registries, **files):
        for entries in registries:
            monkeypatch.setattr(entries, "_entries", dict(entries.all()))
        for name, text in files.items():
            path = tmp_path / f"{name.replace('__', '/', 1)}.py"
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
        registry.load_plugins([next(iter(files)).partition("__")[0]])

    yield load
    for name, module in list(sys.modules.items()):
        if str(getattr(module, "__file__", None)).startswith(f"{tmp_path}/"):
            del sys.modules[name]


HEAVY = "pandas", "xarray", "netCDF4", "scipy", "knitstudy.knit.yarns.solids"
"""Modules that take most of the time of a start."""


@pytest.fixture(scope="session")
def printed_and_imported():
    """Function that runs code in a process of its own; it returns the printed lines and the heavy modules imported."""

    def run(code):
        code = f"import sys; {code}; print([name for name in {HEAVY} if name in sys.modules])"
        ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        return ended.stdout.splitlines()

    return run
