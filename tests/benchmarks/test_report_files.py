import csv

from archord.benchmarks.report_files import markdown_table, rows_table, write_files

ROWS = [{"case": "one", "P": 1.5, "said": "a|b"}, {"case": "two, three", "P": "", "said": ""}]


def test_a_bar_in_a_cell_makes_no_column():
    from markdown_it import MarkdownIt

    html = MarkdownIt("commonmark").enable("table").render("\n".join(rows_table(ROWS)))
    assert html.count("<th>") == 3
    assert html.count("<td>") == 6
    assert "<td>a|b</td>" in html
    assert markdown_table(ROWS[0], []) == ["| case | P | said |", "|---|---|---|"]


def test_csv_gives_the_rows_again(tmp_path):
    drawn = []
    files = write_files(tmp_path / "new" / "folder", "costs", ROWS, "words\n", drawn.append)
    assert [file.name for file in files] == ["costs.csv", "costs.md", "costs.png"]
    assert drawn == files[2:]
    with files[0].open(newline="", encoding="utf-8") as file:
        assert list(csv.DictReader(file)) == [{name: str(value) for name, value in row.items()} for row in ROWS]
    assert files[1].read_text(encoding="utf-8") == "words\n"
    assert len(write_files(tmp_path, "costs", ROWS, "words\n")) == 2
