"""The public interface: its names, their signatures, what importing them costs, and the page that describes them."""

import importlib
import inspect
import pkgutil
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

import slipstick

ROOT = Path(__file__).parents[1]
SIGNATURES: dict[str, str] = {
    "build": "(machine, axes=None, *, model=None, conditions=None, out=None, accuracy='default', threads=None, "
             "executor=None, progress=True)",
    "calibrate": "(bench, recordings, *, model=None, budget=None, progress=True, executor=None)",
    "fit": "(simulator, recordings, parameters=None, *, model=None, outside='clip', settings=None, "
             "budget=None, progress=True, name='recordings', **changed)",
    "likelihood": "(table, recordings, mean, std=None, output_std=None, *, families=None, mixing=None, "
             "correlation=None, support=None, method='auto', outside='clip', order=None, norm=1.0, rule=None, "
             "nodes=None, runs=None, lines=64, samples=4096, seed=1, name='recordings')",
    "open_result": "(path)",
    "propagate": "(table, mean, std=None, *, families=None, mixing=None, correlation=None, support=None, "
             "output_std=None, conditions=None, order=None, norm=1.0, rule=None, nodes=None, runs=None, "
             "tolerance=None, quantiles=(0.05, 0.5, 0.95), density_points=161, samples=4096, seed=1, "
             "outside='clip', coefficients=False, name=None)",
    "simulate": "(bench, effects=(), *, model=None, conditions=None, engagements=None, scatter=0.02, noise=1.0, "
             "seed=0, runs=None)",
    "study": "(bench, recordings, *, settings=None, budget=None, progress=True, name='recordings', executor=None, "
             "**changed)",
}


@pytest.mark.parametrize("name", SIGNATURES)
def test_a_function_has_the_arguments_that_users_write(name: str) -> None:
    given = inspect.signature(getattr(slipstick, name)).parameters.values()
    bare = inspect.Signature([parameter.replace(annotation=inspect.Parameter.empty) for parameter in given])
    assert str(bare) == SIGNATURES[name]


def test_the_public_names_are_listed_and_documented() -> None:
    assert set(slipstick.__all__) == {"Bench", "Recordings", "BlackBox", "Machine", "Runs", "Table", *SIGNATURES}
    assert set(slipstick.__all__) <= set(dir(slipstick))
    for name in slipstick.__all__:
        assert inspect.getdoc(getattr(slipstick, name)), name
    for name in ("Bench", "Recordings", "BlackBox", "Machine", "Runs", "Table"):
        assert inspect.isclass(getattr(slipstick, name))
        assert callable(getattr(slipstick, name).open)
    with pytest.raises(AttributeError, match="cake"):
        _ = slipstick.cake  # type: ignore[attr-defined]


def test_no_import_of_a_submodule_rebinds_a_public_name() -> None:
    names = [module.name for module in pkgutil.walk_packages(slipstick.__path__, "slipstick.")]
    assert len(names) > 200
    for name in names:
        importlib.import_module(name)
    for name in slipstick.__all__:
        assert inspect.isfunction(getattr(slipstick, name)) or inspect.isclass(getattr(slipstick, name)), name


def test_the_import_loads_nothing_that_takes_time() -> None:
    code = "import slipstick, sys; print(sorted({name.split('.')[0] for name in sys.modules}))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    for library in ("numpy", "scipy", "numba", "h5py", "chaospy", "pint"):
        assert f"'{library}'" not in loaded


def test_the_page_is_that_of_the_docstrings() -> None:
    page = runpy.run_path(str(ROOT / "docs" / "python.py"))["page"]()
    assert (ROOT / "docs" / "python.md").read_text() == page, "python docs/python.py"
