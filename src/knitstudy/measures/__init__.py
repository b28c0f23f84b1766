"""Measures of results: from datasets and scenes to numbers and verdicts, without drawing or writing."""
