import csv

import pytest

from archord.report.files import write_report
from archord.report.table import Table

ROWS = [{"case": "one", "P": 1.5, "said": "a|b"}, {"case": "two, three", "P": "", "said": ""}]


def test_a_bar_in_a_cell_makes_no_column():
    from markdown_it import MarkdownIt

    html = MarkdownIt("commonmark").enable("table").render(Table.of(ROWS).markdown())
    assert html.count("<th>") == 3
    assert html.count("<td>") == 6
    assert "<td>a|b</td>" in html


def test_numbers_end_and_words_begin_in_one_column():
    lines = str(Table("name", "P", rows=[("a", 1), ("long name", 100)], left=1)).splitlines()
    assert lines == ["name         P", "a            1", "long name  100"]


def test_a_row_of_another_length_is_refused():
    with pytest.raises(ValueError, match="2 cells under 1 headings"):
        Table("P").add(1, 2)


def test_csv_gives_the_rows_again(tmp_path):
    drawn = []
    files = write_report(tmp_path / "new" / "folder", "costs", ROWS, "words\n", drawn.append)
    assert [file.name for file in files] == ["costs.csv", "costs.md", "costs.png"]
    assert drawn == files[2:]
    with files[0].open(newline="", encoding="utf-8") as file:
        assert list(csv.DictReader(file)) == [
            {name: str(value) for name, value in row.items()} for row in ROWS
        ]
    assert files[1].read_text(encoding="utf-8") == "words\n"
    assert len(write_report(tmp_path, "costs", ROWS, "words\n")) == 2


def test_a_heading_may_have_the_format_of_its_numbers():
    table = Table(
        "case", "error {:.1e}", "force [N] {:+.3f}", rows=[("a", 0.00123, 2), ("b", "-", "")]
    )
    lines = table.markdown().splitlines()
    assert lines[0] == "| case | error | force [N] |"
    assert lines[2:] == ["| a | 1.2e-03 | +2.000 |", "| b | - |  |"]
