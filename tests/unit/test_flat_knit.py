"""Machine files of pieces that are no endless flat fabric, each kind beside a fabric like it that must be read."""

import random
import time

import pytest
from refusals import refusal

from knitstudy.knit.scene.knitout import read_repeat, repeat_of
from knitstudy.knit.scene.knitting_machine import Machine

HEAD = ";!knitout-2\n;;Machine: SWG091N2\n;;Gauge: 15\n;;Carriers: 1 2 3 4 5 6\n"
WIDE = 12
FRONT, BACK = [f"f{n}" for n in range(1, WIDE + 1)], [f"b{n}" for n in range(1, WIDE + 1)]
RIB = [f"{'fb'[n % 2]}{n}" for n in range(1, WIDE + 1)]
SHIFTED = [f"{'bf'[n % 2]}{n}" for n in range(1, WIDE + 1)]
BOTH = [needle for pair in zip(FRONT, BACK, strict=True) for needle in pair]


def along(way, needles, carrier="3", made="knit"):
    """Return the instructions of a pass over needles, which are in order from left to right."""
    return [f"{made} {way} {needle} {carrier}" for needle in needles[:: 1 if way == "+" else -1]]


def turns(needles, passes, begun=0):
    """Return passes to and fro."""
    return [line for number in range(begun, begun + passes) for line in along("-+"[number % 2], needles)]


def tucked(needles=FRONT):
    """Return a cast-on with tucks on every second needle in two passes."""
    return along("-", needles[1::2], made="tuck") + along("+", needles[::2], made="tuck")


def across(needles, to):
    return [f"xfer {needle} {to}{needle[1:]}" for needle in needles if needle[0] != to]


def file(path, lines):
    path.write_text(HEAD + "\n".join(["inhook 3", *lines, ""]), encoding="utf-8")
    return path


def half_gauge_tube(front, back, rounds=8):
    """Return a tube on every second needle, whose layers have these beds by round and needle.

    The front layer has the even numbers. A layer that does not knit lies on its own bed.
    """
    lines = along("-", FRONT[1::2], made="tuck") + along("+", BACK[::2], made="tuck")
    for number in range(rounds):
        beds = [front(number, at) for at in range(WIDE // 2)]
        needles = [f"{bed}{2 * at + 2}" for at, bed in enumerate(beds)]
        lines += [f"xfer f{n[1:]} {n}" for n in needles if n[0] == "b"]
        lines += along("-", needles) + [f"xfer {n} f{n[1:]}" for n in needles if n[0] == "b"]
        beds = [back(number, at) for at in range(WIDE // 2)]
        needles = [f"{bed}{2 * at + 1}" for at, bed in enumerate(beds)]
        lines += [f"xfer b{n[1:]} {n}" for n in needles if n[0] == "f"]
        lines += along("+", needles) + [f"xfer {n} b{n[1:]}" for n in needles if n[0] == "f"]
    return lines


CHANCE = random.Random(0)
JERSEY = tucked() + turns(FRONT, 2)
SPLIT = [f"xfer f{n} b{n}" for n in range(1, WIDE + 1, 2)]
ROUND = along("-", FRONT[1::2]) + along("+", BACK[::2])
MILANO = along("+", BOTH) + along("-", FRONT) + along("+", BACK)
MILANO += along("-", BOTH) + along("+", FRONT) + along("-", BACK)
EIGHT = [needle for n in range(1, WIDE, 4) for needle in (f"f{n}", f"f{n + 1}", f"b{n + 2}", f"b{n + 3}")]
OTHERS = [f"{'fb'[needle[0] == 'f']}{needle[1:]}" for needle in EIGHT]

TUBES = {
    "full gauge": along("-", FRONT, made="tuck")
    + along("+", BACK, made="tuck")
    + 8 * (along("-", FRONT) + along("+", BACK)),
    "half gauge": half_gauge_tube(lambda *at: "f", lambda *at: "b"),
    "rib in the layers": half_gauge_tube(lambda row, at: "fb"[at % 2], lambda row, at: "bf"[at % 2]),
    "garter in one layer": half_gauge_tube(lambda row, at: "fb"[row % 2], lambda *at: "b"),
    "a picture in the layers": half_gauge_tube(
        lambda *at: CHANCE.choice("fb"), lambda *at: CHANCE.choice("fb")
    ),
    "jersey that is split": [*JERSEY, *SPLIT, *(8 * ROUND)],
    "a rib below, as high": [*JERSEY, *SPLIT, *turns(RIB, 12), *(6 * ROUND)],
    "two yarns": [
        *along("-", FRONT, made="tuck"),
        "inhook 4",
        *along("-", BACK, "4", "tuck"),
        *(4 * [*along("+", FRONT), *along("+", BACK, "4"), *along("-", FRONT), *along("-", BACK, "4")]),
    ],
    "edges that are knitted together": [
        *along("-", FRONT, made="tuck"),
        *along("+", BACK, made="tuck"),
        *(8 * [*along("-", ["b1", *FRONT]), *along("+", [*BACK[1:], f"f{WIDE}"])]),
    ],
}


@pytest.mark.parametrize("lines", TUBES.values(), ids=TUBES)
def test_two_layers_are_named(tmp_path, lines):
    with refusal("a tube or a pocket, two layers"):
        repeat_of(file(tmp_path / "a.k", lines))


ONE_LAYER = {
    "interlock": (8 * (along("-", RIB) + along("+", SHIFTED)), 2),
    "interlock of two and two": (8 * (along("-", EIGHT) + along("+", OTHERS)), 2),
    "Milano rib": ([*JERSEY, *along("-", FRONT), "rack 0.25", *(6 * MILANO)], 3),
    "every second needle in turn": (tucked() + 8 * (along("-", FRONT[1::2]) + along("+", FRONT[::2])), 2),
    "pockets that a rib joins": ([*JERSEY, *SPLIT, *(6 * [*turns(RIB, 2), *(2 * ROUND)])], 6),
    "half gauge": (along("-", FRONT[1::2], made="tuck") + turns(FRONT[1::2], 8, 1), 1),
}


@pytest.mark.parametrize(("lines", "rows"), ONE_LAYER.values(), ids=ONE_LAYER)
def test_one_layer_whose_passes_take_turns_is_read(tmp_path, lines, rows):
    assert len(repeat_of(file(tmp_path / "a.k", lines))) == rows


def picture(rows=6):
    """Return rows of knit and purl stitches that do not repeat themselves, and their letters."""
    chance, before, lines, letters = random.Random(3), FRONT, [], []
    for number in range(rows):
        needles = [f"{chance.choice('ffb')}{n}" for n in range(1, WIDE + 1)]
        lines += [f"xfer {one} {other}" for one, other in zip(before, needles, strict=True) if one != other]
        lines += along("-+"[number % 2], needles)
        letters.append("".join("KP"[needle[0] == "b"] for needle in needles))
        before = needles
    return lines, tuple(letters)


ROUNDS = {
    "one of tucks": tucked(),
    "two of tucks": 2 * tucked(),
    "tucks and loops in turn": [*tucked(), *along("-", FRONT[1::2]), *along("+", FRONT[::2])],
    "two of tucks, one of loops": [*tucked(), *tucked(), *along("-", FRONT[1::2]), *along("+", FRONT[::2])],
}


@pytest.mark.parametrize("rounds", ROUNDS.values(), ids=ROUNDS)
def test_rounds_of_a_cast_on_are_no_fabric(tmp_path, rounds):
    """A picture is its own repeat, so that a row of the cast-on would become one of the endless fabric."""
    lines, letters = picture()
    assert repeat_of(file(tmp_path / "a.k", rounds + lines)) == letters


@pytest.mark.parametrize("way", ["+", "-"])
def test_a_picture_is_read_to_where_it_is_bound_off(tmp_path, way):
    """Loop after loop is handed to its neighbour and drawn off with it, all in one direction."""
    lines, letters = picture(6 if way == "-" else 5)
    by = 1 if way == "+" else -1
    needles = range(1, WIDE) if way == "+" else range(WIDE, 1, -1)
    last = ["b" if letter == "P" else "f" for letter in letters[-1]]
    bound = [f"xfer b{n} f{n}" for n in range(1, WIDE + 1) if last[n - 1] == "b"]
    for n in needles:
        bound += [
            f"xfer f{n} b{n}",
            f"rack {by}",
            f"xfer b{n} f{n + by}",
            "rack 0",
            f"knit {way} f{n + by} 3",
        ]
    assert repeat_of(file(tmp_path / "a.k", tucked() + lines + bound)) == letters


def narrowing(steps, drop=False):
    """Return rows that become a needle narrower on the left, whose loop is handed to its neighbour or left alone."""
    lines = []
    for step in range(1, steps + 1):
        lines += [] if drop else [f"xfer f{step} b{step}", "rack 1", f"xfer b{step} f{step + 1}", "rack 0"]
        lines += along("+-"[step % 2], FRONT[step:])
    return lines


def widening(steps):
    lines = along("-", FRONT[5:7], made="tuck")
    for step in range(steps):
        lines += [*along("+", FRONT[5 - step : 7 + step]), f"tuck + f{8 + step} 3"]
        lines += [*along("-", FRONT[5 - step : 8 + step]), f"tuck - f{5 - step} 3"]
    return lines


SHAPES = {
    "a triangle": (JERSEY + narrowing(WIDE - 2), "is not an endless fabric"),
    "a triangle of short rows": (JERSEY + narrowing(WIDE - 2, drop=True), "is not an endless fabric"),
    "a triangle that grows": (widening(5), "the piece becomes wider"),
    "a cord": (along("+", FRONT[:4], made="tuck") + 8 * along("+", FRONT[:4]), "a cord or a tube"),
    "a cord of two needles": (
        along("+", FRONT[:2], made="tuck") + 8 * along("+", FRONT[:2]),
        "a cord or a tube",
    ),
    "a chain": (["tuck + f1 3", *turns(["f1"], 8)], "on one needle: a chain"),
}


@pytest.mark.parametrize(("lines", "shape"), SHAPES.values(), ids=SHAPES)
def test_shapes_that_do_not_repeat_themselves_are_named(tmp_path, lines, shape):
    with refusal(shape) as refused:
        repeat_of(file(tmp_path / "a.k", lines))
    assert len(str(refused.value)) < 500, "no pages of letters"


@pytest.mark.parametrize("steps", [1, 2])
def test_a_panel_that_becomes_a_little_narrower_is_read(tmp_path, steps):
    lines = JERSEY + turns(FRONT, 10) + narrowing(steps) + turns(FRONT[steps:], 10, steps)
    assert repeat_of(file(tmp_path / "a.k", lines)) == ("K",)


def test_needles_that_begin_in_the_last_row_are_left_out(tmp_path):
    lines = tucked(FRONT[1:]) + turns(FRONT[1:], 9) + ["tuck + f1 3"]
    repeat = read_repeat(file(tmp_path / "a.k", lines))
    assert (repeat.stitches, repeat.needles[1]) == (("K",), f"f{WIDE}")


def test_yarns_above_each_other_are_named_and_one_is_chosen(tmp_path):
    """Waste yarn on needles of its own, and a 2 x 2 rib: the rows that the message names are read."""
    rib = [f"{'ffbb'[n % 4]}{n}" for n in range(1, WIDE + 1)]
    lines = [*along("-", BOTH, made="tuck"), *along("+", BACK[::3]), *along("-", FRONT), *along("+", FRONT)]
    lines += [
        "inhook 5",
        *along("-", FRONT, "5"),
        "inhook 4",
        *along("+", FRONT, "4"),
        *along("-", FRONT, "4"),
    ]
    lines += [f"xfer f{n[1:]} {n}" for n in rib if n[0] == "b"]
    lines += [line.replace(" 3", " 4") for line in turns(rib, 5, 1)]
    path = file(tmp_path / "a.k", lines)
    with refusal(
        r"rows 2 to 4 of carrier 3, rows 5 to 5 of carrier 5, rows 6 to 12 of carrier 4.*: \[6, 12\]"
    ):
        repeat_of(path)


BOUNDS = {
    "a rack of many needles": (["rack 100000000"], "line 41: .* allowed are racks by 100 needles"),
    "a rack of many digits": (["rack " + "9" * 400], "line 41: .* allowed are racks"),
    "a needle of many digits": (
        ["knit - f" + "9" * 5000 + " 3"],
        "line 41: .*not a needle of a bed; allowed are 4 digits",
    ),
    "digits of another script": (["knit - f١ 3"], "line 41: .* is not a needle"),
    "a stack of loops": (200 * ["tuck - f1 3", "tuck + f1 3"], "100 loops on one needle"),
    "loops that a split adds": (200 * ["split + f1 b1 3", "xfer b1 f1"], "100 loops on one needle"),
    "a pass for every loop": (
        [f"tuck {'+-'[n % 2]} f{n} 3" for n in range(100, 3000)],
        "2935 loops in 2903 passes over 2912 needles; allowed are 4000000 places",
    ),
    "racks past many loops": (
        [
            *across(FRONT, "b"),
            *along("-", FRONT, made="tuck"),
            *(3000 * ["rack 99", "tuck + f1 3", "drop f1", "rack -99"]),
        ],
        "racked past more than 5000000",
    ),
}


@pytest.mark.parametrize(("lines", "reason"), BOUNDS.values(), ids=BOUNDS)
def test_numbers_that_no_machine_has_are_refused_at_once(tmp_path, lines, reason):
    path, begun = file(tmp_path / "a.k", JERSEY[:-1] + lines), time.process_time()
    with refusal(reason) as refused:
        repeat_of(path)
    assert time.process_time() - begun < 8
    assert len(str(refused.value)) < 500


@pytest.mark.parametrize("by", ["100", "-100", "0.25", "+.5", "3."])
def test_racks_of_a_machine_are_knitted(tmp_path, by):
    assert Machine.of_file(file(tmp_path / "a.k", [*JERSEY, f"rack {by}"])).rack == float(by)


def test_terminal_escapes_of_a_file_are_written_out(tmp_path, caplog):
    escape = "\x1b[31m"
    lines = [
        f"x-{escape} 5",
        f"inhook 4{escape}",
        *JERSEY,
        *(line + escape for line in along("-", FRONT, "4")),
    ]
    lines += turns(FRONT, 6)
    path = tmp_path / f"a{escape}.k"
    repeat_of(file(path, lines))
    assert "x-\\x1b[31m" in caplog.text
    assert "carriers 3 and 4\\x1b" in caplog.text
    assert "\x1b" not in "".join(record.getMessage() for record in caplog.records)
    with refusal(r"\\x1b") as refused:
        repeat_of(file(path, [f"knot{escape} + f1 3"]))
    assert str(refused.value).isprintable()


@pytest.mark.parametrize("stitches", [["K>K", "KK"], ["K)K", "KK"]])
def test_letters_whose_needles_run_empty_are_refused_in_a_scene(plain_scene, stitches):
    cell = {"specimen": "cell", "fidelity": "beam", "interaction": "isotropic"}
    with refusal("has no loop to be drawn through: on an empty needle it is a tuck"):
        plain_scene.vary(cell | {"pattern.stitches": stitches, "pattern.loops": 2, "pattern.rows": 2})
    refilled = [stitches[0], "TK"]
    assert plain_scene.vary(
        cell | {"pattern.stitches": refilled, "pattern.loops": 2, "pattern.rows": 2}
    ).pattern.stitches == tuple(refilled)
