"""The models, one file each: specimens, keys, look in figures, cost, and the function that builds the problem."""
