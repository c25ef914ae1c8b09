"""``perpetua report``: figures as they are defined, a page that stands alone, and nothing in the data that runs."""

import json
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from perpetua.actors.bodies.people import draw_person
from perpetua.cli.app import main
from perpetua.config import load_config
from perpetua.formats.reader import Sequence, SequenceView
from perpetua.report.charts import histogram, named, tally
from perpetua.report.measure import Measured, measure
from perpetua.report.records import garments, height_cm
from perpetua.report.scales import APART_DEG, TRAVEL_M, binned, counted
from perpetua.seeding import StageSeed
from perpetua.testing.synthetic_sequence import write_scene

HOSTILE = "<script>document.title = 'taken'</script>\"'&"
GARMENTS = {
    "trousers", "runners", "shoes", "trainers", "T-shirt", "shirt", "jeans", "jumper", "top", "skirt", "cardigan",
    "shorts", "dress", "jacket",
}  # fmt: skip
VOID = {"meta", "link", "img", "br", "line", "rect"}


# Figures


def jpeg(width_px: int = 64, height_px: int = 48) -> np.ndarray:
    import cv2

    encoded: np.ndarray = cv2.imencode(".jpg", np.full((height_px, width_px, 3), 90, np.uint8))[1]
    return encoded.ravel()


def view(visible: np.ndarray, turn_rad: float = 0.0, depth_m: float | None = None) -> SequenceView:
    """A camera at the origin that looks along Z, turned about Y; 64 x 48 px, 90 degrees wide."""
    frames = len(visible)
    pose = np.eye(4, dtype=np.float32)
    cosine, sine = np.cos(turn_rad), np.sin(turn_rad)
    pose[:3, :3] = [[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]]
    depth = None if depth_m is None else np.full((frames, 48, 64), depth_m, np.float32)
    inner = np.array([32.0, 32.0, 31.5, 23.5], np.float32)
    return SequenceView((jpeg(),) * frames, inner, np.tile(pose, (frames, 1, 1)), visible, depth, None)


def measured(tracks_m: np.ndarray, *views: SequenceView, fps: float = 10.0) -> Measured:
    count = tracks_m.shape[1]
    sequence = Sequence(Path("made"), tracks_m.astype(np.float32), np.zeros((count, 4), np.float32), views)
    return measure(sequence, fps)


def line(*x_m: float) -> np.ndarray:
    """A track 2 m in front of the camera."""
    return np.stack([np.array(x_m), np.zeros(len(x_m)), np.full(len(x_m), 2.0)], axis=1)


def test_tracks_are_counted_by_how_far_and_how_fast_they_move() -> None:
    tracks_m = np.stack([line(0, 0, 0, 0), line(0, 0.1, 0.2, 0.3), line(0, 1, 2, 3)], axis=1)
    found = measured(tracks_m, view(np.ones((4, 3), bool)))
    assert found.counts.travel.tolist() == [1, 0, 1, 0, 0, 1]
    assert (found.moving, found.fast, found.tracks, found.frames) == (2, 1, 3, 4)
    # Three steps at 1 m/s and three at 10.
    assert found.counts.speed.tolist() == [0, 0, 0, 0, 0, 3, 0, 0, 0, 3]


def test_an_occlusion_is_a_track_that_is_hidden_while_on_the_image() -> None:
    hidden_twice, leaves, never = line(0, 0, 0, 0, 0), line(0, 0, 9, 9, 9), line(0, 0, 0, 0, 0)
    visible = np.array([[1, 1, 0], [0, 1, 0], [1, 0, 0], [0, 0, 0], [0, 0, 0]], bool)
    found = measured(np.stack([hidden_twice, leaves, never], axis=1), view(visible))
    assert found.counts.occlusions.tolist()[:3] == [1, 0, 1]
    assert found.counts.occlusions.sum() == 2


def test_visibility_is_counted_over_views_and_frames() -> None:
    tracks_m = np.stack([line(0, 0), line(1, 1)], axis=1)
    first, second = np.array([[1, 1], [1, 0]], bool), np.array([[1, 0], [0, 0]], bool)
    found = measured(tracks_m, view(first), view(second))
    assert found.counts.seeing_views.tolist()[:3] == [1, 2, 1]
    assert found.visible_fraction == (0.75, 0.25)
    # One track is seen in both frames, one in half of them.
    assert found.counts.seen_fraction.tolist() == [0, 0, 0, 0, 0, 1, 0, 0, 0, 1]


def test_angles_between_views_and_across_the_image() -> None:
    tracks_m = np.stack([line(0, 0)], axis=1)
    seen = np.ones((2, 1), bool)
    found = measured(tracks_m, view(seen), view(seen, np.radians(50.0)), view(seen, np.radians(130.0)))
    assert found.counts.apart.tolist() == binned(np.array([50.0, 130.0, 80.0] * 2), APART_DEG).tolist()
    assert found.counts.field_of_view.sum() == found.counts.field_of_view[7] == 3
    assert found.origin_m == (0.0, 0.0)


def test_depth_counts_where_there_is_a_surface() -> None:
    seen = np.ones((2, 1), bool)
    found = measured(np.stack([line(0, 0)], axis=1), view(seen, depth_m=2.25), view(seen, depth_m=0.0), view(seen))
    assert found.counts.depth.sum() == found.counts.depth[4] == 2 * 12 * 16
    assert found.depth_m == (2.25, 2.25)


def test_counts_add_up_and_lose_nothing() -> None:
    rng = np.random.default_rng(3)
    values = rng.normal(0.5, 1.0, 500)
    assert binned(values, TRAVEL_M).sum() == 500
    assert binned(np.array([0.05, 2.0, np.nan]), TRAVEL_M).tolist() == [0, 1, 0, 0, 0, 1]
    assert counted(np.array([0, 3, 9, 9]), 4).tolist() == [1, 0, 0, 1, 2]
    total = measured(np.stack([line(0, 0)], axis=1), view(np.ones((2, 1), bool))).counts
    assert (total + total).travel.tolist() == (2 * total.travel).tolist()


def test_charts_name_their_bars() -> None:
    chart = histogram("far", "m", np.array([0, 3, 0, 1, 0, 0]), TRAVEL_M, "m")
    assert [(bar.label, bar.count, bar.fraction, bar.length) for bar in chart.bars] == [
        ("0.05 to 0.2 m", 3, 0.75, 1.0),
        ("0.2 to 0.5 m", 0, 0.0, 0.0),
        ("0.5 to 1 m", 1, 0.25, 1 / 3),
    ]
    assert chart.ticks == ("0.05", "0.2", "0.5", "1")
    assert tally("often", "", np.array([4, 1]), "times").ticks == ("0", "1+")
    rows = named("names", "", {name: count for count, name in enumerate("abcdefgh", start=1)}, most=3)
    assert [bar.label for bar in rows.bars] == ["h", "g", "f", "5 others"] and rows.total == 36


def test_people_are_read_from_their_own_descriptions() -> None:
    config = load_config("tiny").actors
    for room in range(30):
        person = draw_person(room % 4, config, StageSeed(5, room, "bodies"))
        assert height_cm(person.description) == round(100 * person.stature_m)
        assert set(garments(person.description)) <= GARMENTS
        assert len(garments(person.description)) >= 2
    assert height_cm("a capsule in a shirt") is None and garments("a capsule in a shirt") == ()


# The page


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page of three sequences: one with everything and hostile names, a foreign one, and a damaged one."""
    root = tmp_path_factory.mktemp("data")
    own = root / "train" / "seed5-room0000<b>"
    write_scene(own)
    record = json.loads((own / "sequence.json").read_text())
    record |= {"room": 0, "room_kind": HOSTILE, "fps": 12.0}
    record["objects"][-1]["description"] = f"a woman, 171 cm tall, wearing a red {HOSTILE}"
    (own / "sequence.json").write_text(json.dumps(record))
    checks = [{"name": HOSTILE, "passed": False, "value": 0.5, "bound": HOSTILE}, {"name": "sound", "passed": True}]
    (own / "audit.json").write_text(json.dumps({"sequence": {"checks": checks}}))
    stage = {"kind": "stage_finished", "room": 0, "stage": "render", "seconds": 250.0, "peak_memory_mb": 1234.5}
    (root / "log.jsonl").write_text(f"not json\n{json.dumps(stage | {'seconds': 9})}\n{json.dumps(stage)}\n")
    foreign = root / "other" / "foreign"
    write_scene(foreign)
    for name in ("sequence.json", "1/depth.npy"):
        (foreign / name).unlink()
    damaged = root / "other" / "damaged"
    shutil.copytree(foreign, damaged)
    (damaged / "0" / "visibility.npy").write_bytes(b"nothing")
    (damaged / "sequence.json").write_text('{"objects": "none"}')
    out = tmp_path_factory.mktemp("page") / "report.html"
    done = CliRunner().invoke(main, ["report", str(root), "--out", str(out)])
    assert done.exit_code == 0, done.output
    assert "visibility.npy" in done.output
    return out


class Strict(HTMLParser):
    """Fails on a tag that is not closed where it must be; gathers what a page refers to, and its text."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.references: list[str] = []
        self.counts: dict[str, int] = {}
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.counts[tag] = self.counts.get(tag, 0) + 1
        self.references += [value or "" for name, value in attrs if name in ("src", "href", "srcset", "data")]
        assert not [name for name, _ in attrs if name.startswith("on")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.handle_endtag(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-3:]}"
        self.open.pop()
        self.text += " "

    def handle_data(self, data: str) -> None:
        self.text += data


def parsed(page: Path) -> Strict:
    parser = Strict()
    parser.feed(page.read_text(encoding="utf-8"))
    parser.close()
    return parser


def test_page_is_whole_and_refers_to_nothing_outside(page: Path) -> None:
    found = parsed(page)
    assert found.open == []
    assert all(reference.startswith(("#", "data:")) for reference in found.references)
    assert "http" not in page.read_text(encoding="utf-8") and "@import" not in page.read_text(encoding="utf-8")
    # Three views of each of the two sequences that can be read.
    assert found.counts["img"] == 6
    assert found.counts["svg"] >= 9


def test_nothing_from_the_data_becomes_markup(page: Path) -> None:
    found = parsed(page)
    assert found.counts["script"] == 1
    assert found.text.count(HOSTILE) >= 3
    assert "b" not in found.counts and "seed5-room0000<b>" in found.text


def test_page_says_what_is_there_and_what_is_missing(page: Path) -> None:
    text = " ".join(parsed(page).text.split())
    assert "2 sequences, and 1 that cannot be read." in text
    for said in (
        "there is no sequence.json",
        "there is no depth.npy in view 1",
        "sequence.json is not as Perpetua writes it: objects",
        "cannot be read:",
        "1 of 2",
        "render 4.2 min 4.2 min 100.0% 1,23",
    ):
        assert said in text, said


def test_sequences_of_several_runs_are_told_apart(tmp_path: Path) -> None:
    for run in ("kitchens", "bedrooms"):
        write_scene(tmp_path / run / "train" / "seed1-room0000")
    done = CliRunner().invoke(main, ["report", str(tmp_path), "--out", str(tmp_path / "report.html")])
    assert done.exit_code == 0, done.output
    shown = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert all(f">{run}/train/seed1-room0000</td>" in shown for run in ("kitchens", "bedrooms"))


def test_a_folder_without_sequences_is_an_error(tmp_path: Path) -> None:
    done = CliRunner().invoke(main, ["report", str(tmp_path)])
    assert done.exit_code == 2 and "holds no sequence" in done.output


def test_a_place_that_cannot_be_written_is_an_error(page: Path, tmp_path: Path) -> None:
    data = tmp_path / "data"
    write_scene(data / "train" / "one")
    done = CliRunner().invoke(main, ["report", str(data), "--out", str(tmp_path / "nowhere" / "report.html")])
    assert done.exit_code == 2 and "cannot write '" in done.output


# The page in a browser

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
in_browser = pytest.mark.skipif(
    CHROMIUM is None, reason="no Chromium on this machine (Debian: apt-get install chromium)"
)


def browse(page: Path, folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Opens a page from file:// in a browser of its own."""
    command = [
        str(CHROMIUM), "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
        "--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars",
        "--enable-logging=stderr", f"--user-data-dir={folder / 'profile'}", *options, page.as_uri(),
    ]  # fmt: skip
    return subprocess.run(command, capture_output=True, text=True, timeout=240, check=True)


@in_browser
@pytest.mark.slow
@pytest.mark.parametrize(("scheme", "is_light"), [("1", True), ("0", False)])
def test_page_opens_in_both_themes_without_a_word_on_the_console(
    page: Path, tmp_path: Path, scheme: str, is_light: bool
) -> None:
    shot = tmp_path / "page.png"
    options = (f"--blink-settings=preferredColorScheme={scheme}", "--window-size=1280,2400", f"--screenshot={shot}")
    done = browse(page, tmp_path, *options)
    assert "CONSOLE" not in done.stderr
    level = np.asarray(Image.open(shot).convert("L")).astype(float)
    assert (np.median(level) > 200) == is_light
    # Text and bars stand out from the paper.
    assert (np.abs(level - np.median(level)) > 90).mean() > 0.005


@in_browser
@pytest.mark.slow
def test_a_heading_sorts_the_table(page: Path, tmp_path: Path) -> None:
    """The same page with two clicks behind it: on the names, and on the names again."""
    text = page.read_text(encoding="utf-8")
    read = "[...document.querySelectorAll('.sortable tbody tr')].map(row => row.cells[0].textContent).join('|')"
    click = "document.querySelector('.sortable button').click();"
    clicks = (
        f"<script>{click} const rising = {read}; {click} document.body.dataset.order = rising + ' ' + {read};</script>"
    )
    clicked = tmp_path / "clicked.html"
    clicked.write_text(text.replace("</body>", f"{clicks}</body>"), encoding="utf-8")
    done = browse(clicked, tmp_path, "--dump-dom")
    assert "CONSOLE" not in done.stderr
    assert 'data-order="damaged|foreign|seed5-room0000' in done.stdout
    assert "|foreign|damaged" in done.stdout
    assert "<title>taken</title>" not in done.stdout
