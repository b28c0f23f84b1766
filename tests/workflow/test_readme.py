"""What the README shows works as it is printed."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", README, flags=re.MULTILINE | re.DOTALL)


def test_python_example(fresh, tmp_path):
    (code,) = blocks("python")
    ended = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=fresh.environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    assert re.fullmatch(r"\[0\. +\d+\.\d+ +\d+\.\d+\]\n", ended.stdout)


def test_snakemake_commands(fresh):
    (commands,) = blocks("bash")
    lines = [line.split("#")[0].split() for line in commands.splitlines()]
    tried = [words[1:] for words in lines if words[0] == "snakemake"]
    assert len(tried) == 4
    for words in tried:
        ended = fresh.snakemake(*words, "--dry-run")
        assert ended.returncode == 0, (words, ended.stdout, ended.stderr)


def test_every_make_target_exists():
    targets = re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), flags=re.MULTILINE)
    named = set(re.findall(r"(?:`|^    )make ([a-z]+)", README, flags=re.MULTILINE))
    assert {"study", "test"} <= named <= set(targets)


def test_every_path_exists():
    linked = re.findall(r"\]\(([^)#:]+)\)", README)
    listed = re.findall(r"^\| `((?:src|config|resources|workflow|tests)/[^`]*)`", README, flags=re.MULTILINE)
    paths = linked + listed
    assert paths
    for path in paths:
        assert (ROOT / path).exists(), path
