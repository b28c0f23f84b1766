"""Descriptions of the package for others agree: pyproject.toml, CITATION.cff, codemeta.json, the workflow catalog.

``python tests/unit/test_metadata.py`` writes codemeta.json from the other two.
"""

import json
import re
import tomllib
from pathlib import Path

import yaml

import knitstudy

ROOT = Path(__file__).resolve().parents[2]
CODEMETA = ROOT / "codemeta.json"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
SYSTEMS = {"Operating System :: MacOS": "macOS", "Operating System :: POSIX :: Linux": "Linux"}


def codemeta():
    """Return the description in the terms of CodeMeta 3.0."""
    (paper,) = CITATION["references"]
    return {
        "@context": "https://w3id.org/codemeta/3.0",
        "@type": "SoftwareSourceCode",
        "name": PROJECT["name"],
        "description": PROJECT["description"],
        "version": CITATION["version"],
        "license": f"https://spdx.org/licenses/{PROJECT['license']}",
        "author": [{"@type": "Organization", "name": author["name"]} for author in CITATION["authors"]],
        "keywords": PROJECT["keywords"],
        "programmingLanguage": "Python",
        "runtimePlatform": f"Python {PROJECT['requires-python']}",
        "operatingSystem": [SYSTEMS[name] for name in PROJECT["classifiers"] if name in SYSTEMS],
        "softwareRequirements": PROJECT["dependencies"],
        "referencePublication": {
            "@type": "ScholarlyArticle",
            "@id": f"https://doi.org/{paper['doi']}",
            "name": paper["title"],
        },
    }


def test_codemeta_is_up_to_date():
    """Otherwise: python tests/unit/test_metadata.py."""
    assert json.loads(CODEMETA.read_text(encoding="utf-8")) == codemeta()


def test_citation_and_project_are_the_same_software():
    assert CITATION["version"] == knitstudy.__version__
    assert CITATION["license"] == PROJECT["license"]
    assert [author["name"] for author in CITATION["authors"]] == [a["name"] for a in PROJECT["authors"]]
    name, _, meaning = CITATION["title"].partition(": ")
    assert (name, meaning.lower()) == (PROJECT["name"], PROJECT["description"].lower())


def test_urls_of_the_project_stand_in_the_citation():
    dois = {f"https://doi.org/{paper['doi']}" for paper in CITATION["references"]}
    assert set(PROJECT["urls"].values()) <= dois


def test_the_workflow_catalog_finds_what_it_asks_for():
    """A workflow of standardised usage: its Snakefile, configuration, rules, settings, and two words in the README."""
    assert (ROOT / "workflow" / "Snakefile").is_file()
    assert (ROOT / "config" / "README.md").is_file()
    assert list((ROOT / "workflow" / "rules").glob("*.smk"))
    settings = yaml.safe_load((ROOT / ".snakemake-workflow-catalog.yml").read_text(encoding="utf-8"))
    assert settings["usage"]["software-stack-deployment"]["conda"] is True
    readme = (ROOT / "README.md").read_text(encoding="utf-8").lower()
    assert {"snakemake", "workflow"} <= set(re.findall(r"\w+", readme))


def test_environments_of_jobs_are_those_of_the_package():
    """Conda's names differ in case, and by a matplotlib without a window system."""
    listed = yaml.safe_load((ROOT / "workflow" / "envs" / "knitstudy.yaml").read_text(encoding="utf-8"))
    of_jobs = {line.replace("matplotlib-base", "matplotlib") for line in listed["dependencies"]}
    asked = [*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["pictures"]]
    assert of_jobs == {f"python{PROJECT['requires-python']}", *map(str.lower, asked)}


if __name__ == "__main__":
    CODEMETA.write_text(json.dumps(codemeta(), indent=2) + "\n", encoding="utf-8")
