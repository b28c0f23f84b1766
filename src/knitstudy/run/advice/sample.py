"""The sample of knits that errors and prices of models are measured on: its box, its points, and the model settings.

``config/trade.yaml`` declares all of it. A knit is described by `Inputs`, which have no dimension: a knit of another
scale or modulus is the same one. `SampleCase` is a specimen of a knit: cut out or endless, tied or touching.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from math import inf, isinf
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field

from knitstudy.knit.scene.documents import CONFIG, packaged_defaults, read_yaml
from knitstudy.knit.scene.keys import Count, Section, declared, validated
from knitstudy.knit.scene.kinds import MODELS
from knitstudy.knit.scene.scene import Scene
from knitstudy.run.behaviour import behaviour, group

DECLARED = CONFIG / "trade.yaml"

UNDECIDED = "spline_yarns"  # Models all knits: the fidelity of a problem before its model is chosen

SPECIMENS = ("cut_knit", "cell")
TIED = "tied"
TOUCHING = "touching"
# Load paths: to one of two ranges of strain, or to the large one and back
SMALL, LARGE, CYCLE = "small", "large", "cycle"

INPUT_KEYS = {
    "course": "pattern.course_spacing",
    "wale": "pattern.wale_spacing",
    "length": "pattern.loop_length",
    "poisson_ratio": "yarn.poisson_ratio",
    "strain": "load.strain",
    "friction": "contact.friction",
    "loops": "pattern.loops",
    "rows": "pattern.rows",
    "direction": "load.direction",
    "lateral": "load.lateral",
    "edges": "contact.tied_edges",
}
"""The key of a scene behind each input."""

OF_CONTACT = ("friction", "edges")
"""Inputs that tied yarns do not have."""

OF_KNIT = {"loops": 1, "rows": 1, "edges": "none"}
"""Inputs that an endless knit does not have, and the values that stand for them."""

PEIRCE = 5.94  # Peirce's loop: 2 course spacings + wale spacing + so many diameters of yarn
DIAMETER = 1e-3  # of all knits of the sample [m]: no result depends on it


@dataclass(frozen=True)
class Inputs:
    """A knit without dimensions; `friction` is 0 of tied yarns, and infinite where yarns do not slip."""

    course: float
    wale: float
    length: float
    poisson_ratio: float
    strain: float
    friction: float
    loops: int
    rows: int
    direction: str
    lateral: str
    edges: str

    @classmethod
    def of_row(cls, row: Mapping[str, Any]) -> Self:
        """Return the inputs in a row of a table, which may hold numbers of cells as floats."""
        kinds = {"int": int, "float": float, "str": str}
        return cls(**{name: kinds[kind](row[name]) for name, kind in cls.__annotations__.items()})


@dataclass(frozen=True)
class SampleCase:
    """A specimen of a knit whose yarns are `TIED` or `TOUCHING`, on the load path `SMALL`, `LARGE` or `CYCLE`."""

    specimen: str
    yarns: str
    path: str = SMALL

    def __str__(self) -> str:
        words = [self.specimen, self.yarns, self.path if self.path != SMALL else ""]
        return "-".join(filter(None, words)).replace("_", "-")


class Large(Section):
    """Large strains, to which knits of the sample are computed as well; where yarns touch, all have friction then."""

    strain: dict[str, list[float]] = declared(allowed="two ends, by case")
    without: list[str] = declared(allowed="names of model settings", default=[])


class Cycle(Section):
    """A cycle of a cell to a large strain: it comes `back` to a share of the strain, with `keys` in all settings."""

    back: Annotated[float, Field(ge=0, lt=0.5)] = declared(allowed="a share of the strain")
    keys: dict[str, Any] = declared(allowed="keys", default={})


class Trade(Section):
    """Content of ``config/trade.yaml``."""

    knits: Count = declared(allowed="a whole number from 1 on")
    fewest: Count = declared(allowed="a whole number from 1 on")
    seed: Annotated[int, Field(ge=0)] = declared(allowed="a whole number from 0 on")
    coverage: Annotated[float, Field(gt=0, lt=1)] = declared(allowed="a share of the knits")
    confidence: Annotated[float, Field(gt=0, lt=1)] = declared(allowed="a probability")
    limit: Annotated[float, Field(gt=0)] = declared(allowed="a number > 0, in s")
    box: dict[str, list[Any]] = declared(allowed="two ends, or a list of texts, by input")
    large: Large = declared(allowed="the ranges of large strains, and model settings that do without")
    cycle: Cycle = declared(allowed="where a cycle ends, and keys of all model settings")
    reference: tuple[str, ...] = declared(allowed="names of model settings")
    every: dict[str, Count] = declared(
        allowed="whole numbers from 1 on, by model setting or case", default={}
    )
    settings: dict[str, dict[str, dict[str, Any]]] = declared(
        allowed="keys by name, of tied and of touching yarns"
    )

    def bound(self, values: Sequence[float]) -> float:
        """Return what the share `coverage` of all knits keeps below, at `confidence`, by the values (n,) of a sample.

        It is infinite where they are too few, or too many are infinite. The k-th smallest of n independent values lies
        above the quantile p of their population with the probability P(Bin(n, p) <= k - 1), whatever the distribution
        (Wilks 1941, Annals of Mathematical Statistics 12).
        """
        from scipy.special import bdtr

        certain = bdtr(np.arange(len(values)), len(values), self.coverage) >= self.confidence
        return float(np.sort(values)[certain.argmax()]) if certain.any() else inf

    def cases(self) -> list[SampleCase]:
        """Return all cases."""
        of = [SampleCase(*labels) for labels in product(SPECIMENS, self.settings)]
        cycles = [SampleCase("cell", TOUCHING, CYCLE)]
        return of + [replace(case, path=LARGE) for case in of if str(case) in self.large.strain] + cycles

    def strains(self, case: SampleCase) -> list[Any]:
        """Return the range of strains of a case, of cycles at their turn."""
        small = self.box["strain"]
        if case.path == SMALL:
            return small
        return self.large.strain.get(str(replace(case, path=SMALL)), small)

    def settings_of(self, case: SampleCase, number: int = 0) -> dict[str, dict[str, Any]]:
        """Return the keys of the settings that model a case, by name: all, or the settings for the knit of a number."""
        left_out = self.large.without if case.path != SMALL else ()
        others = self.cycle.keys if case.path == CYCLE else {}
        return {
            name: keys | others
            for name, keys in self.settings[case.yarns].items()
            if not any(number % self.every.get(label, 1) for label in (name, str(case)))
            and name not in left_out
            and case.specimen in MODELS.find(keys["fidelity"]).specimens
        }

    def group_of(self, case: SampleCase, setting: str) -> str:
        """Return the group of the scenes of a case by a model setting (`knitstudy.run.behaviour`)."""
        fidelity = self.settings_of(case)[setting]["fidelity"]
        return group(case.specimen, fidelity, case.yarns == TOUCHING)

    def behaviours(self, case: SampleCase) -> dict[str, str]:
        """Return the digest of what the models of a case do, by model setting (`knitstudy.run.behaviour`)."""
        return {name: behaviour([self.group_of(case, name)]) for name in self.settings_of(case)}

    def scene(self, case: SampleCase, inputs: Inputs, name: str = "sampled") -> Scene:
        """Return the physical problem of a knit; `inputs` have the strain of the case, of a cycle that of its turn."""
        touches = case.yarns == TOUCHING
        endless = case.specimen == "cell"
        interaction = ("rough" if isinf(inputs.friction) else "isotropic") if touches else "tie"
        lacks = {"tie": OF_CONTACT, "rough": ("friction",)}.get(interaction, ())
        peirce = 2 * inputs.course + inputs.wale + PEIRCE
        lengths = {"course": inputs.course, "wale": inputs.wale, "length": inputs.length * peirce}
        values = asdict(inputs) | {of: value * DIAMETER for of, value in lengths.items()}
        values |= OF_KNIT if endless else {}
        keys: dict[str, Any] = {"yarn.diameter": DIAMETER}
        keys |= {INPUT_KEYS[of]: value for of, value in values.items() if of not in lacks}
        if case.path == CYCLE:
            keys |= {"load.turns": [inputs.strain], "load.strain": self.cycle.back * inputs.strain}
        if endless:
            keys["load.deformation"] = keys.pop("load.direction")
            keys.pop(INPUT_KEYS["edges"], None)
        document: dict[str, Any] = {"name": name, "knit": name, "fidelity": UNDECIDED, "outputs": []}
        document |= {"specimen": case.specimen, "interaction": interaction}
        return Scene.from_dict(document | keys, name, packaged_defaults())


def load_trade() -> Trade:
    """Return the declaration; ConfigurationError names the key, its value and the allowed values."""
    return validated(Trade, read_yaml(DECLARED), str(DECLARED))
