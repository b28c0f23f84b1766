"""The digest of the code behind a result changes with a statement, and not with a comment or a docstring."""

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from knitstudy.run import code_digest as code
from knitstudy.run.code_digest import FILES_OF_INPUT, MODEL, OF_SCENES, code_digest, physics_digest

SOURCE = code.PACKAGE
SCENES = [file for files in OF_SCENES for file in SOURCE.glob(files) if file.name not in FILES_OF_INPUT]


def counted():
    """Files whose code counts for a simulation."""
    inside = [file for place in MODEL for file in [SOURCE / place, *(SOURCE / place).rglob("*.py")]]
    return sorted({file for file in (*inside, *SCENES) if file.is_file()})


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    """A copy of the package."""
    copy = tmp_path_factory.mktemp("copy") / "knitstudy"
    shutil.copytree(SOURCE, copy, ignore=shutil.ignore_patterns("data", "__pycache__"))
    return copy


@pytest.fixture
def digest_with(copied, monkeypatch):
    """Function that returns the physics digest with another text of a file of the package."""
    monkeypatch.setattr(code, "PACKAGE", copied)

    def digest(file, text):
        path = copied / file.relative_to(SOURCE)
        before = path.read_text(encoding="utf-8")
        path.write_text(text, encoding="utf-8")
        code._digest.cache_clear()
        try:
            return physics_digest()
        finally:
            path.write_text(before, encoding="utf-8")

    yield digest
    code._digest.cache_clear()


def returned_values(source):
    """Expressions that functions return, but for those of validators."""
    functions = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.FunctionDef)]
    functions = [node for node in functions if "validator" not in "".join(map(ast.dump, node.decorator_list))]
    inside = [each for node in functions for each in ast.walk(node)]
    return [node.value for node in inside if isinstance(node, ast.Return) and node.value is not None]


@pytest.mark.parametrize("file", counted(), ids=lambda file: file.relative_to(SOURCE).as_posix())
def test_a_changed_line_counts_and_a_changed_comment_does_not(digest_with, file):
    source = file.read_text(encoding="utf-8")
    before = digest_with(file, source)
    described = source.replace('"""', '"""Of late: ', 1) + "\n# a comment\n\n"
    assert digest_with(file, described) == before
    values = returned_values(source)
    if values:
        text = ast.get_source_segment(source, values[-1])
        other = source.replace(f"return {text}", f"return 2 * ({text})")
        assert other != source
    else:
        other = f"{source}\nOTHER = 1\n"
    assert digest_with(file, other) != before


def test_every_module_that_a_simulation_reaches_counts_or_reads_keys():
    """But for what keeps files and finds plugins, which no number depends on."""
    script = (
        "import sys\n"
        "import knitstudy.knit.simulate, knitstudy.knit.stress, knitstudy.knit.contacts\n"
        "import knitstudy.knit.models.beam.build, knitstudy.knit.models.beam.rest, knitstudy.knit.models.beam.bending\n"
        "from knitstudy.knit.scene.kinds import MODELS\n"
        "[model.build for model in MODELS.all().values()]\n"
        "packages = 'knitstudy.knit', 'knitstudy.mechanics'\n"
        "files = [module.__file__ for name, module in sys.modules.items() if name.startswith(packages)]\n"
        "print(*files, sep='\\n')"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=SOURCE.parent
    )
    reached = {Path(file) for file in done.stdout.split("\n") if file}
    files = {str(file) for file in counted()} | {
        str(SOURCE / "knit" / "scene" / name) for name in FILES_OF_INPUT
    }
    assert len(reached) > 80
    assert not [file for file in map(str, reached) if file not in files and "return" in open(file).read()]


@pytest.mark.parametrize(
    ("file", "line", "other"),
    [
        ("knit/scene/sections.py", "return self.diameter / 2", "return self.diameter / 3"),
        ("knit/scene/kinds.py", "math.inf", "0.5"),
        ("knit/models/beam/__init__.py", 'int(row != "a")', 'int(row == "a")'),
        ("knit/scene/sections.py", 'INLAY = "inlay"', 'INLAY = "straight"'),
    ],
    ids=["radius of a yarn", "friction of rough yarns", "yarns a and b", "a constant"],
)
def test_what_scenes_compute_counts(digest_with, file, line, other):
    path = SOURCE / file
    source = path.read_text(encoding="utf-8")
    assert line in source
    assert digest_with(path, source.replace(line, other)) != digest_with(path, source)


def test_a_new_key_and_other_limits_do_not_count(digest_with):
    path = SOURCE / "knit/scene/shared_sections.py"
    source = path.read_text(encoding="utf-8")
    line = '    overlap: float = numerics("choice", meaning="over the yarn\'s radius", default=0.5, gt=0)\n'
    assert line in source
    new = line.replace("overlap", "another") + line.replace("gt=0", "gt=0, le=2")
    assert digest_with(path, source.replace(line, new)) == digest_with(path, source)


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Two packages in the place of those of this one."""
    for name, text in (("mesh", "SIZE = 1\n"), ("mechanics", "LAW = 1\n")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "a.py").write_text(text)
    monkeypatch.setattr(code, "PACKAGE", tmp_path)
    code._digest.cache_clear()
    yield tmp_path
    code._digest.cache_clear()


def test_files_of_a_package_count_and_no_others(package):
    before = code_digest("mesh"), code_digest("mesh", "mechanics")
    (package / "mechanics" / "a.py").write_text("LAW = 2\n")
    code._digest.cache_clear()
    assert code_digest("mesh") == before[0]
    assert code_digest("mesh", "mechanics") != before[1]


@pytest.mark.parametrize("path", ["law_of_a_test", "law_of_a_test/__init__"])
def test_files_of_a_plugin_count(package, plugin, path):
    before = code_digest("mesh")
    plugin(**{path.replace("/", "__"): "STIFFNESS = 1\n"})
    first = code_digest("mesh")
    (package / f"{path}.py").write_text("STIFFNESS = 2\n")
    code._digest.cache_clear()
    assert len({before, first, code_digest("mesh")}) == 3
    del sys.modules["law_of_a_test"]
    assert code_digest("mesh") == before, "those of a plugin that is gone do not"
