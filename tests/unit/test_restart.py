"""A run goes on only from its own restart file."""

from knitstudy.loading.restart import IN_MEMORY, restart_of, run_with


def test_name_follows_scene_and_digest(tmp_path):
    one, other = "a" * 32, "b" * 32
    first = restart_of(tmp_path, "dns-a", one)
    assert first == restart_of(tmp_path, "dns-a", one)
    assert first.parent == tmp_path
    assert len({first, restart_of(tmp_path, "dns-a", other), restart_of(tmp_path, "dns-b", one)}) == 3


def test_restart_files_of_earlier_inputs_are_forgotten(tmp_path):
    names = [restart_of(tmp_path, "dns-a", digit * 32) for digit in "12"]
    other = restart_of(tmp_path, "dns-a-fine", "1" * 32)
    for path in (*names, other):
        for suffix in (".npz", ".log", ".nc"):
            path.with_suffix(suffix).touch()
    assert restart_of(tmp_path, "dns-a", "1" * 32) == names[0]
    kept = {path.name for path in tmp_path.iterdir()}
    assert kept == {path.with_suffix(s).name for path in (names[0], other) for s in (".npz", ".log", ".nc")}


def test_a_partial_history_lies_beside_its_restart_file(tmp_path):
    assert run_with(tmp_path / "a-1.npz").partial == tmp_path / "a-1.nc"
    assert run_with(None) == IN_MEMORY
