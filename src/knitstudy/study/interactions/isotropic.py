"""Contact with Coulomb friction, the same in all directions."""

from knitstudy.study.kinds import INTERACTIONS, Interaction
from knitstudy.study.sections.interaction import Sliding

INTERACTIONS.register(
    Interaction(
        "isotropic",
        "contact with Coulomb friction",
        friction=lambda scene: scene.contact.friction,
        keys=Sliding,
    )
)
