"""The paper's claims judged by results. A judge takes all evidence and returns its measurements and a verdict."""
