"""Version, change log, citation and pinned packages agree with each other."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import yaml

from chefbot import __version__

ROOT = Path(__file__).parents[2]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())


def test_the_version_has_one_source() -> None:
    assert "version" not in PYPROJECT["project"] and PYPROJECT["project"]["dynamic"] == ["version"]
    assert PYPROJECT["tool"]["hatch"]["version"]["path"] == "src/chefbot/__init__.py"
    assert yaml.safe_load((ROOT / "CITATION.cff").read_text())["version"] == __version__


def test_the_change_log_has_the_version_and_dated_sections() -> None:
    headings = re.findall(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert headings[0] == "[Unreleased]"
    assert all(re.fullmatch(r"\[\d+\.\d+\.\d+\] - \d{4}-\d\d-\d\d", heading) for heading in headings[1:])
    assert any(heading.startswith(f"[{__version__}]") for heading in headings)


def test_the_packages_of_the_site_are_pinned() -> None:
    pinned = re.findall(r"^([\w-]+)==", (ROOT / "requirements-dev.lock").read_text(), re.MULTILINE)
    wanted = {re.split(r"[<>=]", name)[0] for name in PYPROJECT["project"]["optional-dependencies"]["docs"]}
    assert wanted <= set(pinned)


def test_workflows_and_forms_are_yaml() -> None:
    files = [*ROOT.glob(".github/**/*.yml"), ROOT / ".pre-commit-config.yaml"]
    assert len(files) >= 7
    assert all(isinstance(yaml.safe_load(path.read_text()), dict) for path in files)


def test_decisions_are_numbered_dated_and_listed() -> None:
    index = (ROOT / "docs" / "why.md").read_text()
    records = sorted((ROOT / "docs" / "decisions").glob("*.md"))
    assert [int(path.name[:4]) for path in records] == list(range(1, len(records) + 1))
    for path in records:
        text = path.read_text()
        assert re.match(rf"# {int(path.name[:4])}\. .+", text)
        assert re.search(r"^\| \d{4}-\d\d-\d\d \| (accepted|superseded by \d+) \| .+ \|$", text, re.MULTILINE)
        assert f"(decisions/{path.name})" in index and f"decisions/{path.stem}\n" in index
