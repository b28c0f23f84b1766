"""Input decks of other finite-element programs: one file for each kind of deck."""
