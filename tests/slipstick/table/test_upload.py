"""Uploaded tables as files: damaged ones are refused or read without difference, and what a plain table must have."""

import io
import json
import os

import h5py
import numpy as np
import pytest

from evidence.robustness import damaged_tables
from evidence.robustness.damaged_tables import (
    DIFFERENT,
    FAILED,
    OUTCOMES,
    REFUSED,
    SAME,
    count_outcomes,
    make_plain_table,
    try_upload,
)
from slipstick.black_box import BlackBoxDescription, Cases, Input, Quantity
from slipstick.errors import BadTable, InvalidValue, RefusedTable
from slipstick.table import Axis, Grid, Table, upload
from tests.benches import HEAVY, NOMINAL


@pytest.fixture(scope="module")
def plain() -> bytes:
    return make_plain_table()


def changed(content: bytes, edit) -> bytes:
    memory = io.BytesIO(content)
    with h5py.File(memory, "r+", libver=("v110", "v110")) as file:
        edit(file)
    return memory.getvalue()


@pytest.mark.parametrize("files", [16, pytest.param(480, marks=pytest.mark.slow)])
def test_damaged_tables_are_refused_or_read_without_difference(files: int) -> None:
    counts = count_outcomes(files, seed=2)
    totals = {outcome: sum(count for (_, end), count in counts.items() if end == outcome) for outcome in OUTCOMES}
    assert totals[FAILED] == totals[DIFFERENT] == 0
    assert totals[REFUSED] + totals[SAME] == files
    assert totals[REFUSED] > 5 / 6 * files


def test_a_difference_and_a_crash_would_be_seen(plain: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    digest = upload.read(plain).digest
    other = changed(plain, lambda file: file["times"].__setitem__((0, 0, 0), 9.0))
    assert [try_upload(content, digest) for content in (plain, other, b"")] == [SAME, DIFFERENT, REFUSED]
    monkeypatch.setattr(damaged_tables, "rewritten", lambda _: os._exit(1))
    assert try_upload(plain, digest) == FAILED


def test_the_child_process_reads_the_same(plain: bytes) -> None:
    digest, written = upload.verify(plain)
    assert upload.read(written).digest == digest == upload.read(plain).digest
    with pytest.raises(RefusedTable, match="damaged"):
        upload.verify(plain[:-100])


@pytest.mark.parametrize(("edit", "says"), [
    (lambda file: file.attrs.__setitem__("layout_version", 2), "layout version 2"),
    (lambda file: file.attrs.__delitem__("title"), "'title' of '/' is missing"),
    (lambda file: file.attrs.__setitem__("title", np.bytes_(b"two\nlines")), "title or the simulator"),
    (lambda file: file.attrs.__setitem__("title", np.bytes_(b"")), "title or the simulator"),
    (lambda file: file.attrs.__setitem__("title", "text"), "no fixed length"),
    (lambda file: file.attrs.__setitem__("output", np.bytes_(b"speed")), "more than one thing: .*speed"),
    (lambda file: file.attrs.__setitem__("output", np.bytes_(b"a b")), "'a b' is not a valid name"),
    (lambda file: file["times"].attrs.__setitem__("units", np.bytes_(b"")), "not a unit of 'run_up_time'"),
    (lambda file: file["conditions"].attrs.__setitem__("order", np.bytes_(b'["speed", "weight"]')), "'conditions/w"),
    (lambda file: file["conditions"].attrs.__setitem__("order", np.bytes_(b'["../times"]')), "not a valid name"),
    (lambda file: file["conditions"].attrs.__setitem__("order", np.bytes_(b"[]")), "0 columns"),
    (lambda file: file["conditions/speed"].__setitem__(0, np.nan), "not finite"),
    (lambda file: file["axes/rotor_inertia"].attrs.__setitem__("nominal", 0.0), "other than 0|'rotor_inertia' is 0"),
    (lambda file: file.attrs.__setitem__("origin", np.bytes_(b"\xff")), "damaged"),
    (lambda file: file["axes"].attrs.__setitem__("order", np.bytes_(b'["a b"]')), "'a b' is not a valid name"),
    (lambda file: file["axes"].attrs.__setitem__("order", np.bytes_(b'"ab"')), "no JSON array"),
    (lambda file: file["axes"].attrs.__setitem__("order", np.bytes_(b'["torque_constant"]')),
     "'row_major_order' of 'times' does not name the axes and the conditions"),
    (lambda file: file["times"].attrs.__setitem__("column_major_order", np.bytes_(b"[]")),
     "row_major_order and column_major_order"),
    (lambda file: file["times"].attrs.__setitem__("row_major_order", np.bytes_(b'"condition"')), "does not name"),
    (lambda file: file["axes/rotor_inertia"].attrs.__setitem__("nominal", np.full(2, 0.05)), "not a single number"),
    (lambda file: file["axes/rotor_inertia"].attrs.__setitem__("nominal_units", np.bytes_(b"")), "not a unit"),
    (lambda file: file["times"].__setitem__((0, 0, 0), np.inf), "infinite"),
    (lambda file: file["axes/rotor_inertia"].__setitem__(0, 2.0), "do not increase"),
    (lambda file: file.create_dataset("more", data=[1.0]), "'more' has no checksums")])
def test_an_invalid_plain_table_is_refused_with_the_reason(plain: bytes, edit, says: str) -> None:
    with pytest.raises(BadTable, match=says) as caught:
        upload.read(changed(plain, edit))
    assert caught.value.remedy


NAMES = ["torque_constant", "rotor_inertia", "condition"]


def with_dimensions(content: bytes, stored: list[str], attribute: str | None, stated: list[str],
                    size: int | None = None) -> bytes:
    """The table with the dimensions of `times` stored in this order and stated so, cut to a cube of `size`."""
    def edit(file: h5py.File) -> None:
        values = file["times"][:size, :size, :size].transpose([NAMES.index(name) for name in stored])
        attributes = {"units": file["times"].attrs["units"]}
        if attribute is not None:
            attributes[attribute] = np.bytes_(json.dumps(stated))
        replaced = {"times": values}
        for folder, name in (("axes", "torque_constant"), ("axes", "rotor_inertia"), ("conditions", "speed"),
                             ("conditions", "load_inertia"), ("conditions", "brake_torque")):
            replaced[f"{folder}/{name}"] = file[f"{folder}/{name}"][:size]
        for path, array in replaced.items():
            kept = attributes if path == "times" else dict(file[path].attrs)
            del file[path]
            file.create_dataset(path, data=array, chunks=array.shape, fletcher32=True).attrs.update(kept)

    return changed(content, edit)


@pytest.mark.parametrize(("stored", "attribute", "stated"), [
    (NAMES, "row_major_order", NAMES),
    (NAMES[::-1], "row_major_order", NAMES[::-1]),
    (NAMES[::-1], "column_major_order", NAMES),  # MATLAB, Julia and Fortran
    (["rotor_inertia", "condition", "torque_constant"], "column_major_order",
     ["torque_constant", "condition", "rotor_inertia"])])
def test_the_names_of_the_dimensions_decide_also_for_a_cube(plain: bytes, stored: list[str], attribute: str,
                                                            stated: list[str]) -> None:
    with h5py.File(io.BytesIO(plain)) as file:
        times = file["times"][()]
    for size in (None, 4):
        table = upload.read(with_dimensions(plain, stored, attribute, stated, size))
        assert isinstance(table, Grid)
        np.testing.assert_array_equal(table.times, times[:size, :size, :size])
        assert table.times.flags.c_contiguous


@pytest.mark.parametrize("shape", [(-1, 1), (1, -1)])
def test_rows_and_columns_of_matlab_are_vectors(plain: bytes, shape: tuple[int, int]) -> None:
    def edit(file: h5py.File) -> None:
        for path in ("axes/torque_constant", "conditions/speed"):
            values, kept = file[path][()].reshape(shape), dict(file[path].attrs)
            del file[path]
            file.create_dataset(path, data=values, chunks=values.shape, fletcher32=True).attrs.update(kept)

    assert upload.read(changed(plain, edit)).digest == upload.read(plain).digest


def test_without_names_the_lengths_decide_unless_they_read_the_same_in_reverse(plain: bytes) -> None:
    digest = upload.read(plain).digest
    for stored in (NAMES, NAMES[::-1]):
        assert upload.read(with_dimensions(plain, stored, None, [])).digest == digest
        with pytest.raises(BadTable, match=r"\(4, 4, 4\) are the same in reverse") as caught:
            upload.read(with_dimensions(plain, stored, None, [], 4))
        assert '"torque_constant", "rotor_inertia", "condition"' in caught.value.remedy
        assert "'column_major_order' (MATLAB, Julia" in caught.value.remedy
    with pytest.raises(BadTable, match="'times' has shape"):
        upload.read(with_dimensions(plain, [NAMES[1], NAMES[0], NAMES[2]], None, []))




def test_a_single_value_may_be_an_array_of_length_one(plain: bytes) -> None:
    def edit(file: h5py.File) -> None:
        for item in (file, file["axes"], file["times"], file["axes/rotor_inertia"], file["conditions/speed"]):
            for name, value in list(item.attrs.items()):
                item.attrs[name] = np.array([value])

    assert upload.read(changed(plain, edit)).digest == upload.read(plain).digest


def test_a_long_name_does_not_fill_the_message(plain: bytes) -> None:
    table = upload.read(plain)
    file = io.BytesIO()
    table.write_to(file)
    long = np.bytes_(json.dumps(["a" * 60_000]))
    with pytest.raises(BadTable, match=r"'axes/a+\.\.\.' is missing") as caught:
        upload.read(changed(file.getvalue(), lambda file: file["axes"].attrs.__setitem__("order", long)))
    assert len(str(caught.value)) < 500
    for attribute in ("units", "b" * 60_000):
        with pytest.raises(BadTable) as caught:
            upload.read(changed(plain, lambda file, name=attribute: file["axes/rotor_inertia"].attrs.__setitem__(
                name, np.bytes_("c" * 60_000) if name == "units" else "text")))
        assert len(str(caught.value)) < 500


def test_a_time_may_be_missing(plain: bytes) -> None:
    table = upload.read(changed(plain, lambda file: file["times"].__setitem__((0, 0, 0), np.nan)))
    assert isinstance(table, Grid)
    assert (table.status[0, 0, 0], table.status.sum()) == (1, 1)


def test_an_output_may_be_negative_and_in_any_unit(plain: bytes) -> None:
    def edit(file: h5py.File) -> None:
        file["times"][0, 0, 0] = -1.0
        file["times"].attrs["units"] = np.bytes_(b"K")

    table = upload.read(changed(plain, edit))
    assert (table.output, table.interpolate(np.array([[0.8, 0.5]]))[0, 0]) == (Quantity("run_up_time", "K"), -1.0)


def test_the_number_of_axes_is_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    def written(count: int) -> bytes:
        inputs = tuple(Input(f"x{number}", "1", 1.0, 0.5, 1.5) for number in range(count))
        axes = tuple(Axis(one.name, np.array([0.5, 1.5]), 1.0, "1") for one in inputs)
        times = np.ones((2,) * count + (1,))
        model = BlackBoxDescription("many", inputs, (Quantity("b", "1"),), Quantity("c", "1"), "")
        file = io.BytesIO()
        Grid(axes, times, np.zeros(times.shape, np.uint8), Cases(model.columns, np.ones((1, 1))), model).write_to(file)
        return file.getvalue()

    assert len(upload.read(written(3)).axes) == 3
    monkeypatch.setattr(upload, "_MOST_AXES", 2)
    with pytest.raises(BadTable, match="3 axes"):
        upload.read(written(3))


@pytest.mark.parametrize(("key", "value", "says"), [
    ("title", 1, "not a text"), ("title", "\ud800", "not a text"), ("simulator", None, "not a text"),
    ("simulator", ["x"], "not a text"), ("output", {"name": "c", "unit": 1}, "not a unit"),
    ("output", {}, "incomplete"),
    ("inputs", [{"name": "a", "unit": "1", "nominal": "1", "lower": 0.5, "upper": 1.5}], "the input 'a' is 1 1|'a'"),
    ("inputs", [{"name": "a", "unit": "1", "nominal": float("inf"), "lower": 0.5, "upper": 1.5}], "'a' is inf"),
    ("inputs", 5, "incomplete"), ("columns", [{"name": "a/b", "unit": "1"}], "not a valid name")])
def test_a_hostile_description_of_a_machine_is_refused(key: str, value: object, says: str) -> None:
    model = BlackBoxDescription("m", (Input("a", "1", 1.0, 0.5, 1.5),), (Quantity("b", "1"),), Quantity("c", "1"), "s")
    assert BlackBoxDescription.from_spec(json.loads(json.dumps(model.spec()))) == model
    with pytest.raises(InvalidValue, match=says):
        BlackBoxDescription.from_spec({"machine": {**model.spec()["machine"], key: value}})


def test_an_axis_of_a_table_of_another_machine_is_one_of_its_inputs() -> None:
    model = BlackBoxDescription("m", (Input("a", "V", 2.0, 0.5, 1.5),), (Quantity("b", "1"),), Quantity("c", "1"), "s")

    def written(name: str, nominal: float, unit: str, column: str = "b") -> bytes:
        file = io.BytesIO()
        cases = Cases((Quantity(column, "1"),), np.ones((1, 1)))
        Grid((Axis(name, np.array([0.5, 1.5]), nominal, unit),), np.ones((2, 1)), np.zeros((2, 1), np.uint8), cases,
             model).write_to(file)
        return file.getvalue()

    assert upload.read(written("a", 2.0, "V")).model == model
    for wrong in (("b", 2.0, "V"), ("a", 1.0, "V"), ("a", 2.0, "A"), ("a", 2.0, "V", "d")):
        with pytest.raises(BadTable, match=r"There is no input|differs in its nominal|not the columns"):
            upload.read(written(*wrong))


def test_an_axis_of_a_table_of_slipstick_is_a_parameter_of_its_model() -> None:
    def written(name: str, nominal: float, unit: str) -> bytes:
        axes = (Axis(name, np.array([0.5, 1.5]), nominal, unit),)
        file = io.BytesIO()
        Grid(axes, np.ones((2, 1)), np.zeros((2, 1), np.uint8), HEAVY.conditions.take([0]), NOMINAL).write_to(file)
        return file.getvalue()

    assert upload.read(written("pressure_bias", 1.6, "bar")).axes[0].nominal == 1.6
    for wrong in (("pressure", 1.6, "bar"), ("pressure_bias", 2.0, "bar"), ("pressure_bias", 1.6, "Pa")):
        with pytest.raises(BadTable, match=r"no parameter '|differs in its nominal value or unit"):
            upload.read(written(*wrong))


def test_equal_descriptions_are_equal_models(plain: bytes, tmp_path) -> None:
    table = upload.read(plain)
    origin = changed(plain, lambda file: file.attrs.__setitem__("origin", np.bytes_(b"x")))
    assert upload.read(origin).model == table.model
    other = upload.read(changed(plain, lambda file: file.attrs.__setitem__("title", np.bytes_(b"x"))))
    assert other.model.digest != table.model.digest
    table.save(tmp_path / "motor.h5")
    assert Table.open(tmp_path / "motor.h5").digest == table.digest
