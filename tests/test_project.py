"""The repository itself: lock files, versions, declared imports, links between documents."""

import ast
import re
import sys
import tomllib
from importlib.metadata import packages_distributions, version
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import radar_console

ROOT = Path(__file__).parents[1]
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
LOCKS = ("requirements.lock", "requirements-dev.lock", "requirements-bench.lock")


def locked(name: str) -> dict[str, Requirement]:
    """The pins of a lock file by package."""
    lines = (ROOT / name).read_text(encoding="utf-8").replace("\\\n", " ").splitlines()
    pins = [Requirement(line.split(" --hash")[0]) for line in lines]
    return {canonicalize_name(pin.name): pin for pin in pins}


def declared(texts: list[str]) -> list[Requirement]:
    return [Requirement(text) for text in texts]


@pytest.mark.parametrize("name", LOCKS)
def test_a_lock_file_holds_only_versions_and_hashes(name: str) -> None:
    pin = r"[a-z0-9.-]+==[\w.+!]+( ; [\w .'<>=!]+)? \\"
    file_hash = r"    --hash=sha256:[0-9a-f]{64}( \\)?"
    text = (ROOT / name).read_text(encoding="utf-8")
    assert [line for line in text.splitlines() if not re.fullmatch(f"{pin}|{file_hash}", line)] == []


@pytest.mark.parametrize("name", LOCKS)
def test_a_lock_file_satisfies_what_the_project_asks_for(name: str) -> None:
    asked = declared(PROJECT["project"]["dependencies"])
    if name == "requirements-dev.lock":
        asked += declared(PROJECT["dependency-groups"]["dev"] + PROJECT["build-system"]["requires"])
    if name == "requirements-bench.lock":
        asked += declared(PROJECT["project"]["optional-dependencies"]["bench"])
    pins = locked(name)
    for requirement in asked:
        (exact,) = pins[canonicalize_name(requirement.name)].specifier
        assert exact.operator == "=="
        assert requirement.specifier.contains(exact.version), requirement


@pytest.mark.parametrize("name", LOCKS[1:])
def test_developing_and_measuring_use_the_versions_that_run(name: str) -> None:
    run, other = locked(LOCKS[0]), locked(name)
    assert {name: str(pin.specifier) for name, pin in run.items()} == {
        name: str(other[name].specifier) for name in run
    }


def test_pyside_that_loses_references_to_none_is_excluded() -> None:
    asked = {pin.name: pin for pin in declared(PROJECT["project"]["dependencies"])}
    assert not asked["PySide6-Essentials"].specifier.contains("6.12.0")
    assert version("PySide6-Essentials") != "6.12.0"


def test_installed_version_is_the_declared_one() -> None:
    assert version("radar-console") == PROJECT["project"]["version"]


def test_only_declared_dependencies_are_imported() -> None:
    """What comes along with another package may be gone with its next version."""
    known = packages_distributions()
    allowed = {canonicalize_name(pin.name) for pin in declared(PROJECT["project"]["dependencies"])}
    # An extra is imported where it is used, which says what to install.
    allowed |= {
        canonicalize_name(pin.name)
        for pin in declared(PROJECT["project"]["optional-dependencies"]["cluster"])
    }
    # The type checkers' and validators' own cores are installed by, and versioned with, their front.
    allowed |= {"pydantic-core", "shiboken6"}
    package = Path(radar_console.__file__).parent
    foreign = {
        f"{file.relative_to(package)}: {name}"
        for file in package.rglob("*.py")
        for name in _imported(file)
        if name not in sys.stdlib_module_names
        and name != "radar_console"
        and not allowed & {canonicalize_name(owner) for owner in known.get(name, [])}
    }
    assert foreign == set()


def _imported(file: Path) -> set[str]:
    """Top-level names of the modules that a file imports."""
    names = set[str]()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            names.add(node.module.partition(".")[0])
    return names


DOCUMENTS = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda file: str(file.relative_to(ROOT)))
def test_links_between_documents_lead_somewhere(document: Path) -> None:
    targets = re.findall(r"\]\(([^)#\s]+)[^)]*\)", document.read_text(encoding="utf-8"))
    local = [target for target in targets if not re.match(r"[a-z]+:", target)]
    assert [target for target in local if not (document.parent / target).exists()] == []


def test_every_decision_is_in_the_index() -> None:
    folder = ROOT / "docs" / "decisions"
    index = (folder / "README.md").read_text(encoding="utf-8")
    assert [file.name for file in folder.glob("[0-9]*.md") if f"({file.name})" not in index] == []


def test_every_target_of_the_makefile_that_documents_name_exists() -> None:
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    named = {
        name
        for document in DOCUMENTS
        for name in re.findall(r"`make ([a-z]+)", document.read_text(encoding="utf-8"))
    }
    assert named
    assert named <= targets


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda file: str(file.relative_to(ROOT)))
def test_files_named_in_documents_exist(document: Path) -> None:
    """Paths in back quotes, such as `core/messages.py`, from the root, the package or `tests/`."""
    named = re.findall(r"`((?:[\w-]+/)+[\w-]+\.(?:py|toml|sh))\b", document.read_text(encoding="utf-8"))
    roots = (ROOT, ROOT / "radar_console")
    assert [name for name in named if not any((root / name).exists() for root in roots)] == []
