"""The paper's claims judged by results. A judge takes all evidence and returns what it measured, and a verdict."""
