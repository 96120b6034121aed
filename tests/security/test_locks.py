"""The locks: every package with the hashes of its files, installed with no other, and what is made of them."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
LOCKS = sorted(ROOT.glob("requirements*.lock"))
MAKEFILE = (ROOT / "Makefile").read_text()
PIN = re.compile(r"([a-z0-9][a-z0-9._-]*)==([^ ]+)(?: ; ([^\\]+))? \\")
HASH = re.compile(r"    --hash=sha256:[0-9a-f]{64}(?: \\)?")


def pins(lock: Path) -> dict[str, set[str]]:
    """Versions of each package."""
    found: dict[str, set[str]] = {}
    for match in filter(None, map(PIN.fullmatch, lock.read_text().splitlines())):
        found.setdefault(match[1], set()).add(match[2])
    return found


def test_there_is_a_lock_for_each_purpose() -> None:
    names = {path.name for path in LOCKS}
    assert names == {
        "requirements.lock",
        "requirements-build.lock",
        "requirements-compiler.lock",
        "requirements-dev.lock",
        "requirements-tools.lock",
    }


@pytest.mark.parametrize("lock", LOCKS, ids=lambda path: path.name)
def test_every_pin_has_hashes(lock: Path) -> None:
    lines = lock.read_text().splitlines()
    assert len(pins(lock)) > 0 or lock.name == "requirements-compiler.lock"
    for line, following in zip(lines, [*lines[1:], ""], strict=True):
        assert PIN.fullmatch(line) or HASH.fullmatch(line), line
        assert line.endswith("\\") == following.startswith("    --hash="), line


def test_the_locks_agree_on_versions() -> None:
    """Tests run with the versions that are installed, and are built with them."""
    tested = pins(ROOT / "requirements-dev.lock")
    for name in ("requirements.lock", "requirements-build.lock"):
        for package, versions in pins(ROOT / name).items():
            assert tested.get(package, versions) == versions, package
    assert pins(ROOT / "requirements.lock").keys() <= tested.keys()


def test_what_the_project_depends_on_is_pinned() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    groups = {
        "requirements.lock": project["project"]["dependencies"],
        "requirements-build.lock": [
            *project["build-system"]["requires"],
            *project["dependency-groups"]["build"],
        ],
        "requirements-compiler.lock": project["dependency-groups"]["compiler"],
        "requirements-dev.lock": project["dependency-groups"]["dev"],
        "requirements-tools.lock": project["dependency-groups"]["tools"],
    }
    for lock, wanted in groups.items():
        names = {re.sub(r"[-_.]+", "-", re.split(r"[<>=\[ ]", text)[0]).lower() for text in wanted}
        assert names <= pins(ROOT / lock).keys(), lock


def test_nothing_is_installed_without_hashes() -> None:
    installs = re.findall(r"^\t.*pip install.*$", MAKEFILE, re.MULTILINE)
    assert all(
        ("--require-hashes" in line or "--no-deps --no-build-isolation -e ." in line) for line in installs
    )
    assert len(re.findall(r"\(INSTALL\) -r requirements", MAKEFILE)) == len(LOCKS)
    assert re.search(r"^INSTALL := pip install .*--require-hashes$", MAKEFILE, re.MULTILINE)


@pytest.mark.slow
def test_a_file_with_another_hash_is_refused(tmp_path: Path) -> None:
    """pip itself, on a package of this test: the hash of a lock is checked also without an index."""
    package = tmp_path / "exchanged-1.0-py3-none-any.whl"
    package.write_bytes(b"not what was pinned")
    lock = tmp_path / "some.lock"
    lock.write_text(f"exchanged @ {package.as_uri()} \\\n    --hash=sha256:{'0' * 64}\n")
    command = [sys.executable, "-m", "pip", "download", "--no-deps", "--no-index", "--require-hashes"]
    done = subprocess.run(
        [*command, "-d", str(tmp_path / "out"), "-r", str(lock)], capture_output=True, text=True, check=False
    )
    assert done.returncode != 0 and "DO NOT MATCH THE HASHES" in done.stderr


def test_the_public_workflow_audits_and_lists_the_packages() -> None:
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "dependencies.yml").read_text())["jobs"]
    commands = [
        step["run"].split("#")[0].strip() for job in jobs.values() for step in job["steps"] if "run" in step
    ]
    assert sorted(commands) == ["make audit", "make check-lock", "make sbom"]
    for target in ("audit", "check-lock", "sbom", "lock"):
        assert re.search(rf"^{target}: ", MAKEFILE, re.MULTILINE), target
