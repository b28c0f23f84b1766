"""Commands for users' own fabrics: curves, laws of a membrane, loops."""
