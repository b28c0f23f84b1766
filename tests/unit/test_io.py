"""Files are written whole or not at all, and errors of bad ones name a remedy."""

import errno
import fcntl
import os
import signal
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from pathlib import Path

import netCDF4
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from refusals import refusal

from knitstudy.datasets import (
    VERSIONS,
    commit_of,
    read_dataset,
    read_result,
    read_table,
    recorded_digest,
    seal,
    write_dataset,
    write_table,
)
from knitstudy.errors import UnwritableError
from knitstudy.files import ABANDONED, open_regular, replacing, replacing_together, write_text
from knitstudy.run.configuration import load_scene


@pytest.fixture
def dataset():
    force = np.random.default_rng(0).normal(size=5000)
    return xr.Dataset({"force": ("increment", force, {"units": "N"})})


def test_a_power_cut_leaves_the_old_file_or_the_whole_new_one(tmp_path, monkeypatch):
    """The content is on the disk before the file takes its name, and so is the name when all is done."""
    flush, rename, done = os.fsync, os.replace, []

    def fsync(descriptor):
        done.append(os.readlink(f"/proc/self/fd/{descriptor}"))
        flush(descriptor)

    def replace(source, target):
        done.append((str(source), str(target)))
        rename(source, target)

    monkeypatch.setattr(os, "fsync", fsync)
    monkeypatch.setattr(os, "replace", replace)
    with replacing(tmp_path / "a.csv") as temporary:
        temporary.write_text("new")
    assert done == [str(temporary), (str(temporary), str(tmp_path / "a.csv")), str(tmp_path)]


@contextmanager
def held_by_another_program(opened, path):
    """Have another process open a file, by the expression `opened` of its path, while the block runs."""
    code = f"import fcntl, netCDF4, sys, time; path = sys.argv[1]; f = {opened}; print(flush=True); time.sleep(60)"
    with subprocess.Popen([sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE) as other:
        other.stdout.readline()
        try:
            yield
        finally:
            other.kill()


def test_what_killed_processes_left_is_deleted_and_what_others_write_is_not(tmp_path):
    """A temporary file that nobody has changed for long is abandoned, by the clock of the file system alone."""
    live, dead, link = (tmp_path / f".a.{number}.partial.csv" for number in (1, 2, 3))
    outside = tmp_path / "outside"
    outside.mkdir()
    live.write_text("half")
    dead.write_text("half")
    link.symlink_to(outside)
    long_ago = live.stat().st_mtime - 1.1 * ABANDONED
    for left in (dead, link):
        os.utime(left, (long_ago, long_ago), follow_symlinks=False)
    with replacing(tmp_path / "a.csv") as temporary:
        temporary.write_text("new")
    assert sorted(path.name for path in tmp_path.iterdir()) == [live.name, "a.csv", "outside"]


def write_often(path, times):
    """Write a file many times; return the errors."""
    errors = []
    for number in range(times):
        try:
            write_text(f"{number}", path)
        except Exception as error:
            errors.append(repr(error))
    return errors


def test_processes_that_write_one_file_at_once_never_fail(tmp_path):
    with ProcessPoolExecutor(8, get_context("fork")) as pool:
        errors = [*pool.map(write_often, [tmp_path / "a.txt"] * 8, [60] * 8)]
    assert errors == [[]] * 8
    assert os.listdir(tmp_path) == ["a.txt"]


def test_threads_that_write_one_file_leave_each_other_alone(tmp_path):
    with replacing(tmp_path / "a.csv") as one, replacing(tmp_path / "a.csv") as other:
        one.write_text("one")
        other.write_text("other")
    assert (os.listdir(tmp_path), (tmp_path / "a.csv").read_text()) == (["a.csv"], "one")


def test_a_result_that_another_program_writes_to_is_not_called_broken(tmp_path, dataset):
    write_dataset(dataset, tmp_path / "a.nc")
    with held_by_another_program("netCDF4.Dataset(path, 'a')", tmp_path / "a.nc"):
        for read in (read_dataset, recorded_digest):
            with refusal(r"a\.nc: another program.* holds the file open"):
                read(tmp_path / "a.nc")
    with refusal(r"a\.nc: (was changed|does not end with)"):
        read_dataset(tmp_path / "a.nc")


def test_a_result_that_another_program_reads_is_read(tmp_path, dataset):
    write_dataset(dataset, tmp_path / "a.nc")
    with held_by_another_program("netCDF4.Dataset(path)", tmp_path / "a.nc"):
        assert read_dataset(tmp_path / "a.nc").sizes == dataset.sizes


def test_a_sealed_table_that_was_edited_is_refused(tmp_path):
    table = pd.DataFrame({"force [N]": [1.0, 2.0]})
    write_table(table, tmp_path / "a.csv")
    seal(tmp_path / "a.csv", "digest")
    pd.testing.assert_frame_equal(read_table(tmp_path / "a.csv"), table)
    (tmp_path / "a.csv").write_text("force [N]\n1.0\n")
    with refusal(r"a\.csv: was changed after it was written; delete it"):
        read_table(tmp_path / "a.csv")


def edited(path):
    path.write_bytes(path.read_bytes() + b"x")


def unit_edited(path):
    with netCDF4.Dataset(path, "a") as file:
        file["force"].units = "kN"


def value_edited(path):
    with netCDF4.Dataset(path, "a") as file:
        file["force"][-1] = 3.0


def attribute_added(path):
    with netCDF4.Dataset(path, "a") as file:
        file.title = "opened and written"


def seal_of_another(path):
    write_text("a" * 16 + " digest", path.with_name(f".{path.name}.sum"))


@pytest.mark.parametrize(
    ("name", "harm"),
    [
        *(
            (name, harm)
            for name in ("a.png", "a.csv", "a.html", "a.pvd")
            for harm in (edited, seal_of_another)
        ),
        *(("a.nc", harm) for harm in (unit_edited, value_edited, attribute_added)),
    ],
)
def test_results_of_all_kinds_are_sound_until_somebody_edits_them(tmp_path, dataset, name, harm):
    path = tmp_path / name
    if path.suffix == ".nc":
        write_dataset(dataset, path, digest="digest")
    else:
        write_text("a,b\n1,2\n", path)
        seal(path, "digest")
    assert recorded_digest(path) == "digest"
    harm(path)
    with refusal(rf"{name}: (was changed after it was written|does not end with a checksum).*; delete it"):
        recorded_digest(path)


@pytest.mark.parametrize("name", ["a.nc", "a.csv"])
def test_a_result_that_may_not_be_read_is_named(tmp_path, monkeypatch, name):
    (tmp_path / name).write_text("a")

    def denied(*_, **__):
        raise OSError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(Path, "open", denied)
    with refusal(rf"{name}: cannot be read \(Permission denied\)"):
        recorded_digest(tmp_path / name)


def test_a_result_without_its_seal_counts_as_missing(tmp_path):
    write_text("a", tmp_path / "a.png")
    seal(tmp_path / "a.png", "digest")
    (tmp_path / ".a.png.sum").unlink()
    assert recorded_digest(tmp_path / "a.png") == ""


def test_files_of_one_answer_are_replaced_together(tmp_path):
    """An error after the first of them changes nothing; files of somebody else stay."""
    for name in ("table.csv", "stale.inp", "mine.txt"):
        (tmp_path / name).write_text("old")
    with suppress(ZeroDivisionError), replacing_together(tmp_path, stale=["stale.inp"]) as beside:
        write_text("new", beside / "table.csv")
        raise ZeroDivisionError
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == dict.fromkeys(
        ("table.csv", "stale.inp", "mine.txt"), "old"
    )
    with replacing_together(tmp_path, stale=["stale.inp"]) as beside:
        write_text("new", beside / "table.csv")
        write_text("new", beside / "grids" / "0.vtu")
    files = {
        str(path.relative_to(tmp_path)): path.read_text() for path in tmp_path.rglob("*") if path.is_file()
    }
    assert files == {"table.csv": "new", "mine.txt": "old", "grids/0.vtu": "new"}


@pytest.mark.parametrize("kind", ["link", "pipe", "folder"])
def test_a_file_of_a_fixed_name_is_regular_or_refused(tmp_path, kind):
    """Somebody else's folder has something in the place of a lock or a log: nothing elsewhere is made or waited for."""
    path = tmp_path / "study.lock"
    match kind:
        case "link":
            path.symlink_to(tmp_path / "elsewhere")
        case "pipe":
            os.mkfifo(path)
        case "folder":
            path.mkdir()
    with refusal("study.lock: is not a regular file, and is not written to"):
        open_regular(path)
    assert os.listdir(tmp_path) == ["study.lock"]


def test_a_file_of_a_fixed_name_keeps_its_text(tmp_path):
    (tmp_path / "study.lock").write_text("12")
    with open_regular(tmp_path / "study.lock") as file:
        assert file.read() == "12"
    with open_regular(tmp_path / "new.lock") as file:
        assert file.read() == ""


@pytest.mark.parametrize("fails", ["fsync", "replace"])
@pytest.mark.parametrize(
    ("number", "message"),
    [
        (errno.ENOSPC, r"cannot be written \(No space left on device\): make room on the disk"),
        (errno.EACCES, r"cannot be written \(Permission denied\): name another folder, as with -o"),
    ],
)
def test_a_full_disk_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch, fails, number, message):
    path = tmp_path / "a.csv"
    path.write_text("old")

    def full(*arguments):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, fails, full)
    with refusal(rf"a\.csv: {message}"), replacing(path) as temporary:
        temporary.write_text("new")
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a.csv"]


@pytest.mark.parametrize("write", [write_text, lambda text, path: write_together(path.parent / "sheet")])
def test_a_folder_that_can_only_be_read_is_named_with_its_remedy(tmp_path, monkeypatch, write):
    def only_read(*arguments, **known):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(os, "mkdir", only_read)
    with refusal(r"cannot be written \(Read-only file system\): name another folder", UnwritableError):
        write("text", tmp_path / "new" / "a.txt")


def write_together(folder):
    with replacing_together(folder) as beside:
        write_text("text", beside / "a.txt")


@pytest.mark.parametrize("no_locks", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP])
def test_a_file_system_without_locks_is_written_to_and_read_from(tmp_path, monkeypatch, dataset, no_locks):
    def none(*_):
        raise OSError(no_locks, os.strerror(no_locks))

    monkeypatch.setattr(fcntl, "flock", none)
    monkeypatch.setenv("HDF5_USE_FILE_LOCKING", "TRUE")  # so that what is said here is undone
    monkeypatch.delenv("HDF5_USE_FILE_LOCKING")
    write_dataset(dataset, tmp_path / "a.nc", digest="digest")
    assert os.environ["HDF5_USE_FILE_LOCKING"] == "FALSE"
    assert recorded_digest(tmp_path / "a.nc") == "digest"
    assert read_dataset(tmp_path / "a.nc").sizes == dataset.sizes


def test_dataset_round_trip_with_provenance(tmp_path, config, dataset):
    scene = load_scene("dns-a", config)
    write_dataset(dataset, tmp_path / "a.nc", scene.name, digest="beef")
    read = read_dataset(tmp_path / "a.nc")
    xr.testing.assert_equal(read, dataset)
    assert read.force.units == "N"
    assert (read.scene, read.digest) == (scene.name, "beef") == ("dns-a", recorded_digest(tmp_path / "a.nc"))
    assert read.numpy == np.__version__
    assert all(read.attrs[name] for name in VERSIONS)
    (tmp_path / "a.nc").unlink()
    assert read.force.sum() == dataset.force.sum(), "the file is closed and all of it is in memory"


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.99])
def test_truncated_dataset(tmp_path, dataset, share):
    path = tmp_path / "a.nc"
    write_dataset(dataset, path)
    os.truncate(path, int(share * path.stat().st_size))
    with refusal(r"a\.nc: does not end with a checksum: it was cut, .* delete it"):
        read_dataset(path)


@pytest.fixture
def interruptible():
    """Ctrl-C as programs in the foreground have it: a shell starts others with it ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_an_interruption_is_put_off_until_a_file_is_written(tmp_path, monkeypatch, interruptible):
    """Between the taking of a lock and its use it would leave the lock taken."""
    written = xr.Dataset.to_netcdf

    def interrupted(self, path, **options):
        signal.raise_signal(signal.SIGINT)
        return written(self, path, **options)

    monkeypatch.setattr(xr.Dataset, "to_netcdf", interrupted)
    before = signal.getsignal(signal.SIGINT)
    data = xr.Dataset({"a": ("x", np.arange(3.0))})
    with pytest.raises(KeyboardInterrupt):
        write_dataset(data, tmp_path / "a.nc")
    assert signal.getsignal(signal.SIGINT) is before
    assert not list(tmp_path.iterdir())  # not replaced: who interrupts does not want it
    monkeypatch.undo()
    write_dataset(data, tmp_path / "a.nc")
    np.testing.assert_array_equal(read_dataset(tmp_path / "a.nc")["a"], [0, 1, 2])


HISTORY = {"load": [0.0, 0.5, 1.0], "force": [0.0, 1.0, 2.0]}


@pytest.fixture
def history():
    """Function of a history, some variables of which are other ones."""
    return lambda **other: xr.Dataset(
        {name: ("increment", value) for name, value in (HISTORY | other).items()}
    )


def test_a_file_that_was_changed_afterwards_is_refused(tmp_path, history):
    path = tmp_path / "a.nc"
    write_dataset(history(), path, digest="beef")
    assert read_result(path).force[-1] == 2
    with netCDF4.Dataset(path, "a") as file:
        file["force"][-1] = 3.0
    with refusal(r"a\.nc: does not end with a checksum.*; delete it and make"):
        read_dataset(path)


@pytest.mark.parametrize(
    ("other", "message"),
    [
        ({"force": [0.0, np.nan, 2.0]}, "force holds a value that is not a number"),
        ({"load": [0.0, 0.2, 0.4]}, r"ends at 0\.4 of the load"),
    ],
)
def test_a_history_that_is_not_complete_is_no_result(tmp_path, history, other, message):
    write_dataset(history(**other), tmp_path / "a.nc")
    with refusal(rf"a\.nc: {message}; delete it"):
        read_result(tmp_path / "a.nc")


def test_a_file_marked_incomplete_is_no_result(tmp_path, history):
    write_dataset(history().assign_attrs(incomplete="no balance"), tmp_path / "a.nc", digest="beef")
    assert recorded_digest(tmp_path / "a.nc") == ""
    with refusal(r"a\.nc: is incomplete \(no balance\)"):
        read_result(tmp_path / "a.nc")
    assert read_dataset(tmp_path / "a.nc").force[-1] == 2, "what had converged can be looked at"


def test_tables_that_cannot_be_used_are_refused(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("scene,force [N]\na,1.5\n")
    with refusal(r"has no column 'strain', only 'scene', 'force \[N\]'"):
        read_table(path, needs=["strain"])
    path.write_text("")
    with refusal("is not a CSV table"):
        read_table(path)


def test_hashes_of_digits_alone_stay_texts(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("force [N],behaviour,commit\n1.5,5e20,336645524534\n2,0012345678901234,12e4567890ab\n")
    table = read_table(path)
    assert table["commit"].tolist() == ["336645524534", "12e4567890ab"]
    assert table["behaviour"].tolist() == ["5e20", "0012345678901234"]
    assert table["force [N]"].tolist() == [1.5, 2.0]


def test_strains_in_the_plane_have_names(tmp_path):
    """Forces per width of a cell by name; two parameters of another plane have none."""
    forces = xr.Dataset({"force_per_width": (("increment", "plane"), [[1.0, 2.0, 3.0]])})
    write_dataset(forces, tmp_path / "cell.nc", "cell", "digest")
    read = read_dataset(tmp_path / "cell.nc")
    assert read["force_per_width"].sel(plane="wale").item() == 2.0
    section = xr.Dataset({"section_points": (("section_node", "plane"), np.zeros((4, 2)))})
    write_dataset(section, tmp_path / "section.nc", "section", "digest")
    assert "plane" not in read_dataset(tmp_path / "section.nc").coords


def test_a_commit_is_dirty_if_code_has_changed_but_not_if_kept_tables_have(tmp_path):
    for name in ("src/code.py", "resources/kept.csv", "docs/page.md"):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_text("old")
    someone = ("-c", "user.name=a", "-c", "user.email=a@b")
    for command in (("init", "-q"), ("add", "."), (*someone, "commit", "-qm", "first")):
        subprocess.run(["git", *command], cwd=tmp_path, check=True)
    clean = commit_of(tmp_path)
    for name in ("resources/kept.csv", "docs/page.md", "src/another.py"):
        (tmp_path / name).write_text("new")
    assert commit_of(tmp_path) == clean != ""
    (tmp_path / "src/code.py").write_text("new")
    assert commit_of(tmp_path) == f"{clean}-dirty"
