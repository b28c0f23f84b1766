"""What is measured of results: from datasets and scenes to numbers and verdicts. Nothing is drawn or written here."""
