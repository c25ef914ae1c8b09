"""The Python of docs/python.md and its example, on a tiny sequence with real Blender."""

import subprocess
import sys
from pathlib import Path

import cv2
import pytest

from tests.support.doc_pages import ROOT, blocks, commands

pytestmark = [pytest.mark.blender, pytest.mark.slow]


def test_the_page_and_its_example_run(tmp_path: Path) -> None:
    script = tmp_path / "page.py"
    script.write_text("\n".join(blocks("docs/python.md", "python")) + "\nprint(pixel_px.shape)\n")
    done = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    printed = done.stdout.splitlines()
    assert printed[0] == "Sequence('out/train/seed7-room0000': 6 frames, 4 views, 256 tracks)"
    assert printed[1:6] == ["(6, 256, 3)", "(256, 4)", "(48, 64, 3)", "(6, 256)", "(6, 48, 64)"]
    assert printed[-1] == "(6, 256, 2)"

    example = next(command for command in commands() if "docs/examples/show_batch.py" in command.words)
    words = [str(ROOT / word) if word.startswith("docs/") else word for word in example.arguments]
    done = subprocess.run([sys.executable, *words], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    picture = cv2.imread(str(tmp_path / "batch.png"))
    # One clip of four times, two views.
    assert picture is not None and picture.shape == (2 * 128, 4 * 128, 3)
    assert picture.std() > 10
