"""Contact without slip."""

import math

from knitstudy.study.kinds import INTERACTIONS, Interaction

INTERACTIONS.register(Interaction("rough", "contact without slip", friction=lambda scene: math.inf))
