"""The `knitstudy` command: it parses and prints; functions of the library do the work."""
