"""Machine files that are damaged and made up: each is read or refused with one message, and none takes long."""

import random
import time

import pytest

from knitstudy.errors import KnitstudyError
from knitstudy.knit.geometry.stitch_mesh import stitches_of
from knitstudy.knit.scene.knitout import read_repeat
from knitstudy.knit.scene.stitches import MARKS, wrong_stitches

HEAD = ";!knitout-2\n;;Machine: SWG091N2\n;;Gauge: 15\n;;Carriers: 1 2 3 4 5 6\n"
LONGEST = 10.0  # CPU time of one file [s]
FILES, BATCHES = 200, 8

WORDS = [
    "knit",
    "tuck",
    "miss",
    "split",
    "xfer",
    "drop",
    "rack",
    "in",
    "out",
    "inhook",
    "outhook",
    "releasehook",
]
WORDS += [
    "x-speed",
    "pause",
    "stitch",
    "amiss",
    "+",
    "-",
    "3",
    "4",
    ";",
    ";;Gauge: 15",
    "\x1b[31m",
    "\0",
    "١",
    "f",
    "b",
]
NUMBERS = ["0", "1", "-1", "0.25", "1e9", "nan", "inf", "9" * 30, "9" * 5000, "-0", "00001", "100000000"]


def knit(chance):
    """Return the lines of a piece of one of many kinds: its cast-on, its beds, racks, yarns and passes by chance."""
    wide, rows = chance.randint(1, 14), chance.randint(0, 14)
    lines = ["inhook 3", "inhook 4"]
    lines += [f"tuck {'-+'[n % 2]} f{n} 3" for n in sorted(range(1, wide + 1), key=lambda n: (n % 2, n))]
    beds = dict.fromkeys(range(1, wide + 1), "f")
    for row in range(rows):
        way = "-+"[row % 2] if chance.random() < 0.9 else chance.choice("-+")
        needles = range(1, wide + 1)[:: chance.choice((1, 1, 1, 2))]
        if chance.random() < 0.3:
            moved = chance.choice(needles)
            beds[moved], before = chance.choice("fb"), beds[moved]
            if before != beds[moved]:
                lines += ["rack 0", f"xfer {before}{moved} {beds[moved]}{moved}"]
        if chance.random() < 0.2:
            lines.append(f"rack {chance.choice((0, 1, -2, 0.25, 0.5))}")
        carrier = chance.choice("3334")
        for needle in needles if way == "+" else needles[::-1]:
            made = chance.choices(("knit", "tuck", "miss", "drop"), (30, 2, 2, 0.2))[0]
            bed = beds[needle] if chance.random() < 0.97 else chance.choice("fb")
            lines.append(f"drop {bed}{needle}" if made == "drop" else f"{made} {way} {bed}{needle} {carrier}")
    return lines


def damaged(lines, chance):
    """Return lines of which some are changed, repeated, moved or made up."""
    for _ in range(chance.choice((0, 1, 1, 2, 20))):
        at = chance.randrange(len(lines))
        words = lines[at].split(" ")
        match chance.randrange(6):
            case 0:
                words[chance.randrange(len(words))] = chance.choice(WORDS + NUMBERS)
                lines[at] = " ".join(words)
            case 1:
                lines[at] = f"rack {chance.choice(NUMBERS)}"
            case 2:
                lines[at] = f"knit {chance.choice('+-')} {chance.choice('fb')}{chance.choice(NUMBERS)} 3"
            case 3:
                lines[at:at] = lines[at : at + chance.randint(1, 9)] * chance.choice((1, 2, 300))
            case 4:
                del lines[at : at + chance.randint(1, 9)]
            case _:
                lines.insert(at, " ".join(chance.choices(WORDS + NUMBERS, k=chance.randint(1, 6))))
        lines = lines or ["inhook 3"]
    return lines


def bytes_of(lines, chance):
    """Return the bytes of a file, which may be cut off, in another encoding, or have bytes of their own."""
    text = (HEAD + "\n".join(lines)).encode(chance.choice(("utf-8", "utf-8", "utf-8", "utf-16", "utf-8-sig")))
    if chance.random() < 0.1:
        text = text[: chance.randrange(len(text))]
    if chance.random() < 0.1:
        at = chance.randrange(len(text) + 1)
        text = text[:at] + chance.randbytes(chance.randint(1, 40)) + text[at:]
    return text


@pytest.mark.parametrize("seed", range(BATCHES))
def test_every_file_is_read_or_refused(tmp_path, seed, caplog):
    chance, read = random.Random(seed), 0
    for number in range(FILES):
        path = tmp_path / f"{number}.k"
        path.write_bytes(bytes_of(damaged(knit(chance), chance), chance))
        part = (chance.choice((None, None, (2, 9))), chance.choice((None, None, (2, 5))))
        begun = time.process_time()
        try:
            assert wrong_stitches(read_repeat(path, *part).stitches) is None
            read += 1
        except KnitstudyError as refused:
            text = str(refused)
            assert text.isprintable(), f"{path}: {text!r}"
            assert len(text) < 1000, f"{path}: {text[:2000]}"
        assert time.process_time() - begun < LONGEST, path
        assert all(record.getMessage().isprintable() for record in caplog.records)
    assert read, "some files are sound, so that the reading is tried as well"


def test_letters_are_refused_where_they_cannot_be_drawn():
    """Letters by chance: what is wrong in them is said of a scene or a file, and not only as its loops are drawn."""
    chance, drawn = random.Random(0), 0
    for _ in range(3000):
        wide, marks = chance.randint(1, 3), ["", "", "", "", *MARKS, ">>", "><"]
        stitches = [[chance.choice("KKKPT-X") + chance.choice(marks) for _ in range(wide)] for _ in range(2)]
        letters = tuple(map("".join, stitches))
        wrong = wrong_stitches(letters)
        try:
            stitches_of(letters)
        except (KnitstudyError, LookupError):
            assert wrong, letters
        drawn += not wrong
    assert drawn > 100
