"""Consistency of documentation and code: effects, settings, commands, routes, parameters and numbers."""

import os
import re
import runpy
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

from evidence import pages
from evidence.tables import read_rates
from service.app import create_app
from service.settings import Settings
from slipstick import __version__
from slipstick.bench import parameters
from slipstick.building.surrogates import HELD_OUT, RUNS, STEPS
from slipstick.building.training import BATCH, RATE, WIDTHS
from slipstick.clutch.effects import effect
from slipstick.clutch.effects.effect import QUANTITIES
from slipstick.clutch.ensemble import DEFAULT, TIGHT
from slipstick.clutch.laws import DEPENDENCES
from slipstick.recordings.signals import SIGNAL_UNITS
from slipstick.report.study.limits import limits
from slipstick.uncertainty.chaos import ORDER, ExpansionSettings
from slipstick.uncertainty.fit.intervals import drop_at_level
from slipstick.uncertainty.likelihood import TOLERANCE
from slipstick.uncertainty.likelihood.line_rules import ACROSS
from tests.benches import HEAVY
from worker.__main__ import COMMANDS

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
FOLDERS = (ROOT, DOCS, *(ROOT / name for name in ("tables", "benchmarks", "evidence")))
PAGES = sorted(path for folder in FOLDERS for path in folder.glob("*.md"))


def rows(page: str, heading: str) -> list[tuple[str, ...]]:
    """The body of the first table under a heading, its cells without backticks."""
    text = re.split(rf"^#+ {heading}$", (DOCS / page).read_text(), flags=re.MULTILINE)[1]
    table = re.search(r"^\|[ -|]*---[ -|]*\n((?:\|.*\n)+)", text, re.MULTILINE)
    assert table
    lines = (line.removeprefix("|").removesuffix("|") for line in table[1].splitlines())
    return [tuple(cell.strip().strip("`") for cell in line.split("|")) for line in lines]


def test_every_parameter_is_in_the_nomenclature() -> None:
    assert rows("nomenclature.md", "Parameters") == [
        (entry.symbol, entry.name, entry.unit, f"{value:g}", entry.meaning,
         "yes" if entry.name in parameters.UNCERTAIN else "")
        for entry, value in zip(parameters.PARAMETERS, HEAVY.physics.nominal, strict=True)]


def test_every_measured_signal_is_in_the_nomenclature() -> None:
    measured = {row[1]: row[2] for row in rows("nomenclature.md", "States and signals") if row[-1] == "yes"}
    assert measured == {**SIGNAL_UNITS, "shifting_time": "s"}


def test_the_page_of_effects_is_up_to_date() -> None:
    text = (DOCS / "effects.md").read_text()
    assert text == runpy.run_path(str(DOCS / "effects.py"))["page"](), "python docs/effects.py > docs/effects.md"


def test_numbers_in_the_documentation_match_the_code() -> None:
    text = " ".join((DOCS / "equations.md").read_text().split())
    for passage in (f"at most {1e3 * DEFAULT.coarse:g} ms (`DEFAULT`) or {1e3 * TIGHT.coarse:g} ms (`TIGHT`)",
                    f"at least {1e3 * DEFAULT.fine:g} ms or {1e3 * TIGHT.fine:g} ms unless",
                    f"({HEAVY.profiles[0].max():g} s in", f"Latin hypercube of {RUNS:,} points", f"{STEPS:,} steps",
                    f"at {HELD_OUT:,} independent", f"batches of {BATCH} points", f"falling from {RATE:g} to 0",
                    f"hidden layers of {WIDTHS[0]} units"):
        assert passage in text
    text = " ".join((DOCS / "uncertainty.md").read_text().split())
    for said in (f"order {ORDER} and {ORDER + 1} nodes", f"seeded quasi-random samples, by default {ACROSS}",
                 f"until the error is below {TOLERANCE} decades", f"{drop_at_level(0.9):.2f} decades for 90 %",
                 f"{ExpansionSettings().checks} further runs"):
        assert said in text


@pytest.mark.parametrize("page", pages.PARTS)
def test_rates_and_confidence_are_those_of_the_tables(page: str) -> None:
    assert (ROOT / page).read_text() == pages.render_page(page), "python -m evidence.pages"


def test_a_page_without_marks_is_refused_and_other_text_stays() -> None:
    text = "before\n<!-- rates -->\nold\n<!-- /rates -->\nafter"
    assert pages.replace_part(text, "rates", "new") == "before\n<!-- rates -->\n\nnew\n\n<!-- /rates -->\nafter"
    with pytest.raises(ValueError, match="needs one"):
        pages.replace_part(text, "confidence", "new")


@pytest.mark.parametrize(("suite", "what"), [("two_effects", "both visible: both in the answer"),
                                             ("one_unknown_effect", "visible: a name of the catalogue")])
def test_rates_that_a_report_states_are_those_of_the_table(suite: str, what: str) -> None:
    rate, = (each for each in read_rates(pages.TABLE)
             if (each.suite, each.what, each.stage) == (suite, what, "reported"))
    assert f"{rate.hits} of {rate.of}" in " ".join(text for _, text in limits({"run_order": None}))


def test_every_setting_is_documented_with_its_default(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in os.environ if name.startswith("SLIPSTICK_")]:
        monkeypatch.delenv(name)
    documented = {variable: default for variable, default, _ in rows("settings.md", "Service")}
    assert documented == {f"SLIPSTICK_{name.upper()}": str(value) for name, value in Settings()}


def test_every_command_is_documented() -> None:
    assert dict(rows("settings.md", "Commands")) == COMMANDS


def test_every_route_and_every_error_status_is_documented(tmp_path: Path) -> None:
    routes = create_app(Settings(tables=tmp_path)).openapi()["paths"]
    operations = {(method.upper(), path): operation for path, methods in routes.items()
                  for method, operation in methods.items()}
    many = {"FILES": ("benches", "tables", "recordings"), "JOBS": ("fits", "studies", "calibrations", "builds")}
    documented = [
        (method, path.replace(word, resource)) for methods, paths, _ in rows("rest.md", "Operations")
        for method in methods.split(", ") for path in re.findall("/[^`,]+", paths)
        for word in [path.split("/")[2] if path.count("/") > 1 else path] for resource in many.get(word, (word,))]
    assert sorted(documented) == sorted(operations)
    errors = {status for operation in operations.values() for status in operation["responses"] if status >= "400"}
    anywhere = {"405", "408", "421"}  # of any body or address: no operation lists them
    assert errors | anywhere == {status for status, _ in rows("rest.md", "Error responses")}


@pytest.mark.slow
def test_the_example_of_the_walkthrough_works(tmp_path: Path) -> None:
    # According to the walkthrough one new file is enough: add it to a copy and run the tests there.
    text = (DOCS / "add_an_effect.md").read_text()
    path, = re.findall(r"Save as\n`(slipstick/clutch/effects/\w+\.py)`", text)
    code, = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    ignored = shutil.ignore_patterns("__pycache__")
    for folder in ("slipstick", "tests/slipstick/clutch"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=ignored)
    (tmp_path / "docs").mkdir()
    (tmp_path / "tables").mkdir()
    for file in ("docs/effects.py", "tests/benches.py", "tables/heavy.toml", "tables/compact.toml"):
        shutil.copy(ROOT / file, tmp_path / file)
    assert not (tmp_path / path).exists()
    (tmp_path / path).write_text(code)
    name = Path(path).stem
    selection = f"{name} or every_effect_is_described"
    tests = subprocess.run(
        [sys.executable, "-m", "pytest", "-v", "-p", "no:cacheprovider", "--rootdir", str(tmp_path),
         "tests/slipstick/clutch", "-k", selection], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert tests.returncode == 0, tests.stdout
    assert re.search(rf"bit_identical_to_the_papers_model\[{name}\] PASSED", tests.stdout)
    page = subprocess.run([sys.executable, "docs/effects.py"], cwd=tmp_path, capture_output=True, text=True,
                          env={**os.environ, "PYTHONPATH": str(tmp_path)}, check=True).stdout
    assert f"## {name}\n" in page


def test_the_walkthrough_lists_every_quantity() -> None:
    listed = rows("add_an_effect.md", "1. Choose the quantity it changes")
    assert {name: unit for name, unit, _ in listed} == QUANTITIES


def test_every_dependence_of_a_measured_law_is_documented() -> None:
    assert {name: unit for name, unit, _ in rows("equations.md", "Measured laws")} == DEPENDENCES


def test_the_walkthrough_lists_every_dependence() -> None:
    others = {name: unit for name, unit, _ in rows("add_an_effect.md", "What it depends on")}
    assert effect.SCALAR_DEPENDENCES | others == effect.DEPENDENCES
    text = (DOCS / "add_an_effect.md").read_text().split("### What it depends on")[1].split("| dependence")[0]
    assert set(re.findall(r"`([a-z ]+)`", text)) == {*effect.SCALAR_DEPENDENCES}


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    for link in re.findall(r"\]\(([^)]+)\)", page.read_text()):
        target, _, anchor = link.partition("#")
        if not target.startswith(("http:", "https:")):
            place = page.parent / target if target else page
            assert place.exists(), link
            headings = re.findall(r"^#+ (.*)$", place.read_text(), re.MULTILINE) if anchor else []
            assert not anchor or anchor in {re.sub(r"[^\w -]", "", line).lower().replace(" ", "-")
                                            for line in headings}, link


def test_one_version_everywhere() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    newest = re.search(r"^## \[(.+?)\]", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert newest
    assert {project["version"], citation["version"], newest[1]} == {__version__}
