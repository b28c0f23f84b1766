"""Which simulations a scene needs, and what they hand on; the stages themselves are not run."""

import os

import pytest
import xarray as xr

from knitstudy.errors import ConfigurationError
from knitstudy.stages import simulation
from knitstudy.stages.simulation import Results, lay_out, simulate
from knitstudy.study.configuration import load_scene

NOTHING = xr.Dataset()


@pytest.fixture
def config(config):
    """Folder with a wale tension and a reduced model with springs as well."""
    rows = [
        [
            "scene",
            "study",
            "knit",
            "interaction",
            "fidelity",
            "load.direction",
            "rom.contacts_from",
            "rom.springs_from",
        ],
        ["dns-course", "", "plain", "isotropic", "dns", "course", "", ""],
        ["dns-wale", "", "plain", "isotropic", "dns", "wale", "", ""],
        ["rom3d-own", "", "plain", "isotropic", "rom3d", "course", "dns-course", ""],
        ["rom3d-carried", "", "plain", "isotropic", "rom3d", "course", "dns-course", "dns-wale"],
        ["beam", "", "plain", "isotropic", "beam", "course", "", ""],
    ]
    (config / "scenes.tsv").write_text("".join("\t".join(row) + "\n" for row in rows))
    return config


@pytest.fixture
def stages(monkeypatch):
    """Record the calls of the stages, and let each return what it was called for."""
    calls = {}

    def direct(scene, archive, progress, anew):
        calls.setdefault("dns", {})[scene.name] = scene
        return Results(scene, NOTHING, NOTHING, contacts=NOTHING.assign_attrs(of=scene.name))

    def reduced(scene, specimen, contacts, springs_from, how):
        calls["rom"] = contacts.attrs["of"], None if springs_from is None else springs_from.attrs["of"]
        return xr.Dataset()

    def beams(scene, specimen, how):
        calls["beams"] = scene.name
        return xr.Dataset()

    monkeypatch.setattr(simulation, "_direct", direct)
    monkeypatch.setattr(simulation.rom, "run", reduced)
    monkeypatch.setattr(simulation.beams, "run", beams)
    monkeypatch.setattr(simulation, "build", lambda scene: NOTHING)
    monkeypatch.setattr(simulation, "read_specimen", lambda dataset: None)
    return calls


def test_reduced_model_after_its_direct_simulation(config, stages):
    simulate(load_scene("rom3d-own", config), config=config)
    assert list(stages["dns"]) == ["dns-course"]
    assert stages["rom"] == ("dns-course", None)


def test_springs_come_from_their_own_simulation(config, stages):
    scene = load_scene("rom3d-carried", config)
    found = simulate(scene, config=config)
    assert stages["rom"] == ("dns-course", "dns-wale")
    assert found.contacts.attrs["of"] == "dns-course"
    assert found.path is None


def test_reduced_model_follows_younger_contacts(config, stages, tmp_path):
    scene, folder = load_scene("rom3d-own", config), tmp_path / "results"
    contacts = folder / "contacts" / "dns-course.nc"
    contacts.parent.mkdir(parents=True)
    contacts.touch()
    assert simulate(scene, folder, config=config).path == folder / "rom" / "rom3d-own.nc"
    del stages["rom"]
    simulate(scene, folder, config=config)
    assert "rom" not in stages
    later = contacts.stat().st_mtime + 100
    os.utime(contacts, (later, later))
    simulate(scene, folder, config=config)
    assert stages["rom"] == ("dns-course", None)


def test_changed_knit_reaches_the_sources_and_nothing_else_does(config, stages):
    changes = {"pattern.loops": 4, "mesh.beam_size": 1e-3}
    simulate(load_scene("rom3d-carried", config).vary(changes), config=config)
    for scene in stages["dns"].values():
        assert scene.pattern.loops == 4
        assert scene.mesh.beam_size == 0.5e-3
        assert scene.name.endswith(f"-{scene.hash[:8]}")
    assert len(stages["dns"]) == 2


def test_beams_in_contact_need_no_other_simulation(config, stages):
    simulate(load_scene("beam", config), config=config)
    assert stages == {"beams": "beam"}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"rom.contacts_from": "dns-cource"},
            r"unknown dns scene 'dns-cource' \(did you mean 'dns-course'\?\)",
        ),
        ({"rom.contacts_from": "beam"}, r"unknown dns scene 'beam'"),
        ({"rom.springs_from": "nothing"}, r"rom\.springs_from names the unknown dns scene 'nothing'"),
        ({"interaction": "rough"}, r"interaction is 'rough' but must be 'isotropic'"),
        ({"load.direction": "wale"}, r"load\.direction is 'wale' but must be 'course'"),
    ],
)
def test_sources_that_do_not_fit(config, stages, changes, message):
    with pytest.raises(ConfigurationError, match=message):
        simulate(load_scene("rom3d-own", config).vary(changes), config=config)
    assert "dns" not in stages


def test_beams_have_no_solid_mesh(config):
    with pytest.raises(ConfigurationError, match=r"scene 'beam': fidelity is 'beam' but must be dns"):
        lay_out(load_scene("beam", config), config=config)
