"""Which scenes of a study figures and tables are about, and what they call them.

Of one case, for example ties in course tension:

- "dns", "rom3d", "rom2d": one direct simulation and the main reduced models made from it.
- "reduced": all reduced models made from it.
- "others": direct simulations of the same by other elements, or on other meshes.
- "again": direct simulations of what is compared with each other, by the finest of every other discretisation.
- "penalties": that simulation with penalties alone, of several contact stiffnesses.
- "beams": the same knit as beams in contact.
- "tie", "rough", "isotropic", "untied": direct simulations like that one but for the interaction, to be compared.
- "cut": cells cut out of a knit, of as many rows, that are otherwise like that one.

Whatever the case:

- "tie_course_dns" and so on: the models of the four cases of `CASES`.
- "every": all simulations of knits but windows; "sprung": the direct ones whose contacts give springs.
- "windows": windows of solid yarns in knits of beams, and the direct simulations that they are held against.
- "variations": ties, rough contact and isotropic friction, and the same with one input changed at a time; "frictions":
  those of them with Table 1's coefficient of friction and smaller ones, ties and rough contact beside them.
- "sweeps": direct simulations of knits whose course spacing or yarn diameter is swept (`measures.sweeps`).
- "ways": direct simulations of knits whose increments end at the strains of the reference, which is made from them.
- "fields": direct simulations of the four cases that keep their fields, one by every discretisation.
- "squares": square knits that differ in nothing but their number of cells, by each model (see `measures.domain`);
  "domain": those in course tension, the paper's.
- "pairs": all pairs of crossing yarns that are pressed on each other and then slide.
- "cells": all cells of an endless knit.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import Any

from knitstudy.measures.discretisation import discretisation, finer, is_cut, is_direct, made_of, problem_of
from knitstudy.measures.domain import series_of
from knitstudy.measures.response import STRAINS
from knitstudy.measures.sweeps import FRICTION, swept
from knitstudy.measures.variations import COEFFICIENT, WITHOUT_LIMIT, variations
from knitstudy.measures.windows import is_window, windows
from knitstudy.study.scene import Scene

COURSE = {"specimen": "knit", "load.direction": "course"}

WALE = {"specimen": "knit", "load.direction": "wale"}

TIE = {"interaction": "tie"}

ROUGH = {"interaction": "rough"}

ISOTROPIC = {"interaction": "isotropic", "contact.friction": FRICTION}

OUTER_TIED = {"contact.tied_edges": "outer"}

TIED_COURSE, TIED_WALE = COURSE | TIE, WALE | TIE
"""Scenes with ties."""

ISOTROPIC_COURSE, ISOTROPIC_WALE = COURSE | ISOTROPIC | OUTER_TIED, WALE | ISOTROPIC | OUTER_TIED
"""Scenes with the friction of Table 1 and the ties of Fig. 3."""

CASES = {
    "tie_course": TIED_COURSE,
    "tie_wale": TIED_WALE,
    "isotropic_course": ISOTROPIC_COURSE,
    "isotropic_wale": ISOTROPIC_WALE,
}
"""The four cases that reduced models are compared in (Fig. 15)."""

MAIN_MODEL = {
    "rom.joint": "rigid",
    "rom.springs_from": None,
    "rom.springs": "averaged",
    "rom.stiffness": (),
    "rom.axes": "contact",
    "rom.displacement": "interface",
    "rom.section": "single",
    "rom.honeycomb": "geometry",
    "mesh.section_law": "curved",
}
"""What makes a reduced model the main one of its simulation: others are variants."""

VARIANTS = {
    "tie": TIE,
    "rough": ROUGH | OUTER_TIED,
    "isotropic": ISOTROPIC | OUTER_TIED,
    "untied": ISOTROPIC | {"contact.tied_edges": "none"},
}
"""Interactions that are compared with each other."""

REDUCED = ("rom3d", "rom2d")

ALIKE = (
    "specimen",
    "knit",
    "load.direction",
    "load.lateral",
    "contact.normal_stiffness",
    "contact.augmentations",
)
"""Keys that scenes of the same yarns share when they are compared; they may be pulled to different strains."""

LOADED_ALIKE = ("specimen", "knit", "interaction", "yarn", "load.direction", "load.strain", "load.lateral")
"""Keys that simulations of one case share."""

CUT_ALIKE = (
    *("pattern", "interaction", "yarn", "tie", "contact"),
    *("load.direction", "load.strain", "load.lateral"),
)
"""Sections and keys that cells cut out of a knit share with it."""

ENFORCED_ALIKE = ("contact.friction", "contact.tied_edges", "mesh.element")
"""Keys that simulations share which differ in their penalties."""


Found = dict[str, Scene | list[Scene]]


class Roles:
    """What figures and tables call the scenes of a study, each case found once.

    Parameters
    ----------
    scenes : iterable of Scene
        Scenes of a study in the order of the families.
    """

    def __init__(self, scenes: Iterable[Scene]) -> None:
        self._scenes = list(scenes)
        self._of: dict[tuple, Found] = {}

    def of(self, wanted: Mapping[str, Any]) -> Found:
        """Return the scenes by their roles; what the study lacks is not there.

        Parameters
        ----------
        wanted : mapping
            Values of the main scene's keys, for example ``{"interaction": "tie"}``.
        """
        case = tuple(sorted(wanted.items()))
        if case not in self._of:
            self._of[case] = self._of_case(wanted)
        return self._of[case]

    @cached_property
    def whatever_the_case(self) -> Found:
        """Those that every case has."""
        scenes = self._scenes
        grown = squares(scenes)
        several = {
            "variations": varied(scenes),
            "frictions": friction_sweep(scenes),
            "pairs": pairs(scenes),
            "every": [scene for scene in scenes if scene.specimen == "knit" and not is_window(scene)],
            "windows": windows(scenes),
            "cells": [scene for scene in scenes if scene.specimen == "cell"],
            "sprung": sprung(scenes),
            "ways": ways(scenes),
            "fields": with_fields(scenes),
            "sweeps": swept(scenes),
            "domain": [scene for scene in grown if _fits(scene, COURSE)],
            "squares": grown,
        }
        return _of_cases(scenes) | _without_empty(several)

    def _of_case(self, wanted: Mapping[str, Any]) -> Found:
        scenes = self._scenes
        models = models_of(scenes, wanted)
        if not models:
            return self.whatever_the_case
        main = models["dns"]
        several = {
            "others": others_of(main, scenes),
            "again": again(main, scenes),
            "reduced": reduced_of(main, scenes),
            "penalties": penalties_of(main, scenes),
            "beams": beams_of(main, scenes),
        }
        alone = models | variants_of(main, scenes) | cut_of(main, scenes)
        return alone | self.whatever_the_case | _without_empty(several)


def roles_of(scenes: Iterable[Scene], of: Mapping[str, Any]) -> Found:
    """Return scenes of a study by their roles in one case (`Roles`)."""
    return Roles(scenes).of(of)


def models_of(scenes: Iterable[Scene], of: Mapping[str, Any]) -> dict[str, Scene]:
    """Return one direct simulation and the main reduced models made from it, by fidelity.

    The first DNS of the study that fits is taken, or the first with all reduced models if there is one, and
    of each reduced model the first.

    Parameters
    ----------
    scenes : iterable of Scene
        Scenes of a study in the order of the families.
    of : mapping
        Wanted values of keys, for example ``{"interaction": "tie", "load.direction": "course"}``.

    Returns
    -------
    dict of str to Scene
        Keys "dns", "rom3d" and "rom2d" as far as the study has them; empty without a DNS.
    """
    fitting = [scene for scene in scenes if _fits(scene, of)]
    found = [_family(dns, fitting) for dns in fitting if is_direct(dns)]
    return max(found, key=len, default={})  # of equals the first


def reduced_of(main: Scene, scenes: Iterable[Scene]) -> list[Scene]:
    """Return all reduced models made from the contacts of a direct simulation, in the order of the families."""
    return [scene for scene in scenes if scene.value("rom.contacts_from") == main.name]


def others_of(main: Scene, scenes: Iterable[Scene]) -> list[Scene]:
    """Return the direct simulations of one problem with yarns that are made otherwise; none by penalties alone."""
    problem = problem_of(main)
    return [
        scene
        for scene in _direct(scenes, main, ("load.strain",))
        if made_of(scene) != made_of(main)
        and scene.value("contact.augmentations") != 0
        and problem_of(scene) == problem
    ]


def again(main: Scene, scenes: Iterable[Scene]) -> list[Scene]:
    """Return what is compared with each other (`variants_of`) by other discretisations, of every kind the finest."""
    scenes = list(scenes)
    finest: dict[str, Scene] = {}
    for scene in [other for kind in variants_of(main, scenes).values() for other in others_of(kind, scenes)]:
        known = finest.setdefault(discretisation(scene), scene)
        if finer(scene, known):
            finest[discretisation(scene)] = scene
    return [scene for other in finest.values() for scene in variants_of(other, scenes).values()]


def penalties_of(main: Scene, scenes: Iterable[Scene]) -> list[Scene]:
    """Return the direct simulations like one in which nothing but penalties keeps yarns apart."""
    found = _direct(scenes, main, (*LOADED_ALIKE, *ENFORCED_ALIKE))
    return [scene for scene in found if scene.value("contact.augmentations") == 0]


def beams_of(main: Scene, scenes: Iterable[Scene]) -> list[Scene]:
    """Return the models of beams in contact of the same knit under the same load, as finely as the first of them."""
    keys = (*LOADED_ALIKE, "contact.friction")
    found = [scene for scene in scenes if scene.fidelity == "beam" and _alike(scene, main, keys)]
    return [scene for scene in found if (scene.mesh, scene.solver) == (found[0].mesh, found[0].solver)]


def sprung(scenes: Iterable[Scene]) -> list[Scene]:
    """Return the direct simulations of knits whose contacts give springs, and whose outer crossings are tied.

    Those are left out in which an input is changed to see what hangs on it.
    """
    base, *others = variations(scenes) or [None]
    kept = {scene.name for scene in base.scenes.values()} if base else set()
    changed = {scene.name for each in others for scene in each.scenes.values()} - kept
    knits = [scene for scene in scenes if scene.specimen == "knit" and is_direct(scene)]
    touching = [scene for scene in knits if scene.interaction != "tie" and _fits(scene, OUTER_TIED)]
    return [scene for scene in touching if scene.name not in changed]


def variants_of(main: Scene, scenes: Iterable[Scene]) -> dict[str, Scene]:
    """Return the first direct simulation of every interaction (`VARIANTS`) that compares with a scene."""
    alike = [scene for scene in _direct(scenes, main, ALIKE) if made_of(scene) == made_of(main)]
    found = {name: [scene for scene in alike if _fits(scene, of)] for name, of in VARIANTS.items()}
    return {name: fitting[0] for name, fitting in found.items() if fitting}


def cut_of(main: Scene, scenes: Iterable[Scene]) -> dict[str, Scene]:
    """Return the first scene of cells cut out of a knit that is otherwise like a direct simulation, as "cut"."""
    for scene in scenes:
        if is_cut(scene) and made_of(scene) == made_of(main) and _alike(scene, main, CUT_ALIKE):
            return {"cut": scene}
    return {}


def varied(scenes: Iterable[Scene]) -> list[Scene]:
    """Return the scenes in which one input at a time is changed, and those that they are compared with."""
    found = [scene for each in variations(scenes) for scene in each.scenes.values()]
    return list({scene.name: scene for scene in found}.values())


def friction_sweep(scenes: Iterable[Scene]) -> list[Scene]:
    """Return ties, rough contact, and isotropic friction with one coefficient and smaller ones, all else the same.

    Without a smaller coefficient there is no sweep.
    """
    base, *others = variations(scenes) or [None]
    slides = [
        each.scenes["isotropic"]
        for each in others
        if each.key == COEFFICIENT and each.value != WITHOUT_LIMIT and each.value <= FRICTION
    ]
    return [*base.scenes.values(), *slides] if base and slides else []


def ways(scenes: Iterable[Scene]) -> list[Scene]:
    """Return the direct simulations of knits that the reference can be made from."""
    knits = [scene for scene in scenes if scene.specimen == "knit" and is_direct(scene)]
    return [scene for scene in knits if set(STRAINS) <= {*scene.load.stops, scene.load.strain}]


def with_fields(scenes: Iterable[Scene]) -> list[Scene]:
    """Return the first direct simulation of each of the four cases by every discretisation that keeps fields."""
    found: dict[tuple[str, str], Scene] = {}
    for scene in scenes:
        if is_direct(scene) and "fields" in scene.outputs:
            for case, of in CASES.items():
                if _fits(scene, of):
                    found.setdefault((case, made_of(scene)), scene)
    knits = {case: scene.knit for (case, _), scene in reversed(found.items())}
    return [scene for (case, _), scene in found.items() if scene.knit == knits[case]]


def squares(scenes: Iterable[Scene]) -> list[Scene]:
    """Return the simulations of square knits of rising size, series by series."""
    return [scene for series in series_of(scenes) for scene in series.scenes]


def pairs(scenes: Iterable[Scene]) -> list[Scene]:
    """Return the direct simulations of two crossing yarns that slide: their paths have more legs than one."""
    return [scene for scene in scenes if len(scene.value("load.path") or ()) > 1]


def _without_empty(several: Mapping[str, list[Scene]]) -> Found:
    return {role: found for role, found in several.items() if found}


def _of_cases(scenes: list[Scene]) -> dict[str, Scene]:
    """Return the models of every case by the names of the case and the fidelity."""
    return {
        f"{case}_{fidelity}": scene
        for case, of in CASES.items()
        for fidelity, scene in models_of(scenes, of).items()
    }


def _family(dns: Scene, scenes: list[Scene]) -> dict[str, Scene]:
    main = [scene for scene in reduced_of(dns, scenes) if _fits(scene, MAIN_MODEL)]
    first = {scene.fidelity: scene for scene in reversed(main)}
    return {"dns": dns} | {fidelity: first[fidelity] for fidelity in REDUCED if fidelity in first}


def _direct(scenes: Iterable[Scene], main: Scene, keys: tuple[str, ...]) -> list[Scene]:
    """Return the direct simulations that share values of keys with a scene."""
    return [scene for scene in scenes if is_direct(scene) and _alike(scene, main, keys)]


def _fits(scene: Scene, of: Mapping[str, Any]) -> bool:
    """Return whether those keys that a scene of its kind has are as wanted."""
    return all(scene.value(key) in (value, None) for key, value in of.items())


def _alike(scene: Scene, main: Scene, keys: tuple[str, ...]) -> bool:
    """Return whether two scenes share those values of keys that both have."""
    pairs = ((scene.value(key), main.value(key)) for key in keys)
    return all(one == other or one is None or other is None for one, other in pairs)
