"""What the thesis has: the numbers of its equations, sections, statements, tables and figures."""

from __future__ import annotations

# Last equation of each chapter; all from 1 on exist.
_EQUATIONS = {
    "1": 23,
    "2": 20,
    "3": 10,
    "4": 1,
    "5": 55,
    "6": 3,
    "7": 27,
    "8": 2,
    "9": 9,
    "A": 9,
    "B": 2,
    "C": 7,
}

_FIGURES = {"1": 3, "2": 1, "4": 20, "5": 10, "6": 3, "7": 6, "8": 1, "9": 3, "10": 14, "C": 2}

_SECTIONS = """
1.1 1.1.1 1.1.2 1.2 1.3 1.3.1 1.3.2
2.1 2.1.1 2.1.2 2.1.3 2.1.4 2.2 2.2.1 2.2.2
3.1 3.2
4.1 4.1.1 4.1.2 4.1.3 4.2
5.1 5.2 5.2.1 5.2.2 5.3 5.3.1 5.3.2 5.3.3 5.3.4 5.3.5 5.3.6
5.4 5.4.1 5.4.2 5.4.3 5.4.4 5.5 5.5.1 5.5.2 5.5.3 5.6
6.1 6.2 6.3 6.4
7.1 7.2 7.3 7.4 7.5 7.6 7.7
8.1 8.2 8.3 8.4 8.4.1 8.4.2 8.5
9.1 9.1.1 9.1.2 9.1.3 9.2 9.3 9.3.1 9.3.2 9.4 9.5 9.5.1 9.5.2 9.6 9.6.1 9.6.2
10.1 10.2 10.2.1 10.2.2 10.3
A.1 A.2 C.1 C.1.1 C.1.2 C.1.3 C.2 C.3
"""


def _numbered(last: dict[str, int]) -> frozenset[str]:
    return frozenset(
        f"{chapter}.{number}" for chapter, count in last.items() for number in range(1, count + 1)
    )


def _count(last: int) -> frozenset[str]:
    return frozenset(str(number) for number in range(1, last + 1))


EXISTING: dict[str, frozenset[str]] = {
    "eq.": _numbered(_EQUATIONS),
    "section": frozenset(_SECTIONS.split()),
    "chapter": _count(10),
    "appendix": frozenset("ABC"),
    "Theorem": _count(4),
    "Proposition": _count(10),
    "Lemma": frozenset({"5"}),
    "Remark": _count(3),
    "Table": frozenset({"6.1", "10.1"}),
    "Figure": _numbered(_FIGURES),
}
"""Numbers by kind; the order of the kinds is that of the page."""
