"""The report: one HTML page that holds every figure and table, beside the findings of the paper."""
