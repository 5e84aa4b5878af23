"""Figures and their curves: each picture of an experiment goes with a table of what it shows."""

import csv
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DIGITS = "{:.6g}"  # of a curve in a table: finer than any line drawn
POINTS = 500  # of a curve in a table at most, evenly taken: finer than the picture's pixels


def save(figure: "Figure", path: Path, dpi: int = 100) -> None:
    """Write the picture, and the curves of all its axes beside it as `curves/NAME.csv`.

    Long format: axes (their number and label), curve (its label), x, y.
    """
    import matplotlib.pyplot as plt

    figure.savefig(path, dpi=dpi)
    rows = []
    for number, axes in enumerate(figure.axes):
        place = f"{number} {axes.get_ylabel()}".strip()
        for index, line in enumerate(axes.get_lines()):
            label = str(line.get_label())
            name = f"curve {index}" if label.startswith("_") else label
            points = list(zip(line.get_xdata(), line.get_ydata(), strict=True))
            for x, y in points[:: -(-len(points) // POINTS) or 1]:
                rows.append((place, name, DIGITS.format(x), DIGITS.format(y)))
    if rows:
        folder = path.parent / "curves"
        folder.mkdir(exist_ok=True)
        with (folder / f"{path.stem}.csv").open("w", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(("axes", "curve", "x", "y"))
            table.writerows(rows)
    plt.close(figure)
