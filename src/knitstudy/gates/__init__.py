"""What a run must satisfy to go on: each gate ends it in one line, and a key raises its limit. No mechanics."""
