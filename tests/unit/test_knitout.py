"""Files for knitting machines: repeats, errors of knitting, and operations that are not simulated."""

import sys
from pathlib import Path

import pytest

from knitstudy.errors import ConfigurationError
from knitstudy.geometry.readers import read_fabric
from knitstudy.study.knitout import repeat_of, spacing_of

FILES = Path(__file__).resolve().parents[2] / "examples" / "knitout"
HEAD = ";!knitout-2\n;;Machine: SWG091N2\n;;Gauge: 15\n;;Carriers: 1 2 3 4 5 6 7 8 9 10\n"
NEEDLES = (1, 2, 3, 4)


def row(way, letters):
    """Return the instructions of a pass: k and p knit on the front and the back bed, t tucks there, others miss."""
    needles = NEEDLES if way == "+" else NEEDLES[::-1]
    words = {"k": "knit {} f{} 3", "p": "knit {} b{} 3", "t": "tuck {} f{} 3", ".": "miss {} f{} 3"}
    return [words[letters[needle - 1]].format(way, needle) for needle in needles]


def knitted(path, *instructions):
    """Write a file that casts on with two passes of tucks on four needles and then has these lines."""
    begin = ["inhook 3", "tuck - f4 3", "tuck - f2 3", "tuck + f1 3", "tuck + f3 3", "releasehook 3"]
    path.write_text(HEAD + "\n".join([*begin, *instructions, ""]), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("name", "rows"),
    [
        ("jersey", ("K",)),
        ("rib", ("PK",)),
        ("half_cardigan", ("PK", "TK")),
        ("jacquard", ("K-", "-K")),
        ("cable", ("K>K(", "KK")),
        ("lace", ("K)K", "TK")),
    ],
)
def test_repeats_of_examples(name, rows):
    assert repeat_of(FILES / f"{name}.k") == rows
    assert spacing_of(FILES / f"{name}.k") == pytest.approx(25.4e-3 / 15)


def test_needles_of_both_beds_are_one_wale_where_loops_go_across(tmp_path):
    """Knitted on the front bed, every second loop handed to the back bed and knitted there: a rib, two rows later."""
    across, back = ["xfer f2 b2", "xfer f4 b4"], ["xfer b2 f2", "xfer b4 f4"]
    path = knitted(
        tmp_path / "a.k",
        *row("-", "kkkk"),
        *(across + row("+", "kpkp") + back + row("-", "kkkk")),
        *(across + row("+", "kpkp") + back + row("-", "kkkk")),
        *(across + row("+", "kpkp") + back + row("-", "kkkk")),
    )
    assert repeat_of(path) == ("KK", "KP")


def test_a_piece_without_repeat_is_its_own_repeat(tmp_path):
    path = knitted(tmp_path / "a.k", *row("-", "kkkk"), *row("+", "ktkk"), *row("-", "kkkk"))
    assert repeat_of(path) == ("KKKK", "KTKK", "KKKK")


def test_rows_that_bind_off_do_not_count(tmp_path):
    bound = ["xfer f4 b4", "rack -1", "xfer b4 f3", "rack 0", "knit - f3 3"]
    path = knitted(tmp_path / "a.k", *row("-", "kkkk"), *row("+", "kkkk"), *row("-", "kkkk"), *bound)
    assert repeat_of(path) == ("K",)


@pytest.mark.parametrize(
    ("text", "reason"),
    [("knit - f4 7", "knit - f4 7: .*inactive yarn"), ("knot - f4 3", "knot - f4 3: .*expected")],
)
def test_errors_of_knitting_name_line_and_reason(tmp_path, text, reason):
    path = knitted(tmp_path / "a.k", text)
    number = path.read_text().splitlines().index(text) + 1
    with pytest.raises(
        ConfigurationError, match=rf"a\.k, line {number}: cannot be knitted: {reason}"
    ) as refused:
        repeat_of(path)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("moves", "rows"),
    [
        (["xfer f2 b2", "xfer f3 b3", "rack 1", "xfer b2 f3", "rack -1", "xfer b3 f2"], "KK>K(K KKKK"),
        (["xfer f2 b2", "xfer f3 b3", "rack -1", "xfer b3 f2", "rack 1", "xfer b2 f3"], "KK)K<K KKKK"),
        (["xfer f2 b2", "rack 1", "xfer b2 f3"], "KK)KK KTKK"),
        (["xfer f2 b2", "xfer f3 b3", "rack 1", "xfer b2 f3", "rack 0", "xfer b3 f3"], "KK>KK KTKK"),
    ],
)
def test_loops_that_change_needles_pass_others_as_they_are_handed_over(tmp_path, moves, rows):
    """Of two loops the one that comes back first lies in front: of a cable, and of two loops on one needle."""
    moved = [*moves, "rack 0", *row("+", "kkkk"), *row("-", "kkkk")]
    assert repeat_of(knitted(tmp_path / "a.k", *row("-", "kkkk"), *3 * moved)) == tuple(rows.split())


def test_operations_that_are_not_simulated_are_named_with_their_line(tmp_path):
    away, back = [f"xfer f{n} b{n}" for n in (1, 2, 3)], ["rack 1", "xfer b1 f2", "rack -2", "xfer b3 f1"]
    both = [*away, *back, "rack 1", "xfer b2 f3", "rack 0", *row("+", "kkkk")]
    with pytest.raises(
        ConfigurationError, match="needle f3 in row 3 passes in front of one loop and behind another"
    ):
        repeat_of(knitted(tmp_path / "a.k", *row("-", "kkkk"), *both))
    with pytest.raises(ConfigurationError, match="nothing is a stitch"):
        repeat_of(knitted(tmp_path / "a.k"))
    with pytest.raises(ConfigurationError, match="there is no such file"):
        repeat_of(tmp_path / "b.k")


def test_without_the_package_the_message_names_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "knitout_interpreter.run_knitout", None)
    with pytest.raises(ConfigurationError, match=r"pip install 'knitstudy\[machine\]'"):
        repeat_of(FILES / "rib.k")


def test_a_scene_takes_stitches_and_size_from_a_file(plain_scene):
    cell = {"specimen": "cell", "fidelity": "beam", "interaction": "isotropic"}
    scene = plain_scene.vary(cell | {"pattern.knitout": str(FILES / "half_cardigan.k")})
    assert (scene.pattern.stitches, scene.pattern.loops, scene.pattern.rows) == (("PK", "TK"), 2, 2)
    cable = plain_scene.vary(cell | {"pattern.knitout": str(FILES / "cable.k")})
    assert (cable.pattern.loops, cable.pattern.rows) == (2, 2), "marks are no loops"
    with pytest.raises(ConfigurationError, match="say the same"):
        plain_scene.vary({"pattern.knitout": str(FILES / "rib.k"), "pattern.stitches": ["KP"]})


@pytest.mark.parametrize("name", ["rib", "half_cardigan"])
def test_a_file_is_a_fabric(name):
    """At the gauge of its machine, a cell of one repeat."""
    fabric = read_fabric(FILES / f"{name}.k")
    assert fabric.specimen == "cell"
    assert fabric.width == pytest.approx(2 * 25.4e-3 / 15)


def test_a_file_without_gauge_is_no_fabric(tmp_path):
    path = tmp_path / "a.k"
    path.write_text((FILES / "rib.k").read_text().replace(";;Gauge: 15\n", ""))
    with pytest.raises(ConfigurationError, match="names no ;;Gauge:"):
        read_fabric(path)
