"""The map from thesis to code, on a small tree; the words of a tag are put together here so that
this file is not itself full of tags."""

from __future__ import annotations

import textwrap

import pytest
import thesis_map
from thesis_index import EXISTING
from thesis_tags import citations

TAG = "Thesis" + ":"


def write(root, name, text):
    path = root / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(textwrap.dedent(text).replace("TAG", TAG).replace("QUOTE", '"""'))


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


        def test_in_a_docstring():
            QUOTEWhat it is. TAG eq. (2.15), in a docstring. TAG eqs. (2.16) and
            (2.17), broken off.QUOTE
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

    def at(path, line, item="", own=None):
        return f"[{path}]({path}#L{line})" + (f" [`{item}`]({path}#L{own or line})" if item else "")

    depth, shown = "crates/flow/src/depth.rs", "tests/unit/test_depth.py"
    derivative, test = at(depth, 9, "derivative"), at(shown, 2, "test_depth_is_shown")
    assert f"| (2.9) | {at(depth, 9, 'derivative')} | {test} |" in page
    assert f"| (2.10) | {at(depth, 14, 'of')} |" in page
    assert f"| (3.7) | {at(depth, 6, 'derivative')} | " in page
    assert f"| {at(depth, 20, 'derivative_of_two_is_four')} |" in page
    assert f"| 3.1 | {at(depth, 2)} | - |" in page
    assert f"| 6.1 | {at('benches/speed.rs', 1, 'many')} | - |" in page
    assert f"| (2.15) | by test only | {at(shown, 7, 'test_in_a_docstring')} |" in page
    assert derivative in page
    assert page.index("(2.9)") < page.index("(2.10)") < page.index("(3.7)")
    assert page.index("## Equations") < page.index("## Theorems") < page.index("## Tables")


def test_check_passes_when_the_page_is_fresh_and_fails_when_it_is_stale(tree, capsys):
    assert run(tree, "--check") == 1
    assert "THESIS.md is stale" in capsys.readouterr().err
    assert run(tree) == 0
    assert run(tree, "--check") == 0
    write(tree, "python/sphereflow/new.py", "# TAG eq. (3.7)\ndef new(): ...\n")
    assert run(tree, "--check") == 1


def test_page_is_not_stale_when_lines_alone_move_and_links_follow_them_when_it_is_written(tree):
    run(tree)
    source = tree / "crates/flow/src/depth.rs"
    source.write_text("\n\n\n" + source.read_text())
    assert run(tree, "--check") == 0
    run(tree)
    assert "crates/flow/src/depth.rs#L12" in (tree / "THESIS.md").read_text()


def test_tags_in_mid_line_and_of_two_lines_are_read(tree):
    write(tree, "crates/a.rs", "/// The rate. TAG section\n/// 7.1.\nfn rate() {}\n")
    run(tree)
    page = (tree / "THESIS.md").read_text()
    assert "| 7.1 | [crates/a.rs](crates/a.rs#L1) [`rate`](crates/a.rs#L1) | - |" in page
    assert "| (2.16) | by test only |" in page
    assert "| (2.17) | by test only |" in page


def test_equation_is_wanted_in_a_tag_or_with_a_reason_and_not_in_both(tree, capsys):
    every = sorted(EXISTING["eq."] - {"2.9", "2.10", "2.15", "2.16", "2.17", "3.7", "3.10"})
    listed = ", ".join(f'"{number}"' for number in every)
    text = '[proofs]\nreason = "a step of a proof"\nequations = [{}]\n'
    write(tree, "tools/thesis_without.toml", text.format(listed))
    assert run(tree) == 0
    assert "168 of 168 equations accounted for" in capsys.readouterr().out
    assert "| a step of a proof |" in (tree / "THESIS.md").read_text()
    write(tree, "tools/thesis_without.toml", text.format(listed.replace('"1.1"', '"3.7", "1.99"')))
    assert run(tree) == 1
    out = capsys.readouterr()
    assert "167 of 168" in out.out
    assert "eq. (3.7) has a tag" in out.err
    assert "eq. (1.1) has neither a tag nor a reason" in out.err
    assert "eq. (1.99) is no equation" in out.err


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
