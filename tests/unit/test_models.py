"""Models: one object each, also from a plugin, and the data that they get."""

import subprocess
import sys

import pytest
from refusals import refusal

from knitstudy.files import read_dataset
from knitstudy.knit.geometry.specimens import endless_cell
from knitstudy.knit.models.hexahedra import build as hexahedra

PLUGIN = """
from dataclasses import replace

from knitstudy.knit.yarns.joints import joint_points
from knitstudy.knit.yarns.network import problem, spatial_network
from knitstudy.knit.yarns.joints import contacts_of_crossings
from knitstudy.knit.scene.keys import Section, key, section
from knitstudy.knit.scene.kinds import MODELS, Model
from knitstudy.knit.scene.specimens import Knit
from knitstudy.knit.scene.shared_sections import BeamMesh, BeamGates


class Wires(Section):
    stiffness: float = key("physics", "assumed", default=1.0, unit="1", gt=0, le=1e3)
    "A test."


def build(scene, fabric):
    points = joint_points(fabric, contacts_of_crossings(fabric))
    stiffer = scene.scaled(stiffness=scene.wires.stiffness)
    return replace(problem(stiffer, fabric, spatial_network(fabric, points, scene.mesh.beam_size)), scene=scene)


class KnitOfWires(Knit):
    specimens = ("knit", "cut_knit")

    mesh: BeamMesh = section()
    gates: BeamGates = section()
    wires: Wires = section()


MODELS.register(
    Model(
        name="wires", meaning="rigidly joined wires", parts=(KnitOfWires,), build=build
    )
)
"""

SCENES = """
studies: []
scenes:
- name: wires
  case: tie-course
  keys: {knit: wires, fidelity: wires, pattern.loops: 1, pattern.rows: 1, mesh.beam_size: 1.5, outputs: []}
"""


def test_a_plugin_of_one_file_adds_a_model_with_keys_of_its_own(tmp_path):
    """The command runs it, and its own key doubles the force."""
    (tmp_path / "wires.py").write_text(PLUGIN)
    (tmp_path / "own.yaml").write_text(SCENES)
    options = {"cwd": tmp_path, "capture_output": True, "text": True}
    force = []
    for stiffness in ("1", "2"):
        changes = ("--set", f"wires.stiffness={stiffness}", "--set", f"name=wires{stiffness}")
        command = [sys.executable, "-m", "knitstudy", "run", "own.yaml", "--plugin", "wires", *changes]
        ended = subprocess.run(command, **options)
        assert ended.returncode == 0, ended.stderr
        force.append(
            float(read_dataset(tmp_path / "runs" / "simulation" / f"wires{stiffness}.nc")["force"][-1])
        )
    assert force[1] == pytest.approx(2 * force[0], rel=1e-9)


def test_hexahedra_refuse_endless_yarns(plain_scene, knit):
    cells = endless_cell(knit.loop, *knit.cells)
    with refusal("which hexahedra cannot model; use spline_yarns"):
        hexahedra.build(plain_scene.replace("fidelity", "hexahedra"), cells, None)
