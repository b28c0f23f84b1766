"""Many scenes side by side."""

import errno
import os
from dataclasses import replace

import pytest
import xarray as xr
from refusals import refusal

from knitstudy.errors import ConvergenceError, KnitstudyError
from knitstudy.run.configuration import load_scene
from knitstudy.run.simulations import simulate, simulate_many
from knitstudy.run.stages import STAGES

FRICTION, MODULUS = "contact.friction", "yarn.youngs_modulus"
CELL = {"fidelity": "beam", "interaction": "isotropic", "pattern.loops": 1, "pattern.rows": 1, "outputs": []}
STICKY = 0.9


@pytest.fixture
def cell():
    return load_scene("cell-course").vary({**CELL, "name": "cell"})


@pytest.fixture
def made(monkeypatch, tmp_path):
    """Let a simulation return its modulus as a force, and note its scene in a file; one does not converge."""

    def history(scene, run=None, **needed):
        with (tmp_path / "made.txt").open("a") as file:
            print(scene.name, scene.contact.friction, scene.yarn.youngs_modulus, file=file)
        if scene.contact.friction == STICKY:
            raise ConvergenceError("no balance")
        values = {"load": ("increment", [0.0, 1.0]), "strain": ("increment", [0.0, 0.01])}
        force = ("increment", [0.0, scene.yarn.youngs_modulus], {"units": "N"})
        return xr.Dataset({**values, "force": force}, attrs={"indentation_modulus": force[1][-1]})

    for name, function in {"geometry": lambda scene: xr.Dataset(), "simulation": history}.items():
        monkeypatch.setitem(STAGES, name, replace(STAGES[name], function=function))
    return lambda: (tmp_path / "made.txt").read_text().splitlines()


def test_another_scene_of_one_name_is_a_warning(cell, made, tmp_path, caplog):
    simulate(cell, tmp_path)
    simulate(cell, tmp_path, force=True)
    assert "another scene" not in caplog.text
    simulate(cell.vary({FRICTION: 0.2}), tmp_path)
    assert "cell.nc: another scene of this name (contact.friction) is replaced; set name" in caplog.text


def test_a_folder_that_cannot_be_written_is_refused_before_anything_is_computed(
    cell, made, tmp_path, monkeypatch
):
    def denied(path, *arguments, **known):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr("pathlib.Path.touch", denied)
    with refusal("nc: cannot be written .Permission denied.: name another folder"):
        simulate(cell, tmp_path / "of-others")
    assert not (tmp_path / "made.txt").exists()


def test_a_scene_that_fails_loses_no_other(cell, made, tmp_path, caplog):
    frictions, moduli = (0.1, STICKY, 0.3), (1e9, 2e9)
    scenes = [cell.vary({FRICTION: mu, MODULUS: E}) for E in moduli for mu in frictions]
    results = simulate_many(scenes, tmp_path, jobs=2, errors="coerce")
    assert [result is None for result in results] == [False, True, False] * 2
    of = [(each.scene.contact.friction, float(each.history["force"][-1])) for each in results if each]
    assert of == [(0.1, 1e9), (0.3, 1e9), (0.1, 2e9), (0.3, 2e9)]
    assert len({each.path for each in results if each}) == 4, "scenes that share a name do not share a file"
    assert sorted(line.split()[1] for line in made()) == ["0.1"] * 2 + ["0.3"] * 2 + ["0.9"] * 2
    assert caplog.text.count("no balance") == 2
    with refusal(
        rf"^2 of 6 scenes failed, cell-\w+, cell-\w+: .*no balance; the others are in {tmp_path}",
        KnitstudyError,
    ):
        simulate_many(scenes, tmp_path)
    assert sorted(line.split()[1] for line in made()[6:]) == ["0.9", "0.9"], "the others are kept"


def test_a_process_that_dies_is_named(cell, monkeypatch, tmp_path):
    def die(scene, **needed):
        os._exit(1)

    monkeypatch.setitem(STAGES, "geometry", replace(STAGES["geometry"], function=die))
    with refusal("the system ended a process, perhaps for its memory: take fewer jobs", KnitstudyError):
        simulate_many([cell], tmp_path)


def test_nothing_is_simulated_of_nothing(tmp_path):
    for wrong in ({"jobs": -1}, {"errors": "ignore"}):
        with refusal("must be 1 or more, and raise or coerce"):
            simulate_many([], tmp_path, **wrong)
    assert simulate_many([], tmp_path) == []
