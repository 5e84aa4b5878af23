"""Conclusion of the thesis: ORB is said to be about 100 times faster than SIFT.

Times of OpenCV's own two on the same picture, one thread; needs OpenCV and NumPy alone:
`pip install "sphereflow[peers]"` has them.
"""

from pathlib import Path
from time import perf_counter

import numpy as np

REPEATS = 15


def picture() -> np.ndarray:
    """A textured picture of 640x480: smoothed noise of three sizes, rectangles with edges."""
    rng = np.random.default_rng(0)
    total = np.zeros((480, 640))
    for size in (4, 12, 40):
        rough = rng.normal(size=(480 // size + 2, 640 // size + 2))
        total += np.kron(rough, np.ones((size, size)))[:480, :640]
    for _ in range(60):
        x, y, w, h = rng.integers((0, 0, 10, 10), (600, 440, 80, 80))
        total[y : y + h, x : x + w] += rng.normal()
    total = (total - total.min()) / np.ptp(total)
    return (255 * total).astype(np.uint8)


def main(out: Path | None = None) -> None:
    """Print the two times and their ratio."""
    import cv2

    cv2.setNumThreads(1)
    image = picture()
    times = {}
    for name, detector in (
        ("ORB", cv2.ORB_create(1000)),
        ("SIFT", cv2.SIFT_create(1000)),
    ):
        detector.detectAndCompute(image, None)
        found = []
        for _ in range(REPEATS):
            start = perf_counter()
            points, _ = detector.detectAndCompute(image, None)
            found.append(perf_counter() - start)
        times[name] = min(found)
        print(f"{name}: {1e3 * min(found):.1f} ms, {len(points)} points")
    print(f"OpenCV {cv2.__version__}: SIFT takes {times['SIFT'] / times['ORB']:.1f} times as long")


if __name__ == "__main__":
    main()
