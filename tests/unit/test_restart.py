"""A run goes on only from its own restart file."""

from knitstudy.loading.restart import restart_of, run_with

FIRST, SECOND = 16 * "a", 16 * "b"


def test_name_follows_scene_and_digest(tmp_path):
    assert restart_of(tmp_path, "dns-a", FIRST).name == f"dns-a-{FIRST}.npz"
    assert restart_of(tmp_path, "dns-a", FIRST) == restart_of(tmp_path, "dns-a", FIRST)
    assert restart_of(tmp_path, "dns-a", FIRST) != restart_of(tmp_path, "dns-a", SECOND)


def test_restart_files_of_earlier_inputs_are_forgotten(tmp_path):
    names = [f"dns-a-{FIRST}", f"dns-a-{SECOND}", f"dns-a-fine-{FIRST}"]
    for name in names:
        for suffix in (".npz", ".nc"):
            (tmp_path / f"{name}{suffix}").touch()
    restart_of(tmp_path, "dns-a", FIRST)
    kept = {path.name for path in tmp_path.iterdir()}
    assert kept == {f"{name}{suffix}" for name in (names[0], names[2]) for suffix in (".npz", ".nc")}


def test_history_lies_beside_its_restart_file(tmp_path):
    restart = restart_of(tmp_path, "dns-a", FIRST)
    assert run_with(restart).partial == tmp_path / f"dns-a-{FIRST}.nc"
    assert run_with(None).restart is run_with(None).partial is None
