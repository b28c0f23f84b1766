"""The report: one HTML page that holds every figure and table, and what the paper says beside them."""
