"""The sphere of rays: one code for a pinhole, a fish-eye and a 360-degree camera.

For a fixed vector P, the field eta . P is an eigenfunction of the sphere's Laplacian: -2 eta . P.
"""

import numpy as np
import sphereflow as sf

P = np.array([0.3, -0.5, 0.8])
cameras = {
    "pinhole": sf.Camera.pinhole(525, 525, 319.5, 239.5, 640, 480),
    "fish-eye": sf.Camera.kannala_brandt(200, 200, 319.5, 239.5, 0.01, 0, 0, 0, 640, 480),
    "360 degrees": sf.Camera.equirectangular(720, 360),
}
for name, camera in cameras.items():
    grid = sf.SphereGrid(camera)
    field = grid.rays @ P
    error = np.abs(grid.laplacian(field) + 2 * field)
    print(
        f"{name:12s} {np.nansum(grid.solid_angle):7.4f} sr of {4 * np.pi:.4f}, "
        f"Laplacian off by {np.nanmedian(error):.1e} (median)"
    )
