"""A change runs what depends on it, and nothing else; the command and the workflow mean the same by that."""

import re
import subprocess

import pytest

from knitstudy.files import recorded_digest

TIED = re.compile(r"(dns|rom3d|rom2d)-tie")


@pytest.fixture(scope="module")
def checkout(finished):
    checkout, ended = finished
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return checkout


@pytest.fixture
def edited(checkout):
    """Function that replaces text in a file of the checkout, which is undone at the end of the test."""
    before = {}

    def edit(path, old, new):
        path = checkout.folder / path
        text = path.read_text()
        before.setdefault(path, text)
        assert old in text, f"{path} has no {old!r}"
        path.write_text(text.replace(old, new, 1))

    yield edit
    for path, text in before.items():
        path.write_text(text)


def test_nothing_to_do_at_first(checkout):
    assert checkout.jobs() == set()


def test_default_of_beams_runs_beams_and_what_reads_them(checkout, edited):
    edited("config/defaults.yaml", "stiffness: 10               # E R", "stiffness: 11               # E R")
    jobs = checkout.jobs()
    assert "Pull the beams in contact of beam-isotropic-course-coarse" in jobs
    others = {
        job for job in jobs if not job.startswith(("Pull the beams", "Draw", "Build", "Write the report"))
    }
    assert others == set()


def test_friction_runs_scenes_with_friction(checkout, edited):
    edited("config/defaults.yaml", "friction: 0.76", "friction: 0.77")
    jobs = checkout.jobs()
    assert "Load dns-isotropic-course-coarse" in jobs
    made = [job for job in jobs if job.startswith(("Load", "Pull", "Find", "Mesh", "Lay"))]
    assert all("isotropic" in job or "pair-slid" in job for job in made), made
    assert not any(job.startswith(("Mesh", "Lay")) for job in made)


def test_load_path_runs_no_mesh(checkout, edited):
    edited("config/scenes/3-pairs.yaml", "[318e-6, 318e-6", "[319e-6, 318e-6")
    jobs = checkout.jobs()
    assert "Load pair-slid-90" in jobs
    assert not any(job.startswith(("Mesh", "Lay")) for job in jobs)


def test_new_key_with_a_default_runs_nothing(checkout, edited):
    edited(
        "src/knitstudy/study/model_sections.py",
        "class Newton(Section):",
        """class Sized(Section):
    \"\"\"Keys that were added.\"\"\"

    added: float = key("numerics", "choice", source="a test", ge=0, default=1.0)


class Newton(Sized):""",
    )
    assert checkout.jobs() == set()
    edited("config/defaults.yaml", "  increments: 12\n", "  increments: 12\n  added: 2.0\n")
    assert "Load dns-tie-course-coarse" in checkout.jobs(), "another value is another result"


def test_scene_that_is_added_runs_itself_and_what_lists_it(checkout, edited):
    edited(
        "config/scenes/6-beams.yaml",
        "scenes:\n",
        "scenes:\n- {name: beam-added, studies: ci, keys: {interaction: rough, load.strain: 0.003}}\n",
    )
    jobs = checkout.jobs()
    assert "Pull the beams in contact of beam-added" in jobs
    others = {job for job in jobs if not job.startswith(("Draw", "Build", "Write the report"))}
    assert others == {"Pull the beams in contact of beam-added"}


def test_friction_law_runs_no_tied_model(checkout, edited):
    edited("src/knitstudy/mechanics/contact/friction.py", "\nOPEN, STICK", "\nEDITED = True\nOPEN, STICK")
    jobs = checkout.jobs()
    assert "Load dns-isotropic-course-coarse" in jobs
    simulated = [job for job in jobs if job.startswith(("Lay", "Mesh", "Load", "Find", "Pull"))]
    assert not [job for job in simulated if TIED.search(job)]


@pytest.mark.parametrize(
    "module", ["mechanics/newton.py", "mechanics/contact/friction.py", "figures/style.py"]
)
def test_comment_runs_nothing(checkout, edited, module):
    edited(f"src/knitstudy/{module}", '"""', '"""Better said: ')
    edited(f"src/knitstudy/{module}", "\n\n\n", "\n\n\n# A better comment.\n")
    assert checkout.jobs() == set()


def knitstudy(checkout, *arguments):
    """Run the command in the checkout."""
    command = [checkout.python, "-m", "knitstudy", *arguments]
    ended = subprocess.run(
        command, cwd=checkout.folder, env=checkout.environment, capture_output=True, text=True
    )
    assert ended.returncode == 0, ended.stderr
    return ended


def test_command_uses_what_the_workflow_made_until_the_code_changes(finished_copy):
    path = finished_copy.folder / "results" / "simulation" / "rom3d-tie-course-coarse.nc"
    first, time = recorded_digest(path), path.stat().st_mtime_ns
    knitstudy(finished_copy, "run", "rom3d-tie-course-coarse")
    assert path.stat().st_mtime_ns == time
    module = finished_copy.folder / "src" / "knitstudy" / "networks" / "simulation" / "rom3d.py"
    module.write_text(module.read_text() + "\nEDITED = True\n")
    knitstudy(finished_copy, "run", "rom3d-tie-course-coarse")
    assert path.stat().st_mtime_ns > time
    assert recorded_digest(path) != first
    # And the workflow takes what the command has made, but not what it made before.
    jobs = finished_copy.jobs()
    assert "Pull the reduced model rom3d-tie-course-coarse" not in jobs
    assert "Pull the reduced model rom3d-tie-wale-coarse" in jobs


def test_workflow_uses_what_the_command_made(fresh):
    knitstudy(fresh, "run", "dns-tie-course-coarse")
    target = "results/simulation/dns-tie-course-coarse.nc"
    assert fresh.jobs(target) == set()
    defaults = fresh.folder / "config" / "defaults.yaml"
    defaults.write_text(defaults.read_text().replace("youngs_modulus: 1.30e9", "youngs_modulus: 1.31e9"))
    assert fresh.jobs(target) == {"Load dns-tie-course-coarse"}
