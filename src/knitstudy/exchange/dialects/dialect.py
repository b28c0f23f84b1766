"""What a dialect of keyword files is: words for elements, materials and interactions, and what they leave unsaid.

Words stand in tables by the value of the scene's key. A value that has no word is refused. A word that says less, or
something else, names its departures: sentences that go into the deck as comments and into the log as warnings.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from knitstudy.errors import ConfigurationError
from knitstudy.registry import Registry

if TYPE_CHECKING:
    from knitstudy.exchange.deck import Deck, Interaction, Step
    from knitstudy.mechanics.materials import Material

NUMBER = "%.12e"
"""At most 19 characters: CalculiX reads no more than 20 of a number."""


@dataclass(frozen=True)
class Wording:
    """Cards that stand for one key of a scene, and sentences on what they do not say of it."""

    cards: str
    departures: tuple[str, ...] = ()


@dataclass(frozen=True)
class Element:
    """Type of an element, its section controls with what the section says of them, and departures."""

    type: str
    controls: str = ""
    section: str = ""
    departures: tuple[str, ...] = ()


Words = dict[str, Callable[..., Wording | Element]]


class Dialect(ABC):
    """One program's keywords.

    Attributes
    ----------
    name : str
        In file names and on the command line.
    program : str
        In messages.
    elements : dict of str to function (Deck) -> Element
        Words for ``mesh.element``.
    materials : dict of str to function (Material) -> Wording
        Words for ``yarn.material``.
    interactions : dict of str to function (Interaction) -> Wording
        Words for ``interaction`` where yarns touch; ties are equations.
    """

    name: ClassVar[str]
    program: ClassVar[str]
    elements: ClassVar[Words]
    materials: ClassVar[Words]
    interactions: ClassVar[Words]

    def element(self, deck: Deck) -> Element:
        """Return the deck's element.

        Raises
        ------
        ConfigurationError
            If the dialect has no word for it.
        """
        return self._word("mesh.element", deck.element, self.elements)(deck)

    def material(self, material: Material) -> Wording:
        """Return the cards of a material.

        Raises
        ------
        ConfigurationError
            If the dialect has no word for its law.
        """
        return self._word("yarn.material", material.law, self.materials)(material)

    def behaviour(self, interaction: Interaction) -> Wording:
        """Return the cards of what happens where surfaces touch.

        Raises
        ------
        ConfigurationError
            If the dialect has no word for the interaction.
        """
        return self._word("interaction", interaction.kind, self.interactions)(interaction)

    def steps(self, deck: Deck) -> tuple[Step, ...]:
        """Return the steps that the program needs for those of the deck."""
        return deck.steps

    def step(self, deck: Deck) -> str:
        """Return the parameters of every step."""
        return ""

    @abstractmethod
    def outputs(self, deck: Deck) -> str:
        """Return the cards that ask for results."""

    def _word(self, key: str, value: str, words: Words) -> Callable[..., Wording | Element]:
        if value not in words:
            raise ConfigurationError(
                f"{key} is {value!r}, which {self.program} has no word for in a deck; it has words for"
                f" {', '.join(words)}"
            )
        return words[value]


DIALECTS: Registry[type[Dialect]] = Registry("deck dialect", "knitstudy.exchange.dialects")
"""Classes of dialects."""


def quadratic(deck: Deck) -> Element:
    """C3D20R, in all of them: the same functions and points."""
    return Element("C3D20R")


def small_strain_neo_hooke(material: Material, program: str) -> Wording:
    """Return W = C10 (I1 J^(-2/3) - 3) + (J - 1)^2 / D1 of the material's G and K, and how the scene's differs.

    Parameters
    ----------
    material : Material
    program : str
        That has this law.
    """
    bulk = material.lame + 2 / 3 * material.shear_modulus
    return Wording(
        f"*HYPERELASTIC, NEO HOOKE\n{NUMBER % (material.shear_modulus / 2)}, {NUMBER % (2 / bulk)}\n",
        (
            f"yarn.material is neo_hookean, G/2 (tr C - 3) - G ln J + lambda/2 (ln J)^2; {program} has "
            "C10 (J^(-2/3) tr C - 3) + (J - 1)^2 / D1 with the same G and K: equal to first order in strain",
        ),
    )


def elastic(material: Material) -> str:
    """Return the card of E and nu."""
    return f"*ELASTIC\n{NUMBER % material.youngs_modulus}, {NUMBER % material.poisson_ratio}\n"
