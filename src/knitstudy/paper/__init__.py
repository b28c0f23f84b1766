"""The paper: its figures, tables, claims and report. Removable; nothing imports this room."""

from knitstudy.registry import Wing

WING = Wing(
    figures="knitstudy.paper.figures",
    tables="knitstudy.paper.tables",
    report="knitstudy.paper.report",
)
