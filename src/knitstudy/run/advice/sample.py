"""The sample of knits that errors and prices of models are measured on: its box, its points, and the model settings.

``config/trade.yaml`` declares all of it. A knit is described by `Inputs`, which have no dimension: a knit of another
scale or modulus is the same one. `Case` is a specimen of a knit: cut out or endless, tied or touching. `Quantile`
bounds other knits from the box by those of the sample.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from math import floor, inf, isinf
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field

from knitstudy.knit.scene.documents import CONFIG, packaged_defaults, read_yaml
from knitstudy.knit.scene.keys import Count, Section, declared, lists, validated
from knitstudy.knit.scene.kinds import MODELS
from knitstudy.knit.scene.scene import Scene, digest, set_dotted

DECLARED = CONFIG / "trade.yaml"

UNDECIDED = "spline_yarns"  # Models all knits: the fidelity of a problem before its model is chosen

SPECIMENS, TIED, TOUCHING = ("cut_knit", "cell"), "tied", "touching"
SMALL, LARGE = "small", "large"  # Strains: every knit is computed to one of both ranges

KEYS = {
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

OVER = {
    "course": " over yarn.diameter",
    "wale": " over yarn.diameter",
    "length": " over that of Peirce's loop",
}

FREE = {
    *KEYS.values(),
    "yarn.diameter",
    "yarn.youngs_modulus",
    "load.deformation",
    "geometry.alpha",
    "geometry.free",
}
"""Physical keys whose values may differ from the sample: inputs stand for them, results scale with them, or they do
not concern a loop without control points."""

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
    def of(cls, scene: Scene) -> Self:
        """Return the inputs of the knit of a scene."""
        pattern, d, load = scene.value("pattern"), scene.yarn.diameter, scene.value("load")
        endless = scene.specimen == "cell"
        course, wale = pattern.course_ratio * pattern.course_spacing / d, pattern.wale_spacing / d
        peirce = 2 * course + wale + PEIRCE
        return cls(
            course,
            wale,
            (pattern.loop_length or peirce * d) / (peirce * d),
            scene.yarn.poisson_ratio,
            load.strain,
            scene.friction if scene.kind.interaction.touches else 0.0,
            1 if endless else pattern.loops,
            1 if endless else pattern.rows,
            load.deformation if endless else load.direction,
            load.lateral,
            scene.value("contact.tied_edges") or "none",
        )

    @classmethod
    def of_row(cls, row: Mapping[str, Any]) -> Self:
        """Return the inputs in a row of a table, which may hold numbers of cells as floats."""
        kinds = {"int": int, "float": float, "str": str}
        return cls(**{name: kinds[kind](row[name]) for name, kind in cls.__annotations__.items()})


@dataclass(frozen=True)
class Case:
    """A specimen of a knit whose yarns are `TIED` or `TOUCHING`, to `SMALL` or `LARGE` strains."""

    specimen: str
    yarns: str
    strains: str = SMALL

    def __str__(self) -> str:
        words = [self.specimen, self.yarns, self.strains if self.strains != SMALL else ""]
        return "-".join(filter(None, words)).replace("_", "-")


@dataclass(frozen=True)
class Quantile:
    """The share of knits that a bound holds for, and the confidence with which it does.

    The k-th smallest of n independent values lies above the quantile p of their population with the probability
    P(Bin(n, p) <= k - 1), whatever the distribution (Wilks 1941, Annals of Mathematical Statistics 12).
    """

    coverage: float
    confidence: float

    def rank(self, count: int) -> int | None:
        """Return which of so many values, from the smallest (1), is the bound; None where there are too few.

        >>> Quantile(0.90, 0.95).rank(48)
        47
        """
        from scipy.special import bdtr

        certain = bdtr(np.arange(count), count, self.coverage) >= self.confidence
        return int(np.argmax(certain)) + 1 if certain.any() else None

    def of(self, values: Sequence[float]) -> float:
        """Return the bound of values (n,), infinite where there are too few or too many are infinite."""
        rank = self.rank(len(values))
        return inf if rank is None else float(np.sort(values)[rank - 1])


class Large(Section):
    """Large strains, to which every knit of the sample is computed as well."""

    strain: list[float] = declared(allowed="two ends")
    without: list[str] = declared(allowed="names of model settings", default=[])


class Trade(Section):
    """Content of ``config/trade.yaml``."""

    knits: Count = declared(allowed="a whole number from 1 on")
    fewest: Count = declared(allowed="a whole number from 1 on")
    seed: Annotated[int, Field(ge=0)] = declared(allowed="a whole number from 0 on")
    coverage: Annotated[float, Field(gt=0, lt=1)] = declared(allowed="a share of the knits")
    confidence: Annotated[float, Field(gt=0, lt=1)] = declared(allowed="a probability")
    limit: Annotated[float, Field(gt=0)] = declared(allowed="a number > 0, in s")
    box: dict[str, list[Any]] = declared(allowed="two ends, or a list of texts, by input")
    large: Large = declared(allowed="the range of large strains, and model settings that do without")
    reference: tuple[str, ...] = declared(allowed="names of model settings")
    every: dict[str, Count] = declared(
        allowed="whole numbers from 1 on, by model setting or case", default={}
    )
    settings: dict[str, dict[str, dict[str, Any]]] = declared(
        allowed="keys by name, of tied and of touching yarns"
    )

    @property
    def quantile(self) -> Quantile:
        """Share of knits in the box that a promise holds for, and its confidence."""
        return Quantile(self.coverage, self.confidence)

    def cases(self) -> list[Case]:
        """Return all cases."""
        return [Case(*labels) for labels in product(SPECIMENS, self.settings, (SMALL, LARGE))]

    def case_of(self, scene: Scene) -> Case:
        """Return the case of a scene."""
        yarns = TOUCHING if scene.kind.interaction.touches else TIED
        large = scene.value("load.strain") > self.box["strain"][-1]
        return Case(scene.specimen, yarns, LARGE if large else SMALL)

    def settings_of(self, case: Case, number: int = 0) -> dict[str, dict[str, Any]]:
        """Return the keys of the settings that model a case, by name: all, or the settings for the knit of a number."""
        left_out = self.large.without if case.strains == LARGE else ()
        return {
            name: keys
            for name, keys in self.settings[case.yarns].items()
            if not any(number % self.every.get(label, 1) for label in (name, str(case)))
            and name not in left_out
            and case.specimen in MODELS.find(keys["fidelity"]).specimens
        }

    def drawn(self, case: Case, point: Inputs) -> Inputs:
        """Return the inputs of a case at a point of the box; a large strain lies in its range as the small one does."""
        low, high = self.box["strain"]
        first, last = self.large.strain
        strain = first + (last - first) * (point.strain - low) / (high - low)
        return replace(point, strain=float(f"{strain:.4g}")) if case.strains == LARGE else point

    def points(self) -> Iterator[Inputs]:
        """Yield points of the box without end, the same ones every time."""
        from scipy.stats.qmc import Sobol

        sampler = Sobol(len(self.box) + 1, seed=self.seed)
        while True:
            for *shares, slips in sampler.random(64):
                point = {name: _between(self.box[name], u) for name, u in zip(self.box, shares, strict=True)}
                yield Inputs(**point | {"friction": point["friction"] if slips < 0.5 else inf})

    def outside(self, scene: Scene) -> str:
        """Return the inputs of a scene that lie outside of the box, in words; an empty text where all lie inside.

        The sample was made with the defaults of the package.
        """
        case = self.case_of(scene)
        if scene.specimen not in SPECIMENS:
            return f"specimen is {scene.specimen!r}, but models were measured on {' and '.join(SPECIMENS)}"
        for name, value in asdict(Inputs.of(scene)).items():
            between, key = self.box[name], KEYS[name]
            if name == "strain":
                between = [between[0], self.large.strain[-1]]
            of_knit = case.specimen == "cell" and name in OF_KNIT
            if of_knit and key.startswith("pattern.") and (count := scene.value(key)) != 1:
                return f"{key} is {count}, but models were measured on cells of one loop"
            if of_knit or (case.yarns == TIED and name in OF_CONTACT) or value == inf:
                continue
            if isinstance(value, str) and value not in between:
                key = "load.deformation" if case.specimen == "cell" and name == "direction" else key
                return f"{key} is {value!r}, but models were measured with {' and '.join(between)}"
            if not isinstance(value, str) and not between[0] <= value * (1 + 1e-9) <= between[1] * (1 + 2e-9):
                fact = f"{key}{OVER.get(name, '')} is {value:.4g}"
                return f"{fact}, but models were measured from {between[0]:g} to {between[1]:g}"
        here, there = _others(scene), _others(self.scene(case, Inputs.of(scene)))
        for key, value in here.items():
            wanted = there.get(key)
            if wanted is None and value is not None:
                return f"{key} is set, but models were measured without it"
            if value != wanted:
                here_is, there_is = f"{lists(value)!r:.60}", f"{lists(wanted)!r:.60}"
                return f"{key} is {here_is}, but models were measured with {there_is}"
        return ""

    def scene(self, case: Case, inputs: Inputs, name: str = "sampled") -> Scene:
        """Return the physical problem of a knit; `inputs` have the strain of the case."""
        touches, endless = case.yarns == TOUCHING, case.specimen == "cell"
        interaction = ("rough" if isinf(inputs.friction) else "isotropic") if touches else "tie"
        lacks = {"tie": OF_CONTACT, "rough": ("friction",)}.get(interaction, ())
        peirce = 2 * inputs.course + inputs.wale + PEIRCE
        lengths = {"course": inputs.course, "wale": inputs.wale, "length": inputs.length * peirce}
        values = asdict(inputs) | {of: value * DIAMETER for of, value in lengths.items()}
        values |= OF_KNIT if endless else {}
        keys = {"yarn.diameter": DIAMETER}
        keys |= {KEYS[of]: value for of, value in values.items() if of not in lacks}
        if endless:
            keys["load.deformation"] = keys.pop("load.direction")
            keys.pop(KEYS["edges"], None)
        document: dict[str, Any] = {"name": name, "knit": name, "fidelity": UNDECIDED, "outputs": []}
        document |= {"specimen": case.specimen, "interaction": interaction}
        for key, value in keys.items():
            set_dotted(document, key, value, name)
        return Scene.from_dict(document, name, packaged_defaults())


def load_trade(path: Path = DECLARED) -> Trade:
    """Return the declaration; ConfigurationError names the key, its value and the allowed values."""
    return validated(Trade, read_yaml(path), str(path))


def same_knit(scene: Scene) -> str:
    """Return a digest of all that is physical of a knit, the same at any scale and modulus."""
    return digest([scene.specimen, scene.interaction, _rounded(asdict(Inputs.of(scene))), _others(scene)])


def endless(scene: Scene) -> Scene:
    """Return a cell of the endless fabric of the same loops under the same strain."""
    size = {"pattern.loops": 1, "pattern.rows": 1, "load.deformation": scene.value("load.direction")}
    return scene.vary({"specimen": "cell", "fidelity": UNDECIDED, "outputs": []} | size)


def _others(scene: Scene) -> dict[str, Any]:
    """Return the physical keys of a knit that no input stands for, over its diameter and Young's modulus."""
    scaled = scene.scaled(1 / scene.yarn.diameter, 1 / scene.yarn.youngs_modulus)
    return _rounded({key: value for key, value in scaled.values_of("physics").items() if key not in FREE})


def _rounded(value: Any) -> Any:
    """Return nested values with six digits of every number."""
    if isinstance(value, Mapping):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in value]
    return float(f"{value:.6g}") + 0.0 if isinstance(value, float) else value


def _between(ends: list[Any], share: float) -> Any:
    """Return the value of a box at a share of the way: even, of texts one of them, of whole numbers one."""
    low, high = ends[0], ends[-1]
    if isinstance(low, str) or (isinstance(low, int) and isinstance(high, int)):
        choices = ends if isinstance(low, str) else range(low, high + 1)
        return choices[min(floor(share * len(choices)), len(choices) - 1)]
    return float(f"{low + share * (high - low):.4g}")
