"""Tests of printed tables.

Tables keep numbers, names and headings in one piece at any terminal width.
"""

import numpy as np
import pytest
import xarray as xr
from study_runs import call_main, named_results
from test_shown import rows as of_html

import rsfstudy
from rsfstudy import Scene
from rsfstudy.api import study_runs
from rsfstudy.cli import study_declarations, table_layout
from rsfstudy.cli.commands import rerun
from rsfstudy.formatting import format_overrides
from rsfstudy.measures import Outcome
from rsfstudy.reporting import (
    cell_tables,
    claim_verdict_tables,
    json_summaries,
    lattice_tables,
    reduction_tables,
)
from rsfstudy.reporting.text_tables import TextTable
from rsfstudy.status import Status
from rsfstudy.study import named_study_index, study_loader

WIDTHS = (40, 80)


@pytest.fixture
def printed(monkeypatch, capsys):
    """Return a function that prints at a given width and returns the lines.

    The function asserts that no line exceeds the width.
    """

    def at(width, say, *what) -> list[str]:
        monkeypatch.setenv("COLUMNS", str(width))
        capsys.readouterr()
        say(*what)
        lines = capsys.readouterr().out.splitlines()
        assert max(map(len, lines), default=0) <= width
        return lines

    return at


def pieces(table: TextTable) -> set[str]:
    """Return the texts that a table must not break.

    Sentences and headings may be broken between words.
    """
    found = {word for head in table.rows[0] for word in head.split()}
    for row in table.rows:
        for head, text in row.items():
            found |= set(text.split() if head in table.wrappable_columns else [text])
    return found


def in_one_piece(piece: str, lines: list[str]) -> bool:
    """Return True if a text occurs as a whole word on a line."""
    return any(f" {piece} " in f" {line} " for line in lines)


@pytest.mark.parametrize("name", named_study_index.list_study_names())
def test_results_of_every_study(name, printed, tmp_path_factory):
    dataset, _path = named_results(name, tmp_path_factory)
    shown = [
        lattice_tables.build_primary_output_table(dataset),
        *reduction_tables.build_reduction_tables(dataset),
        json_summaries.build_result_variables_table(dataset),
    ]
    shown += [claim_verdict_tables.build_claims_table(study_runs.check(dataset))]
    for table in (table for table in shown if table.rows):
        for width in WIDTHS:
            lines = printed(width, table_layout.print_table_or_sentence, table)
            assert not [piece for piece in pieces(table) if not in_one_piece(piece, lines)]


def test_declarations_of_every_study(printed, tmp_path):
    """The points of all axes are printed in one piece."""
    for name in named_study_index.list_study_names():
        study = study_loader.load_study(name)
        declared = study_declarations.StudyDeclaration(study, tmp_path)
        for width in WIDTHS:
            lines = printed(width, study_declarations.print_study_declaration, declared)
            for axis in study.axes:
                shown = (
                    axis.point_names
                    if len(axis) <= 40
                    else [*axis.point_names[:10], *axis.point_names[-3:]]
                )
                words = {word for point in shown for word in f"{point},".split()}
                last = str(shown[-1]).split()[-1]
                assert not [w for w in words if not in_one_piece(w, lines) and w != f"{last},"]


def test_where_no_cell_has_a_number_the_status_is_explained():
    dataset = xr.Dataset({"status": ("x", [3, 3]), "rhs_evaluations": ("x", [5, 5])})
    why = Status.NO_LIMIT_CYCLE.meaning
    work = "10 right-hand-side evaluations"
    assert cell_tables.format_status_counts(dataset) == f"2 no_limit_cycle ({why}); {work}"
    one = dataset.assign(status=("x", [0, 3]))
    assert (
        cell_tables.format_status_counts(one)
        == "1 ok, 1 no_limit_cycle; 10 right-hand-side evaluations"
    )


def test_a_relation_stays_with_its_number(printed):
    row = {"id": "C1", "claim": "a long sentence " * 9, "published": "< 1", "ours": "-4.56032e-07"}
    for width in range(16, 121):
        lines = printed(
            width,
            table_layout.print_table_or_sentence,
            TextTable([row, row], wrappable_columns={"claim"}),
        )
        assert sum(in_one_piece("< 1", [line]) for line in lines) == 2
        assert sum(in_one_piece("-4.56032e-07", [line]) for line in lines) == 2


def test_what_is_wider_than_the_terminal_is_there_to_its_last_character(printed):
    path = "/a/very/long/path" * 9
    lines = printed(40, table_layout.print_table_or_sentence, {"file": path})
    assert path in "".join("".join(lines).split())


def test_a_column_of_numbers_ends_at_one_place(printed):
    lines = printed(
        80,
        table_layout.print_table_or_sentence,
        TextTable([{"a": "x", "n": "1"}, {"a": "yy", "n": "-10.5"}]),
    )
    found = [line.rstrip() for line in lines[2:4]]
    width = len(found[0])  # The width depends on the version of rich.
    assert found == ["x" + "1".rjust(width - 1), "yy" + "-10.5".rjust(width - 2)]


def test_notebooks_show_the_same_claims(tmp_path_factory):
    dataset, _path = named_results("rate_step_boundary", tmp_path_factory)
    found = rsfstudy.check(dataset)
    shown = of_html(found._repr_html_())
    told = claim_verdict_tables.build_claims_table(found).rows
    assert [list(row.values()) for row in told] == [list(row) for row in shown[1:]]
    assert call_main("check", _path).returncode == 0


def test_a_cell_is_told_in_a_line_for_each_number_beside_that_of_its_file(printed):
    orbit, other = np.linspace(0.0, 2.0, 400), np.linspace(0.0, 3.0, 400)
    there = xr.Dataset({"interval": 1.5, "orbit": ("phase", other)})
    now = Outcome(Status.OK, {"interval": 1.5, "orbit": orbit})
    told = printed(80, rerun.print_recomputed_cell, Scene(), now, there)
    lines = [" ".join(line.split()) for line in told]
    assert "interval 1.5 same" in lines
    assert "orbit 400 values, 0 to 2 400 values, 0 to 3" in lines


def test_overrides_are_told_with_the_digits_a_reader_wants():
    """Numbers are rounded, and labels with digits are unchanged."""
    given = {"hold_time": ["464.15888336127773 s", "1e4 s"], "case": "alpha = 0.56", "a": 0.01}
    told = "hold_time=464.159 s,1e4 s, case=alpha = 0.56, a=0.01"
    assert format_overrides(given) == told
