"""The map from thesis to code, on a small tree; the words of a tag are put together here so that
this file is not itself full of tags."""

from __future__ import annotations

import textwrap

import pytest
import thesis_map
from thesis_tags import citations

TAG = "Thesis" + ":"


def write(root, name, text):
    path = root / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(textwrap.dedent(text).replace("TAG", TAG))


@pytest.fixture
def tree(tmp_path):
    write(
        tmp_path,
        "crates/flow/src/depth.rs",
        """\
        //! Depth from flow.
        //! TAG section 3.1

        /// The observer's right-hand side.
        ///
        /// TAG eq. (3.7), eq. (3.10) and Theorem 2, with the corrected sign.
        #[inline]
        pub fn derivative(x: f64) -> f64 {
            // TAG eq. (2.9)
            x * 2.0
        }

        impl<T> Field<T> {
            /// TAG eq. (2.10).
            pub(crate) const fn of(self) {}
        }

        #[cfg(test)]
        mod tests {
            // TAG eq. (3.7)
            #[test]
            fn derivative_of_two_is_four() {}
        }
        """,
    )
    write(
        tmp_path,
        "tests/unit/test_depth.py",
        """\
        def test_depth_is_shown():
            # TAG eqs. (2.9), (2.10) and (3.10)
            assert True
        """,
    )
    write(tmp_path, "benches/speed.rs", "// TAG Table 6.1\nfn many() {}\n")
    return tmp_path


def run(root, *arguments):
    return thesis_map.main(["--root", str(root), *arguments])


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("eq. (3.7)", [("eq.", "3.7")]),
        ("eq. (3.7), section 5.4.1", [("eq.", "3.7"), ("section", "5.4.1")]),
        ("eqs. (1.16) and (1.17)", [("eq.", "1.16"), ("eq.", "1.17")]),
        (
            "Theorem 3, Table 6.1 and Figure 2.1",
            [("Theorem", "3"), ("Table", "6.1"), ("Figure", "2.1")],
        ),
        ("Figures 4.1 and 4.2: curves", [("Figure", "4.1"), ("Figure", "4.2")]),
        ("eq. (A.7): div(eta x P) = 0.5", [("eq.", "A.7")]),
        ("section 6.2, the table of 3.5", [("section", "6.2")]),
        ("eq. (7.1) to (7.4)", [("eq.", "7.1"), ("eq.", "7.4"), ("eq.", "7.2"), ("eq.", "7.3")]),
        ("eq. (1.4). u = fx x/z", [("eq.", "1.4")]),
        ("subsections 9.6.1 and 9.6.2", [("section", "9.6.1"), ("section", "9.6.2")]),
        ("appendix C, chapter 9", [("appendix", "C"), ("chapter", "9")]),
        ("eq. 3.7", []),
        ("the whole of it", []),
    ],
)
def test_citations_of_a_tag_are_found(text, expected):
    assert list(citations(text)) == expected


def test_map_of_a_tree_names_items_and_tests_in_the_thesis_order(tree):
    assert run(tree) == 0
    page = (tree / "THESIS.md").read_text()
    depth, shown = (
        "[crates/flow/src/depth.rs](crates/flow/src/depth.rs)",
        "tests/unit/test_depth.py",
    )
    assert f"| (2.9) | {depth} `derivative` | [{shown}]({shown}) `test_depth_is_shown` |" in page
    assert f"| (2.10) | {depth} `of` |" in page
    assert f"| (3.7) | {depth} `derivative` | {depth} `derivative_of_two_is_four` |" in page
    assert f"| 3.1 | {depth} | - |" in page
    assert "| 6.1 | [benches/speed.rs](benches/speed.rs) `many` | - |" in page
    assert page.index("(2.9)") < page.index("(2.10)") < page.index("(3.7)")
    assert page.index("## Equations") < page.index("## Theorems") < page.index("## Tables")


def test_check_passes_when_the_page_is_fresh_and_fails_when_it_is_stale(tree, capsys):
    assert run(tree, "--check") == 1
    assert "THESIS.md is stale" in capsys.readouterr().err
    assert run(tree) == 0
    assert run(tree, "--check") == 0
    write(tree, "python/sphereflow/new.py", "# TAG eq. (3.7)\ndef new(): ...\n")
    assert run(tree, "--check") == 1


def test_map_does_not_change_when_lines_move(tree):
    run(tree)
    before = (tree / "THESIS.md").read_text()
    source = tree / "crates/flow/src/depth.rs"
    source.write_text("\n\n\n" + source.read_text())
    run(tree)
    assert (tree / "THESIS.md").read_text() == before


@pytest.mark.parametrize(
    ("tag", "problem"),
    [
        ("eq. (3.11)", "the thesis has no eq. (3.11)"),
        ("section 5.4.9", "the thesis has no section 5.4.9"),
        ("Theorem 12", "the thesis has no Theorem 12"),
        ("the usual formula", "the tag cites nothing: 'the usual formula'"),
        ("eq. (9.4)", "eq. (9.4) is implemented, but no test names it"),
    ],
)
def test_check_fails_on_a_tag_that_is_not_true(tree, capsys, tag, problem):
    write(tree, "crates/flow/src/other.rs", f"/// TAG {tag}\npub fn other() {{}}\n")
    assert run(tree) == 1
    assert f"crates/flow/src/other.rs:1: {problem}" in capsys.readouterr().err
    assert run(tree, "--check") == 1


def test_tags_in_build_output_are_not_read(tree):
    run(tree)
    write(tree, "crates/target/debug/made.rs", "// TAG eq. (8.1)\nfn made() {}\n")
    assert run(tree, "--check") == 0
