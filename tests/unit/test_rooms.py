"""Modules lie in rooms, one above the other: imports run downwards and never in a circle (``.importlinter``)."""

from pathlib import Path

from importlinter.cli import lint_imports

CONTRACTS = Path(__file__).parents[2] / ".importlinter"


def test_contracts_of_imports_are_kept(capsys, monkeypatch):
    monkeypatch.setattr(
        "logging.config.dictConfig", lambda configuration: None
    )  # it would end all other loggers
    assert lint_imports(config_filename=str(CONTRACTS), cache_dir=None) == 0, capsys.readouterr().out
