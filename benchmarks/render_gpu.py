"""Frames per second on a GPU, how busy it is, and what the time goes to. Needs a GPU and its driver's nvidia-smi.

    perpetua generate --preset standard --seed 3 --until cameras --out plans
    python benchmarks/render_gpu.py plans/.work/seed3-room0000 --width 512 --samples 32 --frames 24

Time is the clock's, as sampling takes no CPU time here: run it on a machine that does nothing else. A GPU that is
busy for much less than all of the time waits for one CPU core, which loads frames into Cycles or writes files: then
several workers (``--workers``) use it better.
"""

import argparse
import shutil
import statistics
import subprocess
import threading
from collections import defaultdict
from pathlib import Path

from render_worker import load_scene, phase_of, watch_worker

from perpetua.rendering.config import RenderConfig

SAMPLE_EVERY_MS = 100


class BusyShare:
    """Reads the GPUs' utilisation from nvidia-smi while it is open; ``samples`` in per cent, of the busiest GPU."""

    def __init__(self) -> None:
        program = shutil.which("nvidia-smi")
        if program is None:
            raise SystemExit("nvidia-smi was not found: this benchmark needs an NVIDIA GPU and its driver")
        query = ["--query-gpu=utilization.gpu", "--format=csv,noheader,nounits", f"--loop-ms={SAMPLE_EVERY_MS}"]
        self._process = subprocess.Popen([program, *query], stdout=subprocess.PIPE, text=True)
        self.samples: list[float] = []
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.strip().isdigit():
                self.samples.append(float(line))

    def close(self) -> None:
        """Stops reading."""
        self._process.terminate()
        self._process.wait()
        self._thread.join()


def main() -> None:
    """Renders once and prints the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("work", type=Path, help="work area of one room, finished up to its cameras")
    parser.add_argument("--device", default="auto")
    parser.add_argument("--width", type=int, default=512)
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--frames", type=int, default=24)
    parser.add_argument("--blend", type=Path, default=None, help="a room that is baked already")
    parser.add_argument("--scratch", type=Path, default=Path("render_gpu"))
    given = parser.parse_args()
    config = RenderConfig(width_px=given.width, height_px=given.width, samples=given.samples)
    given.scratch.mkdir(parents=True, exist_ok=True)
    scene = load_scene(given.work, config, given.blend, given.scratch).cut(given.frames, 4)
    busy = BusyShare()
    try:
        moments, peak_mb = watch_worker(scene, config, given.scratch / "job", given.device)
    finally:
        busy.close()
    device = next(moment.text for moment in moments if '"event": "device"' in moment.text)
    ready = next(number for number, moment in enumerate(moments) if '"ready"' in moment.text)
    wall_s = moments[-1].wall_s - moments[ready].wall_s
    spent: dict[str, float] = defaultdict(float)
    for one, following in zip(moments[ready:], moments[ready + 1 :], strict=False):
        spent[phase_of(one.text)] += following.wall_s - one.wall_s
    print(device)
    print(f"{given.frames / wall_s:.3f} frames of 4 views a second, {4 * given.frames / wall_s:.3f} images a second")
    for name, seconds in sorted(spent.items(), key=lambda item: -item[1]):
        print(f"{name:<28}{seconds / given.frames:8.3f} s per frame {100 * seconds / wall_s:6.1f}%")
    rendering = busy.samples[-max(1, round(1000 * wall_s / SAMPLE_EVERY_MS)) :]
    print(
        f"GPU busy {statistics.fmean(rendering) if rendering else 0.0:.0f}% of the time; host memory {peak_mb:.0f} MB"
    )


if __name__ == "__main__":
    main()
