"""What a newcomer touches (CONTRIBUTING.md): every kind of part is added by as few files as the page says."""

import re
from pathlib import Path

from matplotlib.figure import Figure

import knitstudy
from knitstudy import load_scene
from knitstudy.knit.geometry.fabric_file import fabric_of
from knitstudy.knit.geometry.lay_out import lay_out
from knitstudy.knit.scene.kinds import MODELS, role_of
from knitstudy.mechanics.materials import MATERIALS, material_of
from knitstudy.run.catalogue import FIGURES

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


MATERIAL = """
from knitstudy.mechanics.materials import MATERIALS
from knitstudy.mechanics.materials.isotropic import StVenantKirchhoff


@MATERIALS.register
class Wool(StVenantKirchhoff):
    "Wool."

    name, meaning = "wool", "a test"
"""


def test_a_material_is_one_file(plugin):
    plugin(MATERIALS, wool_of_a_test=MATERIAL)
    yarn = load_scene("cell-course").replace("yarn.material", "wool").yarn
    assert type(material_of(yarn)).__name__ == "Wool"


KEYS = """
from typing import ClassVar

from knitstudy.knit.scene.keys import Section, physics, section
from knitstudy.knit.scene.kinds import MODELS, Model
from knitstudy.knit.scene.specimens import Knit
from knitstudy.registry import later


class Threads(Section):
    group: ClassVar[str] = "threads"

    count: int = physics("assumed", default=3, ge=1)
    "A test."


class KnitOfThreads(Knit):
    specimens = ("knit", "cut_knit")

    threads: Threads = section()


build = later("threads_of_a_test.build:build")
MODELS.register(Model("threads", "many threads", "threads", (KnitOfThreads,), build))
"""


def test_a_key_is_its_section_and_the_code_that_reads_it(plugin):
    reads = "def build(scene, fabric):\n    return scene.threads.count * len(fabric.centrelines)\n"
    plugin(MODELS, threads_of_a_test____init__=KEYS, threads_of_a_test__build=reads)
    scene = load_scene("rom2d-tie-course").vary({"fidelity": "threads", "outputs": [], "threads.count": 5})
    fabric = fabric_of(lay_out(scene))
    assert scene.kind.fidelity.build(scene, fabric) == 5 * len(fabric.centrelines)
    assert role_of("threads.count") == "physics"
    assert "threads" in scene.read(scene.sections), "it enters the digest"


FIGURE = """
from matplotlib.figure import Figure

from knitstudy.run.catalogue import FIGURES, solid


@FIGURES.add("toy", "A toy", results={"dns": solid("simulation", "tie-course")})
def draw(dns):
    return Figure()
"""


def test_a_figure_of_a_plugin_is_one_file(plugin):
    plugin(FIGURES, toy_of_a_test=FIGURE)
    assert isinstance(FIGURES.make("toy", dns=None), Figure)


def test_every_row_is_shown_by_a_test():
    rows = re.findall(r"^\| (?!new |---)[^|]+\|[^|]+\| `(test_\w+)` \|$", PAGE, flags=re.M)
    assert len(rows) == 10
    tests = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests" / "unit").glob("*.py"))
    assert [name for name in rows if f"def {name}(" not in tests] == []


def test_editors_see_the_names_that_the_package_has():
    stub = (ROOT / "src" / "knitstudy" / "__init__.pyi").read_text(encoding="utf-8")
    assert sorted(re.findall(r"import (\w+) as \1$", stub, flags=re.M)) == sorted(knitstudy.__all__)
