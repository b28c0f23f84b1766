"""The `knitstudy` command: it parses and prints; what it does are functions of the library."""
