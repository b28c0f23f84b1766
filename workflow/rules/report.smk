# Files that `all` asks for from this part.
REPORT = []
