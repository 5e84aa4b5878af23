"""Draw every figure of docs/figures: one module an experiment, each with `main(out)`."""

import argparse
import importlib
import sys
from inspect import signature
from pathlib import Path

EXPERIMENTS = [
    "figure_2_1",
    "figure_6_2",
    "nine_scenes",
    "table_6_1",
    "depth_observers",
    "depth_filter",
    "demo_room",
    "section_5_4_3",
]


def main() -> None:
    """Run the experiments named on the command line, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=EXPERIMENTS, help=f"of {EXPERIMENTS}")
    parser.add_argument(
        "--full", action="store_true", help="at the thesis's size, where that takes long"
    )
    parser.add_argument("--out", type=Path, default=Path("docs/figures"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    sys.path.insert(0, str(Path(__file__).parent))
    for name in arguments.names:
        draw = importlib.import_module(name).main
        longer = {"full": True} if arguments.full and "full" in signature(draw).parameters else {}
        draw(arguments.out, **longer)


if __name__ == "__main__":
    main()
