"""Models, increments, Newton's method, linear systems, and arrays: what all mechanics is made of."""
