"""Figures from outside, and what studies offer."""

import pytest

from knitstudy.run.catalogue import FIGURES, TABLES, Displays, reference_files
from knitstudy.run.configuration import CONFIG, STUDIES, load_study
from knitstudy.run.plan import Plan

TOY = """
from matplotlib.figure import Figure

from knitstudy.run.catalogue import FIGURES


@FIGURES.add("toy", "A figure from outside")
def draw():
    figure = Figure(figsize=(1, 1))
    figure.text(0.5, 0.5, "toy")
    return figure
"""


def test_figure_of_a_plugin_is_drawn_and_drawn_again_when_its_code_changes(fresh):
    module = fresh.folder / "toyfigure.py"
    module.write_text(TOY)
    toy = ("results/figures/toy.png", "--cores", "1", "--config", "study=ci", "plugins=['toyfigure']")
    ended = fresh.snakemake(*toy)
    assert ended.returncode == 0, ended.stderr
    assert (fresh.folder / "results/figures/toy.png").read_bytes().startswith(b"\x89PNG")
    assert "Nothing to be done" in fresh.snakemake(*toy, "--dry-run").stdout
    module.write_text(TOY.replace('0.5, "toy"', '0.5, "other"'))
    assert "Draw toy" in fresh.snakemake(*toy, "--dry-run").stdout


@pytest.fixture(scope="module")
def plan():
    return Plan.of(CONFIG)


@pytest.mark.parametrize("study", STUDIES)
def test_figures_that_are_offered_have_all_their_inputs(plan, study):
    """Direct simulations without fields have no stress: pictures of it are not offered, instead of ending the study."""
    scenes = [plan.scenes[name] for name in load_study(study, CONFIG)]
    for catalogue in (FIGURES, TABLES):
        displays = Displays(catalogue, plan, scenes, reference_files(CONFIG))
        assert displays.names()
        for name in displays.names():
            assert displays.digest(name)
