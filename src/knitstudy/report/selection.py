"""Which scenes of a study figures and tables are about."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from knitstudy.scene import Scene

REDUCED = ("rom3d", "rom2d")


def models_of(scenes: Iterable[Scene], of: Mapping[str, str]) -> dict[str, Scene]:
    """Return one direct simulation and the reduced models made from it, by fidelity.

    The first DNS of the table that fits is taken, or the first with all reduced models if there is one, and
    of each reduced model the first.

    Parameters
    ----------
    scenes : iterable of Scene
        Scenes of a study in the order of the table.
    of : mapping of str to str
        Wanted values of keys, for example ``{"interaction": "tie", "load.direction": "course"}``.

    Returns
    -------
    dict of str to Scene
        Keys "dns", "rom3d" and "rom2d" as far as the study has them; empty without a DNS.
    """
    fitting = [scene for scene in scenes if all(_value(scene, key) == value for key, value in of.items())]
    found = [_family(dns, fitting) for dns in fitting if dns.fidelity == "dns"]
    return max(found, key=len, default={})  # of equals the first


def _family(dns: Scene, scenes: list[Scene]) -> dict[str, Scene]:
    made_from_it = [scene for scene in scenes if scene.rom.contacts_from == dns.name]
    first = {scene.fidelity: scene for scene in reversed(made_from_it)}
    return {"dns": dns} | {fidelity: first[fidelity] for fidelity in REDUCED if fidelity in first}


def _value(scene: Scene, key: str) -> object:
    """Return the value of a dotted key."""
    value: object = scene
    for part in key.split("."):
        value = getattr(value, part)
    return value
