"""The paper: its figures, tables, claims and report. Optional: no other package imports it."""

from knitstudy.registry import OptionalPackage

OPTIONAL_PACKAGE = OptionalPackage(
    figures="knitstudy.paper.figures",
    tables="knitstudy.paper.tables",
    report="knitstudy.paper.report",
)
