"""The example for notebooks works as it is printed, block after block."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")


def test_every_block(fresh, tmp_path):
    blocks = re.findall(r"^```python\n(.*?)^```", EXAMPLE, flags=re.MULTILINE | re.DOTALL)
    assert len(blocks) >= 6
    ended = subprocess.run(
        [sys.executable, "-c", "\n".join(blocks)],
        cwd=tmp_path,
        env=fresh.environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    assert "yarn.poisson_ratio is 0.6 but must be a number between -1 and 0.5" in ended.stdout
    assert re.search(r"^dns dns-tie-course-coarse-\w{8} +100%", ended.stderr, flags=re.MULTILINE)
    assert len(list((tmp_path / "my-results" / "simulation").iterdir())) == 1, (
        "the reduced model takes its joints from the same run"
    )
    kept = {path.relative_to(tmp_path / "my-results").parts[0] for path in tmp_path.rglob("*.nc")}
    assert kept == {"geometry", "mesh", "simulation", "contacts"}
    assert (tmp_path / "my-results" / "force.png").stat().st_size > 10_000


def test_every_linked_path_exists():
    linked = re.findall(r"\]\(([^)#:]+)\)", EXAMPLE)
    assert linked
    for path in linked:
        assert (ROOT / "docs" / path).exists(), path
