"""What the gate between two work trees says of their numbers."""

import json
import math

import gate
import pytest

NAN, INFINITE = math.nan, math.inf


@pytest.mark.parametrize(
    ("reference", "ours", "off"),
    [
        ([1.0, 2.0], [1.0, 2.0], [0.0, 0.0]),
        ([1.0, -4.0], [1.0, -4.0 + 2.0**-10], [0.0, 2.0**-12]),
        ([0.0, -4.0], [2.0**-10, 4.0], [2.0**-12, 2.0]),
        ([NAN, INFINITE], [NAN, INFINITE], [0.0, 0.0]),
        ([NAN, 1.0, INFINITE], [1.0, NAN, -INFINITE], [INFINITE] * 3),
        ([1.0], [1.0, 2.0], [INFINITE] * 2),
        ([0.0], [1e-300], [INFINITE]),
    ],
)
def test_differences(reference, ours, off):
    assert gate.differences(reference, ours, 0.0) == off


def test_small_numbers_are_relative_to_what_is_stated():
    assert gate.differences([0.0], [0.5], 2.0) == [0.25]


def answers(kinds, values, **more):
    return {"texts": {"t": {"x": kinds}}, "numbers": {"n": {"x": [0.0, values], **more}}}


def test_groups_tell_what_is_identical_where_the_worst_is_and_what_one_tree_lacks():
    one = answers(["start"], [1.0, 2.0], gone=[0.0, [1.0]])
    other = answers(["end"], [1.0, 2.5], new=[0.0, [1.0]])
    found = dict(gate.compared(one, other))
    texts, numbers = found["t, texts"], found["n, numbers"]
    assert (texts.equal, texts.all, texts.worst) == (0, 1, INFINITE)
    assert (numbers.equal, numbers.all) == (1, 2)
    assert (numbers.worst, numbers.where) == (0.25, "x [1]")
    assert sorted(numbers.alone) == ["gone (of the reference)", "new (of this tree)"]
    # what was told is read from JSON
    assert json.loads(json.dumps(one)) == one


def test_a_tree_without_an_interpreter_is_told_what_it_needs(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.argv", ["gate.py", "compare", str(tmp_path)])
    with pytest.raises(SystemExit, match=r"no interpreter of its own.\nMake it: python -m venv"):
        gate.main()
