"""What a newcomer touches (CONTRIBUTING.md): every kind of part is added by as few files as the page says."""

import re
from pathlib import Path

from matplotlib.figure import Figure

import knitstudy
from knitstudy import load_scene
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


FIGURE = """
from matplotlib.figure import Figure

from knitstudy.run.catalogue import FIGURES, one


@FIGURES.add("toy", "A toy", results={"dns": one("simulation", "yarns-tie-course")})
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
