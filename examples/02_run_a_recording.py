"""The main job from Python: a recording in; trajectory, map, report and pictures out.

Run it on your own folder: python examples/02_run_a_recording.py DATA OUT
"""

import sys
import tempfile
from pathlib import Path

import sphereflow as sf

if len(sys.argv) > 2:
    data, out = sys.argv[1], Path(sys.argv[2])
else:  # nothing given: a second of the simulated room
    data, out = sf.sim.Simulator(duration_s=1.0), Path(tempfile.mkdtemp()) / "result"

result = sf.run(data, out, pictures=False)

print(f"coverage {100 * result.coverage:.1f} %, {len(result.trajectory)} poses")
if result.ape is not None:
    print(f"error against the truth: {1000 * result.ape.statistics.rmse:.1f} mm (rmse)")
print("written:", sorted(path.name for path in out.iterdir()))
