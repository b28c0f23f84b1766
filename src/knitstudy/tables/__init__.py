"""Tables, one function each that registers itself in `catalogue`: from results to a DataFrame. No figure."""
