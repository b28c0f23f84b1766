"""How a name that does not exist is answered."""

from __future__ import annotations

import difflib

MANY = 20
"""Names beyond which a message does not list them all once it has a near one."""


def unknown_choice(what: str, full_name: str, name: str, allowed: list[str]) -> str:
    """Return a message for a name that does not exist: the nearest one that does, and all unless they are many."""
    near = difflib.get_close_matches(name, allowed, n=1)
    hint = f" (did you mean {near[0]!r}?)" if near else ""
    if near and len(allowed) > MANY:
        return f"{what} {full_name!r}{hint}; {len(allowed)} names are allowed"
    return f"{what} {full_name!r}{hint}; allowed are {', '.join(allowed) if allowed else 'none'}"
