"""Models: one object each, also from a plugin, and the data that they get."""

import pytest
from click.testing import CliRunner
from refusals import refusal

from knitstudy.datasets import read_dataset
from knitstudy.knit.geometry.specimens import endless_cell
from knitstudy.knit.models.hexahedra import build as hexahedra
from knitstudy.knit.scene.kinds import MODELS, role_of
from knitstudy.run.commands.main import main
from knitstudy.run.configuration import load_scene

KEYS = """
from knitstudy.knit.scene.keys import Section, key, section
from knitstudy.knit.scene.kinds import MODELS, FidelityModel
from knitstudy.knit.scene.specimens import Knit
from knitstudy.knit.scene.shared_sections import BeamMesh, BeamGates
from knitstudy.registry import lazy_import


class Wires(Section):
    stiffness: float = key("physics", "assumed", default=1.0, unit="1", gt=0, le=1e3)
    "A test."


class KnitOfWires(Knit):
    specimens = ("knit", "cut_knit")

    mesh: BeamMesh = section()
    gates: BeamGates = section()
    wires: Wires = section()


MODELS.register(FidelityModel("wires", "rigidly joined wires", (KnitOfWires,), lazy_import("wires.build:build")))
"""

READS = """
from dataclasses import replace

from knitstudy.knit.yarns.joints import contacts_of_crossings, joint_points
from knitstudy.knit.yarns.network import problem, spatial_network


def build(scene, fabric):
    points = joint_points(fabric, contacts_of_crossings(fabric))
    stiffer = scene.scaled(stiffness=scene.wires.stiffness)
    return replace(problem(stiffer, fabric, spatial_network(fabric, points, scene.mesh.beam_size)), scene=scene)
"""

SCENES = """
studies: []
scenes:
- name: wires
  case: tie-course
  keys: {knit: wires, fidelity: wires, pattern.loops: 1, pattern.rows: 1, mesh.beam_size: 1.5, outputs: []}
"""


def test_a_model_is_one_folder_and_a_key_its_section_and_the_code_that_reads_it(
    plugin, tmp_path, monkeypatch
):
    """The command runs it, its own key doubles the force, and enters the digest."""
    plugin(MODELS, wires____init__=KEYS, wires__build=READS)
    (tmp_path / "own.yaml").write_text(SCENES)
    monkeypatch.chdir(tmp_path)
    force = []
    for stiffness in ("1", "2"):
        changes = ("--set", f"wires.stiffness={stiffness}", "--set", f"name=wires{stiffness}")
        ended = CliRunner().invoke(main, ["run", "own.yaml", "--plugin", "wires", *changes])
        assert ended.exit_code == 0, ended.stderr
        history = read_dataset(tmp_path / "runs" / "simulation" / f"wires{stiffness}.nc")
        force.append(float(history["force"][-1]))
    assert force[1] == pytest.approx(2 * force[0], rel=1e-9)
    assert role_of("wires.stiffness") == "physics"
    scene = load_scene("wires", tmp_path / "own.yaml").replace("wires.stiffness", 2.0)
    assert scene.read(scene.sections)["wires"] == {"stiffness": 2.0}


def test_hexahedra_refuse_endless_yarns(plain_scene, knit):
    cells = endless_cell(knit.loop, *knit.cells)
    with refusal("which hexahedra cannot model; use spline_yarns"):
        hexahedra.build(plain_scene.replace("fidelity", "hexahedra"), cells, None)
