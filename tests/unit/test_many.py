"""Many scenes side by side, and histories that are scaled from those of other stiffnesses."""

import errno
import logging
import os
from dataclasses import replace

import pytest
import xarray as xr
from refusals import refusal

from knitstudy.errors import ConvergenceError, KnitstudyError
from knitstudy.knit.geometry.columns import HISTORY
from knitstudy.run.configuration import load_scene
from knitstudy.run.plan import Plan
from knitstudy.run.simulations import simulate, simulate_many
from knitstudy.run.stages import STAGES
from knitstudy.run.store import scaled

FRICTION, MODULUS = "contact.friction", "yarn.youngs_modulus"
CELL = {"fidelity": "beam", "interaction": "isotropic", "pattern.loops": 1, "pattern.rows": 1, "outputs": []}
SOFT = {
    "mesh.section_law": "straight",
    "yarn.stretching": 500.0,
    "yarn.bending": 2e-6,
    "load.largest_force": 3.0,
}
STICKY = 0.9


@pytest.fixture
def cell(monkeypatch):
    # Tests of plugins may have loaded some into this process.
    monkeypatch.setattr("knitstudy.run.plan.plugin_files", tuple)
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


def test_scenes_share_a_digest_where_stiffnesses_differ_by_one_factor(cell, monkeypatch):
    def unit(scene):
        return Plan.of().step("simulation", scene).unit_digest

    soft = cell.vary(SOFT)
    assert unit(cell) == unit(cell.replace(MODULUS, 0.7e9)) != unit(cell.replace(FRICTION, 0.7))
    assert unit(soft) == unit(soft.scaled(stiffness=1.7)) != unit(soft.replace(MODULUS, 0.7e9))
    sprung = load_scene("rom3d-isotropic-course")
    assert unit(sprung) == "", "its springs come from another scene"
    monkeypatch.setattr("knitstudy.run.plan.plugin_files", lambda: ["law.py"])
    assert unit(cell) == "", "nobody knows the laws of a plugin"


def test_units_say_what_is_scaled():
    """No unit has a force twice or in its denominator."""
    units = {str(unit) for unit in HISTORY.table["unit"]}
    forces = {"N", "N/m", "N m", "J", "Pa"}
    assert units - forces == {"1", "m", "m2", "s"}
    history = xr.Dataset({unit: ("increment", [1.0], {"units": unit}) for unit in units})
    actual = scaled(history, 2.0)
    assert {unit: float(actual[unit][0]) for unit in units} == {
        unit: 1.0 + (unit in forces) for unit in units
    }
    assert actual["N"].attrs["units"] == "N"


def test_another_modulus_costs_nothing(cell, made, tmp_path, caplog):
    caplog.set_level(logging.INFO)
    soft, stiff = cell, cell.vary({MODULUS: 2 * cell.yarn.youngs_modulus, "name": "stiff"})
    first = simulate(soft, tmp_path).history
    for _ in range(2):  # the second time from its own file
        second = simulate(stiff, tmp_path).history
        assert float(second["force"][-1]) == second.attrs["indentation_modulus"] == stiff.yarn.youngs_modulus
        assert float(second["strain"][-1]) == float(first["strain"][-1])
        assert second.attrs["scaled_from"] == f"cell {Plan.of().step('simulation', soft).digest}"
        assert second.attrs["scaled_by"] == 2
        (tmp_path / "simulation" / "broken.nc").write_text("of another program")
    assert "broken.nc" not in caplog.text
    assert "forces of cell times 2, as all stiffnesses" in caplog.text
    assert len(made()) == 1
    assert "scaled_from" not in simulate(stiff, tmp_path, anew=True).history.attrs
    assert len(made()) == 2


def test_another_scene_of_one_name_is_a_warning(cell, made, tmp_path, caplog):
    simulate(cell, tmp_path)
    simulate(cell, tmp_path, anew=True)
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
    assert ["scaled_from" in each.history.attrs for each in results if each] == [False, False, True, True]
    assert sorted(line.split()[1] for line in made()) == ["0.1", "0.3", "0.9", "0.9"]
    assert caplog.text.count("no balance") == 2
    with refusal(
        rf"^2 of 6 scenes failed, cell-\w+, cell-\w+: .*no balance; the others are in {tmp_path}",
        KnitstudyError,
    ):
        simulate_many(scenes, tmp_path)
    assert sorted(line.split()[1] for line in made()[4:]) == ["0.9", "0.9"], "the others are kept"


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
