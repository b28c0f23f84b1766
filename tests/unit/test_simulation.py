"""Which results a scene needs, and when they are made; the computations of stages are left out."""

from dataclasses import replace

import netCDF4
import pytest
import xarray as xr
import yaml
from refusals import refusal

from knitstudy.errors import DataFileError
from knitstudy.run.configuration import load_scene
from knitstudy.run.stages import STAGES
from knitstudy.run.store import simulate


@pytest.fixture
def config(config):
    """Folder with a wale tension and a reduced model with springs as well."""
    scenes = {
        "dns-course": {},
        "dns-wale": {"load.direction": "wale"},
        "rom3d-own": {"fidelity": "rom3d", "rom.contacts_from": "dns-course"},
        "rom3d-carried": {
            "fidelity": "rom3d",
            "rom.contacts_from": "dns-course",
            "rom.springs_from": "dns-wale",
        },
        "beam": {"fidelity": "beam"},
    }
    family = {
        "studies": [],
        "keys": {"knit": "plain", "interaction": "isotropic"},
        "scenes": [{"name": name, "keys": keys} for name, keys in scenes.items()],
    }
    (config / "scenes" / "small.yaml").write_text(yaml.safe_dump(family))
    return config


@pytest.fixture
def made(monkeypatch):
    """Let every stage return its inputs, and list the stages that ran."""
    made = []

    def recorded(stage):
        def function(scene, run=None, **needed):
            made.append((stage.name, scene.knit if stage.name == "geometry" else scene.name))
            origins = {name: dataset.attrs["of"] for name, dataset in needed.items()}
            return xr.Dataset({"number": len(made)}, attrs={"of": f"{scene.name} of {stage.name}"} | origins)

        return function

    for name, stage in STAGES.items():
        monkeypatch.setitem(STAGES, name, replace(stage, function=recorded(stage)))
    return made


def test_springs_come_from_their_own_simulation(config, made):
    actual = simulate(load_scene("rom3d-carried", config), config=config)
    assert actual.history.attrs["contacts"] == "dns-course of contacts"
    assert actual.history.attrs["springs"] == "dns-wale of contacts"
    assert actual.contacts.attrs["of"] == "dns-course of contacts"
    assert made.count(("geometry", "plain")) == 1


def test_changed_knit_reaches_the_sources_and_nothing_else_does(config, made):
    changes = {"pattern.loops": 4, "solver.increments": 3}
    simulate(load_scene("rom3d-carried", config).vary(changes), config=config)
    direct = [scene for name, scene in made if name == "simulation"]
    assert len(direct) == 3
    for base in ("dns-course", "dns-wale"):
        source = load_scene(base, config).vary({"pattern.loops": 4})
        assert f"{base}-{source.hash[:8]}" in direct


def test_failure_leaves_earlier_results(config, made, tmp_path, monkeypatch):
    scene = load_scene("rom3d-own", config)
    path = simulate(scene, tmp_path, config=config).path
    before = path.read_bytes()

    def fail(scene, run, **needed):
        raise DataFileError("no")

    monkeypatch.setitem(STAGES, "simulation", replace(STAGES["simulation"], function=fail))
    with pytest.raises(DataFileError):
        simulate(scene, tmp_path, config=config, anew=True)
    assert path.read_bytes() == before


def test_interrupted_run_goes_on_where_its_geometry_is_made_again(config, made, tmp_path, monkeypatch):
    scene, begun = load_scene("beam", config), []

    def interrupt(scene, run, **needed):
        begun.append(run.restart.exists())
        run.restart.parent.mkdir(exist_ok=True)
        run.restart.touch()
        raise KeyboardInterrupt

    monkeypatch.setitem(STAGES, "simulation", replace(STAGES["simulation"], function=interrupt))
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            simulate(scene, tmp_path, config=config)
        (tmp_path / "geometry" / "plain.nc").unlink()
    assert begun == [False, True]


def test_edited_file_is_replaced(config, made, tmp_path, caplog):
    scene = load_scene("rom3d-own", config)
    path = simulate(scene, tmp_path, config=config).path
    with netCDF4.Dataset(path, "a") as file:
        file["number"][...] = 77
    assert int(simulate(scene, tmp_path, config=config).history["number"]) != 77
    assert "was changed after it was written" in caplog.text
    assert made.count(("simulation", "rom3d-own")) == 2


def test_history_that_ends_early_is_not_written(config, made, tmp_path, monkeypatch):
    half = xr.Dataset({"load": ("increment", [0.0, 0.5])})
    instead = replace(STAGES["simulation"], function=lambda scene, **needed: half)
    monkeypatch.setitem(STAGES, "simulation", instead)
    with refusal(r"simulation of beam ends at 0\.5 of the load"):
        simulate(load_scene("beam", config), tmp_path, config=config)
    assert not (tmp_path / "simulation").exists()
