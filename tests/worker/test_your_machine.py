"""docs/your_machine.md: its commands are executed as written, and answer what the page says."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from slipstick.storage.shipped import FOLDER

pytestmark = pytest.mark.slow
PAGE = (Path(__file__).parents[2] / "docs" / "your_machine.md").read_text()
COMMANDS = "".join(re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL))
ANSWERS = re.findall(r"^> (.*)$", PAGE, re.MULTILINE)


def test_the_commands_answer_what_the_page_says(tmp_path: Path) -> None:
    paths = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    ran = subprocess.run(["bash", "-c", "set -e -o pipefail\n" + COMMANDS], cwd=tmp_path, capture_output=True,
                         text=True, env={**os.environ, "PATH": paths})
    assert ran.returncode == 0, ran.stderr
    assert len(ANSWERS) == 2
    for answer in ANSWERS:
        assert answer in ran.stdout
    assert (tmp_path / "mine.svg").exists()
    assert (tmp_path / "study.html").stat().st_size > 50_000
    assert (tmp_path / "laws" / "1_cooling_over_temperature.mo").exists()


def test_the_excerpt_is_that_of_the_template() -> None:
    excerpt, = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert excerpt in (FOLDER / "machines" / "heated_plate.py").read_text()
