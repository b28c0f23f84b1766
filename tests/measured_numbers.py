"""Numbers in texts that may be measured ones: they belong into tables, and texts take them from there."""

import re

REFERENCE = re.compile(r"(?:Figs?|Tables?|Eqs?|section|Section)[. ]*\(?\d[\d.]*\)?(?: ?\([a-z]\))?")
NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?!\w)")
UNIT = re.compile(r" ?(?:%|°|[munk]?m\b|R\b|d\b|k?N\b|[kMG]B\b|degrees|times|of \d+)")


def measured_numbers(text):
    """Return the decimals of a text, and its numbers with their unit; references to the paper have none."""
    text = REFERENCE.sub("", text)
    units = ((match[0], UNIT.match(text, match.end())) for match in NUMBER.finditer(text))
    return {
        f"{number} {unit[0].strip()}" if unit else number for number, unit in units if unit or "." in number
    }
