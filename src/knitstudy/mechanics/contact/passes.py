"""Two passes: the points of each surface against the other, so that none is master."""

PASS_SHARE = 0.5
"""Each of the two surfaces' points carries half of the contact stiffness."""
