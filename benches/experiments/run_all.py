"""Draw the figures of docs/figures: one module an experiment, each with `main(out)`.

At the size of a test they go to out/experiments, at the full size (`--full`) to docs/figures, so
that neither overwrites the other; `--out` says otherwise. Each picture has its curves beside it as
`curves/NAME.csv`.
"""

import argparse
import importlib
import sys
from inspect import signature
from pathlib import Path

SMALL, FULL = Path("out/experiments"), Path("docs/figures")

EXPERIMENTS = [
    "figure_2_1",
    "figure_6_2",
    "nine_scenes",
    "table_6_1",
    "depth_observers",
    "depth_filter",
    "demo_room",
    "section_5_4_3",
    "section_5_4_4",
    "theorem_4",
    "chapter_7",
    "propositions_9_10",
    "kalman_counterparts",
    "position_gains",
]
ON_REQUEST = ["orb_sift"]
"""Needs more than the package: run by name."""


def main() -> None:
    """Run the experiments named on the command line, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    known = [*EXPERIMENTS, *ON_REQUEST]
    parser.add_argument("names", nargs="*", default=EXPERIMENTS, help=f"of {known}")
    parser.add_argument(
        "--full", action="store_true", help="at the thesis's size, where that takes long"
    )
    parser.add_argument("--out", type=Path, help=f"default {SMALL}; with --full {FULL}")
    arguments = parser.parse_args()
    out = arguments.out or (FULL if arguments.full else SMALL)
    out.mkdir(parents=True, exist_ok=True)
    sys.path.insert(0, str(Path(__file__).parent))
    for name in arguments.names:
        draw = importlib.import_module(name).main
        longer = {"full": True} if arguments.full and "full" in signature(draw).parameters else {}
        draw(out, **longer)


if __name__ == "__main__":
    main()
