"""Thesis: Table 6.1. Milliseconds a pair by the number of domains, 640x480, one thread.

Times the thesis's own method in Rust (`cargo bench --bench thesis`), where the camera's tables are
made once as in the thesis; then draws the figures beside the printed ones.
"""

import re
import shutil
import subprocess
from pathlib import Path

from drawing import save

ROOT = Path(__file__).resolve().parents[2]
BENCH = ["cargo", "bench", "-q", "-p", "sphereflow-benches", "--bench", "thesis", "--", "--quick"]
HEAD = "| domains | Table 6.1 (2011) ms | forward ms | trapezoid ms |"


def rows(text: str) -> list[tuple[float, ...]]:
    """The numbers of the table in what the bench prints."""
    number = r"\s*([\d.]+)\s*"
    pattern = re.compile(r"^\|" + r"\|".join([number] * 4) + r"\|$", re.MULTILINE)
    return [tuple(map(float, row)) for row in pattern.findall(text)]


# Thesis: Table 6.1.
def main(out: Path) -> None:
    """Print the table and draw the picture; says so where there is no cargo to time with."""
    if shutil.which("cargo") is None:
        print("table 6.1: left out, there is no cargo to run the bench with")
        return
    text = subprocess.run(BENCH, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    table = rows(text)
    if not table:
        raise RuntimeError(f"{' '.join(BENCH)} printed no table")
    print(f"table 6.1\n{HEAD}\n| --- | --- | --- | --- |")
    for domains, printed, forward, trapezoid in table:
        print(f"| {domains:.0f} | {printed} | {forward} | {trapezoid} |")
    draw(out / "table_6_1.png", table)


def draw(path: Path, table: list[tuple[float, ...]]) -> None:
    """Both computers' times over the number of domains."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    domains, printed, forward, trapezoid = zip(*table, strict=True)
    figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
    axes.loglog(domains, printed, "o-", color="tab:gray", label="Table 6.1 (i5-2520M, 2011)")
    axes.loglog(domains, trapezoid, "o-", color="tab:blue", label="here, trapezoid")
    axes.loglog(domains, forward, "o-", color="tab:orange", label="here, forward")
    axes.set(
        xlabel="domains",
        ylabel="ms per pair",
        title="Time of the thesis's method, 640x480, one thread",
        xticks=domains,
        xticklabels=[f"{n:.0f}" for n in domains],
    )
    axes.minorticks_off()
    axes.grid(alpha=0.3)
    axes.legend()
    save(figure, path, dpi=100)
