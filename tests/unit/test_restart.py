"""A run goes on only from its own restart file."""

from knitstudy.configuration import load_scene
from knitstudy.restart import restart_path


def test_name_follows_scene_and_inputs(tmp_path, config):
    scene = load_scene("dns-a", config)
    mesh = tmp_path / "mesh.nc"
    mesh.write_text("a")
    first = restart_path("run", scene, [mesh])
    assert first == restart_path("run", scene, [mesh])
    assert first != restart_path("run", scene.replace("load.strain", 0.01), [mesh])
    mesh.write_text("b")
    assert first != restart_path("run", scene, [mesh])
