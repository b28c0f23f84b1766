"""The paper: its figures, tables, claims and report. Removable; nothing imports this room."""
