"""Files for knitting machines: repeats, errors of knitting, and operations that are not simulated."""

import re
from pathlib import Path

import pytest
from refusals import READ, REFUSED, refusal

from knitstudy.knit.geometry.readers import read_fabric
from knitstudy.knit.scene.knitout import read_repeat, repeat_of
from knitstudy.knit.scene.stitches import parents_of_letters

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


@pytest.mark.parametrize(("name", "rows"), READ["repeats"])
def test_repeats_of_examples(name, rows):
    assert repeat_of(FILES / f"{name}.k") == tuple(rows)
    assert read_repeat(FILES / f"{name}.k").wale_spacing == pytest.approx(25.4e-3 / 15)


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


@pytest.mark.parametrize(("moves", "rows"), READ["moves"])
def test_loops_that_change_needles_pass_others_as_they_are_handed_over(tmp_path, moves, rows):
    """Of two loops the one that comes back first lies in front: of a cable, and of two loops on one needle."""
    moved = [*moves, "rack 0", *row("+", "kkkk"), *row("-", "kkkk")]
    assert repeat_of(knitted(tmp_path / "a.k", *row("-", "kkkk"), *3 * moved)) == tuple(rows.split())


def piece(path, rows, more=(), carrier="3"):
    """Write a file that casts on and knits rows of K and P, handing loops across beds, and then has these lines."""
    count = len(rows[0])
    lines = [f"inhook {carrier}", *(f"tuck - f{n} {carrier}" for n in range(count, 0, -1) if n % 2 == 0)]
    lines += [f"tuck + f{n} {carrier}" for n in range(1, count + 1) if n % 2]
    before = "K" * count
    for number, row in enumerate(rows):
        way = "-+"[number % 2]
        needles = range(1, count + 1) if way == "+" else range(count, 0, -1)
        bed = {needle: "fb"["KP".index(row[needle - 1])] for needle in needles}
        for needle in needles:
            if row[needle - 1] != before[needle - 1]:
                lines.append(f"xfer {'fb'['KP'.index(before[needle - 1])]}{needle} {bed[needle]}{needle}")
        lines += [f"knit {way} {bed[needle]}{needle} {carrier}" for needle in needles]
        before = row
    path.write_text(HEAD + "\n".join([*lines, *more, ""]), encoding="utf-8")
    return path


PLAIN = ["KKKK"] * 6


@pytest.mark.parametrize(("name", "old", "new"), READ["knitout"])
def test_what_the_format_allows_is_read(tmp_path, name, old, new):
    path = piece(tmp_path / "a.k", PLAIN)
    path.write_bytes(path.read_text().replace(old.format(HEAD=HEAD), new.format(HEAD=HEAD)).encode())
    assert repeat_of(path) == ("K",)


@pytest.mark.parametrize("encoding", ["latin-1", "utf-16"])
def test_comments_of_any_encoding(tmp_path, encoding):
    path = piece(tmp_path / "a.k", PLAIN)
    path.write_bytes((path.read_text() + "; naturweiß\n").encode(encoding))
    assert repeat_of(path) == ("K",)


def test_needles_may_be_negative(tmp_path):
    path = piece(tmp_path / "a.k", PLAIN)
    path.write_text(re.sub(r" f(\d)", lambda found: f" f{int(found[1]) - 3}", path.read_text()))
    assert read_repeat(path).needles == ("f-2", "f1")


def shifted(rows, share):
    """Return instructions that knit every needle of both beds, racked by a share of a needle."""
    lines = [f"rack {share}"]
    for number in range(rows):
        order = [f"{bed}{n}" for n in NEEDLES for bed in "fb"]
        lines += [
            f"knit {'+-'[number % 2]} {needle} 3" for needle in (order if number % 2 == 0 else order[::-1])
        ]
    return lines


@pytest.mark.parametrize("share", ["0.5", "0.25", "+.5"])
def test_needles_of_both_beds_halve_the_spacing(tmp_path, share):
    """A half rack puts the needles of the back bed between those of the front bed."""
    path = knitted(tmp_path / "a.k", *row("-", "kkkk"), *shifted(6, share))
    repeat = read_repeat(path)
    assert repeat.stitches in (("KP",), ("PK",))
    assert 2 * repeat.wale_spacing == pytest.approx(25.4e-3 / 15)
    assert read_fabric(path).width == pytest.approx(25.4e-3 / 15)


def test_every_second_needle_doubles_the_spacing(tmp_path):
    path = piece(tmp_path / "a.k", PLAIN)
    path.write_text(re.sub(r" f(\d)", lambda found: f" f{2 * int(found[1])}", path.read_text()))
    assert read_fabric(path).width == pytest.approx(2 * 25.4e-3 / 15)


def along(way, first, last, carrier="3", bed="f"):
    """Return the instructions of a pass over needles."""
    return [f"knit {way} {bed}{n} {carrier}" for n in range(first, last + 1)][:: 1 if way == "+" else -1]


ACROSS, BACK = along("+", 1, 8), along("-", 1, 8)
MOVED = ["xfer f5 b5", "rack 1", "xfer b5 f6", "rack 0"]
NO_LETTERS = {
    "split": (
        3 * ["split + f1 b1 3", *along("+", 2, 3), "split + f4 b4 3", *along("+", 5, 8), *BACK],
        "split",
    ),
    "plating": (["inhook 4", *(f"{line} 4" for line in 2 * (ACROSS + BACK))], "plating: .* 3 and 4"),
    "drop": (3 * ["drop f2", "drop f5", "drop f7", *ACROSS, *BACK], "drop"),
    "tube": (3 * [*along("+", 1, 8, bed="b"), *BACK], "a tube or a pocket"),
    "intarsia": (
        3
        * [*along("+", 1, 4), *along("-", 1, 4), "inhook 4", *along("-", 5, 8, "4"), *along("+", 5, 8, "4")],
        "carrier 3: needles 1 to 8, carrier 4: needles 5 to 8",
    ),
    "short rows": (
        3 * [*along("+", 1, 4), *along("-", 1, 4), *ACROSS, *BACK],
        "no turn at an edge of the knit",
    ),
    "cord": (5 * ACROSS, "leads from needle f8 .* to f1"),
    "tuck and knit": (
        3 * [*along("+", 1, 3), "tuck + f4 3", *along("+", 4, 8), *BACK],
        "two loops on one needle in one pass",
    ),
    "held loop": (
        3 * [*along("+", 1, 4), *along("+", 6, 8), *MOVED, *BACK, *ACROSS, *BACK],
        "stitch letters cannot express that a held loop moves",
    ),
}


@pytest.mark.parametrize(("lines", "reason"), NO_LETTERS.values(), ids=NO_LETTERS)
def test_what_no_letter_says_is_refused_with_its_line(tmp_path, lines, reason):
    with refusal(reason) as refused:
        repeat_of(piece(tmp_path / "a.k", ["K" * 8], lines))
    assert re.search(r"a\.k, line \d+: ", str(refused.value))


SEED = ["KPKPKPKP", "PKPKPKPK"] * 6


def test_the_body_is_the_largest_part_that_repeats_itself(tmp_path, caplog):
    """Seed stitch in a border of plain loops on all sides, as swatches have: not the last rows."""
    framed = ["K" * 12] * 3 + [f"KK{row}KK" for row in SEED] + ["K" * 12] * 3
    repeat = read_repeat(piece(tmp_path / "a.k", framed))
    assert repeat.stitches in (("KP", "PK"), ("PK", "KP"))
    assert (repeat.rows, repeat.needles) == ((6, 17), ("f3", "f10"))
    assert "rows 6 to 17 of 20, needles f3 to f10 of f1 to f12" in caplog.text


def test_a_picture_is_not_its_plain_rows(tmp_path):
    picture = ["KKKKKK", "KKPPKK", "KPKKPK", "KPPKPK", "KKPPKK", "KKKKKK", "KKKKKK"]
    assert repeat_of(piece(tmp_path / "a.k", picture)) == tuple(picture)


PASSED = ["xfer f1 b1", "xfer f2 b2", "xfer f3 b3", "rack 1", "xfer b1 f2", "rack -2", "xfer b3 f1"]
PASSED += ["rack 1", "xfer b2 f3", "rack 0", *row("+", "kkkk")]
WRONG = {
    "inactive yarn": (["knit - f4 7"], r"a\.k, line 11: cannot be knitted: knit - f4 7: .*inactive yarn"),
    "no instruction": (["knot - f4 3"], r"a\.k, line 11: cannot be knitted: knot - f4 3: .*expected"),
    "both sides": ([*row("-", "kkkk"), *PASSED], "needle f3 in row 3 passes in front of one loop and behind"),
    "no stitch": ([], "nothing is a stitch"),
}


@pytest.mark.parametrize(("lines", "reason"), WRONG.values(), ids=WRONG)
def test_what_cannot_be_knitted_or_simulated_is_named(tmp_path, lines, reason):
    with refusal(reason):
        repeat_of(knitted(tmp_path / "a.k", *lines))


@pytest.mark.parametrize(("text", "reason"), REFUSED["knitout"])
def test_files_without_gauge_or_stitches(tmp_path, text, reason):
    """HEAD are the first lines of a file; BEGIN and RIB are what a file of a rib has before and after its gauge."""
    path, rib = tmp_path / "a.k", (FILES / "rib.k").read_text().partition(";;Gauge: 15\n")
    if text is not None:
        path.write_text(text.format(HEAD=HEAD, BEGIN=rib[0], RIB=rib[2]))
    with refusal(reason):
        read_fabric(path)


def test_rows_of_waste_yarn_are_questioned_and_chosen(tmp_path):
    waste = [
        "inhook 5",
        *(f"knit {way} f{n} 5" for way, of in (("-", NEEDLES[::-1]), ("+", NEEDLES)) for n in of),
    ]
    path = piece(tmp_path / "a.k", ["KKKK"] + ["KKKK", "PPPP"] * 5 + ["KKKK"], waste)
    with refusal(r"rows \d+ to \d+ are of carrier 3.* of carrier 5.*knitout_rows: \["):
        repeat_of(path)
    assert repeat_of(path, rows=(4, 13)) == ("K", "P")
    assert repeat_of(path, rows=(4, 13), needles=(2, 3)) == ("K", "P")
    with refusal("hold no loops; it has rows 1 to 16 and needles f1 to f4"):
        repeat_of(path, needles=(7, 9))


def test_yarns_that_take_over_inside_a_row_are_one(tmp_path, caplog):
    """Carrier 3 ends in the middle of a row, and carrier 4 goes on from there."""
    rest = ["knit - f4 3", "knit - f3 3", "outhook 3", "inhook 4", "knit - f2 4", "knit - f1 4"]
    plain = [*row("+", "kkkk"), *row("-", "kkkk")]
    after = [re.sub("3$", "4", line) for line in 2 * plain]
    path = knitted(tmp_path / "a.k", *row("-", "kkkk"), *row("+", "kkkk"), *rest, *after)
    assert repeat_of(path) == ("K",)
    assert "carriers 3 and 4 are taken as one yarn" in caplog.text


def test_letters_say_which_loops_each_is_drawn_through():
    """A half cardigan: the knit stitch over a tuck is drawn through the tuck and the loop below it."""
    parents = parents_of_letters(("KP", "KT"))
    assert parents == {(0, 0): {(1, 0)}, (0, 1): {(1, 0), (2, 0)}, (1, 0): {(1, 0)}}
    assert parents_of_letters(("K>K(", "KK"))[1, 1] == {(1, 1)}


def test_a_scene_takes_stitches_and_size_from_a_file(plain_scene):
    cell = {"specimen": "cell", "fidelity": "beam", "interaction": "isotropic"}
    scene = plain_scene.vary(cell | {"pattern.knitout": str(FILES / "half_cardigan.k")})
    assert (scene.pattern.stitches, scene.pattern.loops, scene.pattern.rows) == (("PK", "TK"), 2, 2)
    cable = plain_scene.vary(cell | {"pattern.knitout": str(FILES / "cable.k")})
    assert (cable.pattern.loops, cable.pattern.rows) == (2, 2), "marks are no loops"
    with refusal("conflict: set only one"):
        plain_scene.vary({"pattern.knitout": str(FILES / "rib.k"), "pattern.stitches": ["KP"]})


@pytest.mark.parametrize("name", ["rib", "half_cardigan"])
def test_a_file_is_a_fabric(name):
    """At the gauge of its machine, a cell of one repeat."""
    fabric = read_fabric(FILES / f"{name}.k")
    assert fabric.specimen == "cell"
    assert fabric.width == pytest.approx(2 * 25.4e-3 / 15)


def test_a_scene_takes_a_part_of_a_file(plain_scene):
    cell = {"specimen": "cell", "fidelity": "beam", "interaction": "isotropic"}
    keys = cell | {"pattern.knitout": str(FILES / "half_cardigan.k"), "pattern.knitout_rows": [3, 6]}
    assert plain_scene.vary(keys).pattern.stitches == ("PK", "TK")
    with refusal("must be the first and the last one"):
        plain_scene.vary(keys | {"pattern.knitout_rows": [6, 3]})


def test_a_part_whose_needles_are_idle_is_named(tmp_path):
    passes = [(0, 1, 2), (2, 1, 0), *[(1, 2), (2, 1)] * 4, (0, 1, 2)]
    lines = [f"knit {'+-'[number % 2]} f{n} 1" for number, each in enumerate(passes) for n in each]
    with refusal("read as - from here on: needle f0 never knits"):
        repeat_of(knitted(tmp_path / "a.k", "inhook 1", *lines), rows=(6, 9), needles=(0, 0))
