"""The report: one HTML page that holds every figure and table with the findings of the paper."""
