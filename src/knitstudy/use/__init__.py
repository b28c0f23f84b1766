"""What users take away: pictures, decks of other programs, measured curves, laws of a fabric. Removable."""
