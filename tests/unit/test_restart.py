"""A run goes on only from its own restart file."""

from knitstudy.loading.restart import forget_others, restart_path
from knitstudy.study.configuration import load_scene


def test_name_follows_scene_and_inputs(tmp_path, config):
    scene = load_scene("dns-a", config)
    mesh = tmp_path / "mesh.nc"
    mesh.write_text("a")
    first = restart_path("run", scene, [mesh])
    assert first == restart_path("run", scene, [mesh])
    assert first != restart_path("run", scene.replace("load.strain", 0.01), [mesh])
    mesh.write_text("b")
    assert first != restart_path("run", scene, [mesh])


def test_restart_files_of_earlier_inputs_are_forgotten(tmp_path, config):
    scene = load_scene("dns-a", config)
    names = [restart_path(tmp_path, scene.replace("load.strain", strain), []) for strain in (0.01, 0.02)]
    other = restart_path(tmp_path, scene.replace("name", "dns-a-fine"), [])
    for path in (*names, other):
        path.touch()
        path.with_suffix(".log").touch()
    forget_others(names[0])
    kept = {path.name for path in tmp_path.glob("dns-a-*")}
    assert kept == {p.name for path in (names[0], other) for p in (path, path.with_suffix(".log"))}
