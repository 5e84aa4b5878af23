"""Errata and claims name only tests and commands that exist, and each equation is counted."""

from pathlib import Path

import pytest
import thesis_map
import thesis_pages

ROOT = Path(__file__).resolve().parents[2]


def test_pages_name_tests_and_commands_that_exist():
    assert thesis_pages.problems(ROOT) == []


def test_every_equation_has_a_row_or_a_reason(capsys):
    tags, _ = thesis_map.scan(ROOT)
    assert thesis_map.accounted(tags, thesis_map.read_without(ROOT)) == (168, [])


@pytest.mark.parametrize(
    ("what", "why"),
    [
        ("test_that_nobody_wrote", "no function"),
        ("python benches/experiments/none.py", "no such script"),
        ("python benches/experiments/run_all.py figure_99", "no such experiment"),
        ("cargo test -p sphereflow-none", "no such package"),
        ("cargo test -p sphereflow-observers nothing_like_it", "no test matches"),
        ("cargo bench --bench none", "no such bench"),
        ("pytest tests/none.py", "no such file"),
        ("make none", "no such target"),
        ("look at it", "neither"),
    ],
)
def test_what_does_not_exist_is_named(what, why):
    assert why in thesis_pages.missing(ROOT, what, *thesis_pages.known(ROOT))


def test_rows_without_a_test_are_named(tmp_path):
    for page in thesis_pages.PAGES:
        (tmp_path / page).parent.mkdir(exist_ok=True)
        (tmp_path / page).write_text(
            "| 1 | (1.1) | x | holds | - |\n| 3 | (1.2) | not shown | - |\n"
        )
    found = thesis_pages.problems(tmp_path)
    assert any("row 1: names no test" in problem for problem in found)
    assert not any("row 3: names no test" in problem for problem in found)
    assert any("numbered" in problem for problem in found)
    assert any("at least 54" in problem for problem in found)
