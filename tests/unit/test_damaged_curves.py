"""Measured curves by the commands: files of two results, and damaged files, which get a number or one message."""

import random
import re
import shutil
from time import process_time
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from refusals import READ

from knitstudy.datasets import read_dataset
from knitstudy.errors import KnitstudyError
from knitstudy.run.commands.main import main
from knitstudy.use.commands import curves
from knitstudy.use.measured_curve import read_curve

SEED = 95
SECONDS = 5.0  # of a processor, for one file


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """File of the history of a tied cell, and its geometry."""
    folder = tmp_path_factory.mktemp("runs")
    ended = CliRunner().invoke(main, ["run", "cell-course", "-o", str(folder)])
    assert ended.exit_code == 0, ended.stderr
    (geometry,) = (folder / "geometry").glob("*.nc")
    return SimpleNamespace(file=folder / "simulation" / "cell-course.nc", geometry=read_dataset(geometry))


def test_curves_of_two_results_are_both_written(cell, tmp_path):
    for name in ("soft", "hard"):
        shutil.copy(cell.file, tmp_path / f"{name}.nc")
    files = [str(tmp_path / f"{name}.nc") for name in ("soft", "hard")]
    history = read_dataset(cell.file)
    both = tmp_path / "both.csv"
    ended = CliRunner().invoke(main, ["show", *files, "--curve", str(both), "--decimal", ","])
    assert ended.exit_code == 0, ended.stderr
    table = pd.read_csv(both, sep=";", decimal=",")
    assert table["result"].value_counts().to_dict() == dict.fromkeys(
        ("soft", "hard"), history.sizes["increment"]
    )
    np.testing.assert_allclose(
        table["course force per width [N/m]"], 2 * [*history["force_per_width"].to_numpy()[:, 0]], rtol=1e-11
    )
    # As many digits as the numbers of a unit have beside the largest one: no 0,30000000000000004, no 1,2e-17
    assert max(len(digits) for digits in re.findall(r"(?<=,)\d+", both.read_text())) <= 16
    assert (table["shear strain [1]"] == 0).all()
    np.testing.assert_allclose(
        read_curve(both, {}, {"result": "hard"}, "course"), history["force_per_width"][:, 0], atol=1e-9
    )
    one = tmp_path / "one.csv"
    assert CliRunner().invoke(main, ["show", files[0], "--curve", str(one)]).exit_code == 0
    assert "result" not in pd.read_csv(one)
    for option in (["--keys"], ["--picture", str(tmp_path / "knit.png")]):
        refused = CliRunner().invoke(main, ["show", *files, *option])
        assert refused.exit_code == 2
        assert f"{option[0]} takes one result" in refused.stderr


TOKENS = (
    *("", "nan", "NaN", "inf", "-inf", "1e999", "-1e999", "1e-320", "0", "-0", "1e99", "9" * 400, "1e", "--"),
    *("1,234", "1.234", "1.234,5", "1'000", "1 000", "0x10", "12:30", "٣", "½", "OVERLOAD", '"', '"1', "'"),
    *(
        " " * 3000,
        "(" * 500,
        "[" + " " * 3000,
        "\x00",
        "\x1b[2J",
        "\ufeff",
        "\u202e",
        "😀",
        "=1+1",
        "#",
        ";",
        "\t",
    ),
)
HEADS = (
    "strain (%),force (N/m)",
    "true strain,true stress (MPa)",
    "Stretch ratio,load [ kN ]",
    "strain,force\n%,N/m",
    "strain (" + " " * 3000,
)


def damaged(text, by):
    """Return a text with some damages, of `by` (Random)."""
    lines = text.split("\n")
    for _ in range(by.randint(1, 4)):
        place = by.randrange(len(lines))
        fields = re.split(r"([,;\t])", lines[place])
        other = by.randrange(len(fields))
        match by.randrange(9):
            case 0:
                del lines[place]
            case 1:
                lines.insert(place, lines[by.randrange(len(lines))])
            case 2 | 3:
                fields[other] = by.choice(TOKENS)
                lines[place] = "".join(fields)
            case 4:
                lines[place] = lines[place][: by.randrange(len(lines[place]) + 1)]
            case 5:
                lines = [re.sub("[,;\t]", by.choice(",;\t |"), line) for line in lines]
            case 6:
                lines[place] = by.choice(HEADS)
            case 7:
                lines = lines[:place] + [lines[place]] * by.choice((2, 300)) + lines[place:]
            case 8:
                lines[place] += by.choice(TOKENS) * by.choice((1, 50))
        lines = lines or [""]
    return "\n".join(lines)


def files(count):
    """Yield damaged files and the options that name what is in them."""
    by = random.Random(SEED)
    kinds = [(text, named) for text, named, only in READ["curves"] if not only]
    steps = "\n".join(f"{0.4 * k:.2f},{40 * k}" for k in range(12))
    kinds += [
        (f"strain (%),force (N/m)\n{steps}\n", {}),
        (f"elongation (%),load (N)\n{steps}\n", {"width": 0.05}),
    ]
    for _ in range(count):
        text, named = by.choice(kinds)
        raw = damaged(text, by).encode(by.choice(("utf-8", "utf-8", "utf-16")), "replace")
        if by.random() < 0.1:
            raw = raw[: by.randrange(len(raw) + 1)] + by.randbytes(3)
        yield raw, named | by.choice(({}, {}, {"zero": "first"}, {"zero": "file"}, {"zero": "toe"}))


def answer(path, named, skip_bad):
    """Return the curve of a file, or the message of its refusal."""
    try:
        return read_curve(path, named, {}, "course", skip_bad=skip_bad)
    except KnitstudyError as error:
        return str(error)


def test_damaged_files_are_read_or_refused(tmp_path):
    read = 0
    for raw, named in files(300):
        path = tmp_path / "lab.csv"
        path.write_bytes(raw)
        begin = process_time()
        for skip_bad in (False, True):
            (tmp_path / "lab.columns.yaml").unlink(missing_ok=True)
            curve = answer(path, named, skip_bad)
            if isinstance(curve, str):
                assert curve.startswith(str(path)), raw
                assert "\n" not in curve, raw
                continue
            read += 1
            assert np.isfinite(curve).all(), raw
            assert np.isfinite(curve.index.to_numpy(dtype=float)).all(), raw
            assert curve.abs().max() > 0, raw
        assert process_time() - begin < SECONDS, raw
    assert 60 < read < 540  # neither all damages are refused, nor none


@pytest.mark.parametrize(("command", "count"), [("compare", 24), ("fit", 80)])
def test_commands_end_with_numbers_or_one_message(cell, tmp_path, monkeypatch, command, count):
    history = read_dataset(cell.file)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(curves, "_write", lambda *_: None)  # pictures take most of the time
    monkeypatch.setattr(
        "knitstudy.run.simulations.simulate",
        lambda *_, **__: SimpleNamespace(history=history, geometry=cell.geometry),
    )
    asked = {"compare": ["compare", str(cell.file)], "fit": ["fit", "cell-course"]}[command]
    ends = []
    for raw, named in files(count):
        (tmp_path / "lab.columns.yaml").unlink(missing_ok=True)
        (tmp_path / "lab.csv").write_bytes(raw)
        words = [
            word
            for name, value in named.items()
            for word in (f"--{name}", *(value if isinstance(value, list) else [str(value)]))
        ]
        begin = process_time()
        ended = CliRunner().invoke(main, [*asked, "lab.csv", *words, "--skip-bad"])
        assert process_time() - begin < SECONDS, raw
        assert ended.exit_code in (0, 1), (raw, ended.output)
        assert ended.exception is None or isinstance(ended.exception, SystemExit), raw
        assert "Traceback" not in ended.output
        if ended.exit_code:
            assert ended.stderr.splitlines()[-1].startswith("error: "), raw
        else:
            assert not re.search(r"\b(nan|inf)\b", ended.stdout), (raw, ended.stdout)
        ends.append(ended.exit_code)
    assert {0, 1} == {*ends}
