"""Models of a fabric: solid yarns, networks of beams, beams in contact, and a window of one in the other."""
