"""Which stages there are, what each needs and leaves, and whether a result is up to date. No physics."""
