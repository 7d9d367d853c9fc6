"""Tests of the record view without a browser: records in memory and records of slip."""

import numpy as np
import pandas as pd
from explorer_pages import STEP

import rsfstudy
from rsfstudy.explorer.record_view import RecordView

READING = {"normal_stress": "20 MPa"}
FIT = {"laws": ["slowness"], "stiffness": "0.04 MPa/um"}


def test_the_code_of_a_record_in_memory_uses_the_record():
    record = rsfstudy.read_record(STEP, **READING)
    view = RecordView.create_with_widget_state(record, FIT | {"end": 130.0, "after": "60 um"})
    assert view.format_equivalent_command_line().startswith("#")
    variables = {"record": record}
    exec(view.format_equivalent_python_code(), variables)
    assert variables["record"].time[-1] == 130.0
    assert variables["fit"].sizes["law"] == 1


def test_a_record_of_slip_is_read_with_the_stiffness(tmp_path):
    record = rsfstudy.read_record(STEP, **READING)
    slip = record.columns["displacement"] - record.columns["friction"] / 2e-3
    path = tmp_path / "slip.csv"
    columns = {"Time (s)": record.time, "Slip (um)": slip, "Friction": record.columns["friction"]}
    pd.DataFrame(columns).to_csv(path, index=False)
    view = RecordView.create_with_widget_state(path, {"stiffness": "2e-3 1/um", "after": "60 um"})
    reading = view.format_equivalent_python_code().partition("fit = ")[0]
    variables = {}
    exec(reading, variables)
    moved = variables["record"].columns["displacement"]
    np.testing.assert_allclose(moved, record.columns["displacement"], atol=1e-9)


def test_decimal_commas_open_the_card_of_the_columns(tmp_path):
    path = tmp_path / "comma.txt"
    lines = [f"{n},0\t{2 * n},5\t0,6{n % 2}" for n in range(30)]
    path.write_text("\n".join(["Time (s)\tLP displacement (um)\tFriction", *lines]))
    view = RecordView.create_with_widget_state(path, {})
    assert "select ',' as the Decimal separator in the card Columns" in view._alert.object
    assert not view._columns_card.collapsed
    read = RecordView.create_with_widget_state(path, {"decimal": ","})
    assert not read._alert.visible
    assert len(read._record) == 30
