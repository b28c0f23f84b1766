"""Models of a fabric: solid yarns, networks of beams, and beams in contact."""
