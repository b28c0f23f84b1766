"""A window of solid yarns in a knit of beams: pieces of yarn, what surrounds them, and both as one model."""
