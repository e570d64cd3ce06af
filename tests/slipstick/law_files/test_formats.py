"""Files of laws are read by the programs that they are for, with the same numbers."""

import csv
import io
import os
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rumoca
from scipy.io import loadmat

from slipstick.clutch.effects.effect import DEPENDENCES, QUANTITIES, SENSORS
from slipstick.errors import InvalidValue
from slipstick.law_files import FORMATS, LawTable, identifier, write_law

LAW = LawTable("friction coefficient", "slip", [0.0, 0.1, 12.5, 1e3], "rad/s", [0.3, -1e-5, 1 / 3, -2.0], "1", True,
               [0.2, -0.1, 0.3, -3.0], [0.4, 0.1, 0.4, -1.0], "99 % interval", [0.3, 0.0, 0.3, -2.0],
               "friction coefficient = alpha (1 + 0.3 exp(-slip))", "constant")
DRAG = LawTable("load torque", "output speed", [-20.0, 0.0, 60.0], "rad/s", [1.0, 2.0, 30.0], "N m", False)
HOSTILE = replace(LAW, quantity='a "b" \\ */ é\n end', depends_on="2nd // x\\", x_unit='"\\', band="*/ ?" "?/",
                  unit="m */ \" s")
SINGLE = replace(DRAG, x=[0.5], change=[3.0])
LAWS = pytest.mark.parametrize("law", [LAW, DRAG, HOSTILE, SINGLE], ids=["relative", "absolute", "hostile", "single"])


@LAWS
def test_numbers_come_back_equal_from_csv_and_matlab(law: LawTable) -> None:
    names = [column.name for column in law.columns]
    heads, *rows = csv.reader(io.StringIO(write_law(law, ".csv").decode()))
    assert heads == [f"{column.name} [{column.unit}]" for column in law.columns]
    assert np.array(rows, float).T.tolist() == [list(column.values) for column in law.columns]
    content = loadmat(io.BytesIO(write_law(law, ".mat")))
    assert [content[name].ravel().tolist() for name in names] == [list(column.values) for column in law.columns]
    assert (content["known_up_to"].item(), bool(content["relative"])) == (law.known_up_to, law.relative)


# Modelica.


@LAWS
def test_a_compiler_reads_the_modelica_file(law: LawTable) -> None:
    source = write_law(law, ".mo").decode()
    assert [each for each in rumoca.validate_source(source) if each.level == "error"] == []
    broken = source.replace("connect(u, table.u);", "connect(u table.u);")
    assert [each for each in rumoca.validate_source(broken) if each.level == "error"]


@LAWS
def test_the_modelica_table_has_the_numbers_and_an_output_for_each_column(law: LawTable) -> None:
    source = write_law(law, ".mo").decode()
    table = re.search(r"table = \[([^\]]*)\]", source)
    assert table is not None
    rows = [[float(number) for number in row.split(",")] for row in table[1].split(";")]
    assert np.array(rows).T.tolist() == [list(column.values) for column in law.columns]
    assert f"columns = 2:{len(law.columns)}," in source
    assert re.findall(r"RealOutput (\w+)", source) == ["y", *(each.name for each in law.columns[2:])]
    assert re.findall(r"connect\(table\.y\[(\d)\], (\w+)\);", source) == [
        (str(place), name) for place, name in enumerate(["y", *(each.name for each in law.columns[2:])], 1)]
    name, = re.findall(r"^block (\w+) ", source)
    assert re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII)
    assert source.endswith(f"end {name};\n")
    assert "Smoothness.LinearSegments" in source
    assert "Extrapolation.HoldLastPoint" in source


@pytest.mark.parametrize("unit", sorted({*QUANTITIES.values(), *SENSORS.values(), *DEPENDENCES.values()}
                                        - {"unit of the quantity"}))
def test_units_are_those_of_modelica(unit: str) -> None:
    source = write_law(replace(LAW, x_unit=unit), ".mo").decode()
    assert f'RealInput u(unit = "{unit.replace(" ", ".").replace("^", "")}") "slip [{unit}]";' in source


@pytest.mark.parametrize(("unit", "written"), [("N m/(s bar^2)", '(unit = "N.m/(s.bar2)")'), ("", '(unit = "1")'),
                                               ("°C", ""), ("m//s", ""), ("2 m", ""), ('m"', "")])
def test_a_unit_that_modelica_lacks_is_said_in_words_alone(unit: str, written: str) -> None:
    shown = (unit or "1").replace('"', '\\"')
    assert f'RealInput u{written} "slip [{shown}]";' in write_law(replace(LAW, x_unit=unit), ".mo").decode()


@pytest.mark.skipif("MODELICAPATH" not in os.environ,
                    reason="MODELICAPATH is not set to a folder with the Modelica Standard Library 4")
@LAWS
def test_a_simulation_in_modelica_has_the_law(law: LawTable) -> None:
    folder = Path(os.environ["MODELICAPATH"])
    roots = [str(path) for path in (folder / "Modelica", folder / "ModelicaServices", folder / "Complex.mo")]
    begin, span = law.x[0] - 1, law.x[-1] - law.x[0] + 2
    probe = (f"model Probe {law.name} law; output Real y; equation law.u = {begin!r} + {span!r} * time; y = law.y; "
             "end Probe;")
    model = rumoca.Session(roots=roots).loads(write_law(law, ".mo").decode() + probe, model="Probe")
    result = model.simulate(t=(0, 1), dt=0.01)
    np.testing.assert_allclose(result["y"], np.interp(begin + span * np.array(result.time), law.x, law.change),
                               atol=1e-9)


# C.


def read_in_c(law: LawTable, folder: Path, at: np.ndarray) -> np.ndarray:
    """Compile a program that includes the header twice, and return all columns, and the change at points."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("There is no C compiler `cc`")
    (folder / "law.h").write_bytes(write_law(law, ".h"))
    names = ["x", "y", *(column.name for column in law.columns[2:])]
    shown = "".join(f'for (int i = 0; i < {law.name}_count; ++i) printf("%.17g\\n", {law.name}_{name}[i]);'
                    for name in names)
    changes = "".join(f'printf("%.17g\\n", {law.name}_change({"0.0 / zero" if np.isnan(x) else repr(float(x))}));'
                      for x in at)
    (folder / "law.c").write_text('#include "law.h"\n#include "law.h"\n#include <stdio.h>\n'
                                  f"int main(void) {{ volatile double zero = 0.0; (void)zero; {shown} {changes} }}")
    subprocess.run([compiler, "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-std=c99", "-O2", "law.c", "-o", "law"],
                   cwd=folder, check=True, capture_output=True)
    printed = subprocess.run([folder / "law"], check=True, capture_output=True, text=True).stdout
    return np.array(printed.split(), float)


@LAWS
def test_the_c_header_compiles_without_warnings_and_has_the_law(law: LawTable, tmp_path: Path) -> None:
    x = np.array(law.x)
    outside = [x[0] - 1, x[-1] + 1, -1e300, 1e300, np.nan]
    at = np.concatenate([x, (x[1:] + x[:-1]) / 2, x[:-1] + 0.9 * np.diff(x), outside])
    numbers = read_in_c(law, tmp_path, at)
    columns, changes = np.split(numbers, [len(law.columns) * len(x)])
    assert columns.tolist() == [value for column in law.columns for value in column.values]
    assert changes[:len(x)].tolist() == list(law.change)
    np.testing.assert_allclose(changes[:-1], np.interp(at[:-1], law.x, law.change), rtol=1e-13, atol=1e-15)
    assert np.isnan(changes[-1])


# What a file says of the law.


@pytest.mark.parametrize("suffix", [".mo", ".h"])
def test_comments_say_what_the_law_is_and_how_it_is_added(suffix: str) -> None:
    relative, absolute = (re.findall(r"^ *// (.*)$", write_law(law, suffix).decode(), re.M) for law in (LAW, DRAG))
    assert relative == [
        "Measured law: relative change y [1] of the friction coefficient over the slip [rad/s].",
        "In a model, friction coefficient * (1 + y) takes the place of the friction coefficient.",
        "It is linear between its points, and constant beyond them.",
        "lower, upper: 99 % interval.",
        "It is known up to a constant, which parameters of the model replace.",
        "Named effect: friction coefficient = alpha (1 + 0.3 exp(-slip))."]
    assert absolute == [
        "Measured law: change y [N m] of the load torque over the output speed [rad/s].",
        "In a model, load torque + y takes the place of the load torque.",
        "It is linear between its points, and constant beyond them."]


@pytest.mark.parametrize(("changed", "message"), [
    ({"x": [0.0, 1.0]}, "columns of the lengths"), ({"x": [], "change": []}, "columns of the lengths"),
    ({"x": [0.0, 2.0, 2.0]}, "do not rise"), ({"change": [0.0, float("nan"), 1.0]}, "not finite"),
    ({"upper": [0.0, 1.0, float("inf")]}, "not finite")])
def test_a_table_that_other_programs_would_misread_is_refused(changed: dict[str, list[float]], message: str) -> None:
    with pytest.raises(InvalidValue, match=message):
        replace(DRAG, **changed)  # type: ignore[arg-type]


@pytest.mark.parametrize(("words", "name"), [
    ("output speed", "output_speed"), ("2nd gear", "law_2nd_gear"), ("ω", "law_"), ("(a) / b²", "a_b")])
def test_names_are_those_of_all_programs(words: str, name: str) -> None:
    assert identifier(words) == name


def test_an_unknown_format_is_refused() -> None:
    assert list(FORMATS) == [".csv", ".mat", ".mo", ".h"]
    with pytest.raises(InvalidValue, match=r"'\.xls' is no format of a law"):
        write_law(LAW, ".xls")
