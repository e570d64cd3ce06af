"""Uploaded tables as files: damaged ones are refused or read without difference, and what a plain table must have."""

import io
import json
import os

import h5py
import numpy as np
import pytest

from benchmarks import damaged_tables
from benchmarks.damaged_tables import HEADER, outcome, outcomes, plain_table
from slipstick.errors import BadTable, InvalidValue, RefusedTable
from slipstick.table import Axis, ForeignModel, Grid, Table, upload
from tests.benches import HEAVY, NOMINAL

REFUSED, FAILED, SAME, DIFFERENT = HEADER[3:]


@pytest.fixture(scope="module")
def plain() -> bytes:
    return plain_table()


def changed(content: bytes, edit) -> bytes:
    memory = io.BytesIO(content)
    with h5py.File(memory, "r+", libver=("v110", "v110")) as file:
        edit(file)
    return memory.getvalue()


def test_damaged_tables_are_refused_or_read_without_difference() -> None:
    found = outcomes(48, seed=2)
    ends = {end: sum(count for (*_, column), count in found.items() if column == end) for end in HEADER[3:]}
    assert ends[FAILED] == ends[DIFFERENT] == 0
    assert ends[REFUSED] + ends[SAME] == 48
    assert ends[REFUSED] > 40


def test_a_difference_and_a_crash_would_be_seen(plain: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    digest = upload.read(plain).digest
    other = changed(plain, lambda file: file["times"].__setitem__((0, 0, 0), 9.0))
    assert [outcome(plain, digest), outcome(other, digest), outcome(b"", digest)] == [SAME, DIFFERENT, REFUSED]
    monkeypatch.setattr(damaged_tables, "rewritten", lambda _: os._exit(1))
    assert outcome(plain, digest) == FAILED


def test_the_child_process_reads_the_same(plain: bytes) -> None:
    digest, written = upload.verified(plain)
    assert upload.read(written).digest == digest == upload.read(plain).digest
    with pytest.raises(RefusedTable, match="damaged"):
        upload.verified(plain[:-100])


@pytest.mark.parametrize(("edit", "says"), [
    (lambda file: file.attrs.__setitem__("layout_version", 2), "layout version 2"),
    (lambda file: file.attrs.__setitem__("model", np.bytes_(b"no JSON")), "not JSON"),
    (lambda file: file.attrs.__setitem__("model", np.bytes_(b'{"bench": 1}')), "key 'bench'"),
    (lambda file: file.attrs.__setitem__("model", np.bytes_(b'{"a": {"b": 1}}')), "texts and numbers"),
    (lambda file: file.attrs.__setitem__("model", np.bytes_(b'{"a": NaN}')), "NaN"),
    (lambda file: file.attrs.__setitem__("model", np.bytes_(rb'{"a": "\ud800"}')), "not JSON"),
    (lambda file: file.attrs.__setitem__("model", "{}"), "no fixed length"),
    (lambda file: file.attrs.__setitem__("origin", np.bytes_(b"\xff")), "damaged"),
    (lambda file: file["axes"].attrs.__setitem__("order", np.bytes_(b'["a b"]')), "no name of an axis"),
    (lambda file: file["axes"].attrs.__setitem__("order", np.bytes_(b'"ab"')), "no JSON array"),
    (lambda file: file["axes"].attrs.__setitem__("order", np.bytes_(json.dumps(["a"] * 21).encode())), "21 axes"),
    (lambda file: file["axes/rotor_inertia"].attrs.__setitem__("nominal_units", np.bytes_(b"")), "no unit"),
    (lambda file: file["times"].__setitem__((0, 0, 0), 0.0), "not positive"),
    (lambda file: file["times"].__setitem__((0, 0, 0), np.inf), "infinite"),
    (lambda file: file["axes/rotor_inertia"].__setitem__(0, 2.0), "do not increase"),
    (lambda file: file.create_dataset("more", data=[1.0]), "'more' has no checksums")])
def test_an_invalid_plain_table_is_refused_with_the_reason(plain: bytes, edit, says: str) -> None:
    with pytest.raises(BadTable, match=says) as caught:
        upload.read(changed(plain, edit))
    assert caught.value.remedy


def test_a_time_may_be_missing(plain: bytes) -> None:
    table = upload.read(changed(plain, lambda file: file["times"].__setitem__((0, 0, 0), np.nan)))
    assert isinstance(table, Grid)
    assert (table.status[0, 0, 0], table.status.sum()) == (1, 1)


def test_an_axis_of_a_table_of_slipstick_is_a_parameter_of_its_model() -> None:
    def written(name: str, nominal: float, unit: str) -> bytes:
        axes = (Axis(name, np.array([0.5, 1.5]), nominal, unit),)
        file = io.BytesIO()
        Grid(axes, np.ones((2, 1)), np.zeros((2, 1), np.uint8), HEAVY.conditions.take([0]), NOMINAL).write_to(file)
        return file.getvalue()

    assert upload.read(written("pressure_bias", 1.6, "bar")).axes[0].nominal == 1.6
    for wrong in (("pressure", 1.6, "bar"), ("pressure_bias", 2.0, "bar"), ("pressure_bias", 1.6, "Pa")):
        with pytest.raises(BadTable, match="no parameter of the model"):
            upload.read(written(*wrong))


def test_equal_descriptions_are_equal_models(plain: bytes, tmp_path) -> None:
    assert ForeignModel('{"b": 1, "a": 2}') == ForeignModel('{"a":2,"b":1}')
    assert ForeignModel("{}").digest != ForeignModel('{"a": 1}').digest
    with pytest.raises(InvalidValue):
        ForeignModel("[]")
    upload.read(plain).write(tmp_path / "motor.h5")
    assert Table.open(tmp_path / "motor.h5").digest == upload.read(plain).digest
