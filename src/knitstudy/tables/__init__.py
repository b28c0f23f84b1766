"""Tables of the paper and of the study, one module each: ``build(...) -> DataFrame``. See `catalogue`."""
