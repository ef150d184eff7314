"""The report opened in a real browser, offline, 1280 pixels wide."""

import html
import json
import os
import re
import shutil
import subprocess

import pytest
from PIL import Image

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
if CHROMIUM is None and os.environ.get("CI") != "true":
    pytest.skip("no browser here: install chromium (on Debian: apt install chromium)", allow_module_level=True)

OPTIONS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--window-size=1280,900", "--dump-dom"),
)
MEASURE = """
<script>
function looked(image) {  // how much of a picture is not paper, how much is coloured, and in how many of 8 x 8 fields
  const canvas = document.createElement("canvas"), wide = canvas.width = 400;
  const high = canvas.height = Math.round(wide * image.naturalHeight / image.naturalWidth);
  const pen = canvas.getContext("2d");
  pen.drawImage(image, 0, 0, wide, high);
  const data = pen.getImageData(0, 0, wide, high).data, fields = new Set();
  let ink = 0, colour = 0;
  for (let k = 0; k < data.length; k += 4) {
    const most = Math.max(data[k], data[k + 1], data[k + 2]), least = Math.min(data[k], data[k + 1], data[k + 2]);
    if (least > 235) continue;
    ink += 1;
    colour += most - least > 40;
    fields.add(Math.floor(8 * (k / 4 % wide) / wide) + 8 * Math.floor(8 * Math.floor(k / 4 / wide) / high));
  }
  return {ink: ink / (wide * high), colour: colour / (wide * high), fields: fields.size};
}
addEventListener("load", () => {
  const told = document.createElement("pre");
  told.id = "measured";
  const texts = [...document.querySelectorAll("p, td, th, figcaption, caption, nav a")].filter(e => e.innerText.trim());
  told.textContent = JSON.stringify({
    window: innerWidth,
    document: document.documentElement.scrollWidth,
    beyond: [...document.body.querySelectorAll("*")].filter(e => e.getBoundingClientRect().right > innerWidth).length,
    least_font: Math.min(...texts.map(e => parseFloat(getComputedStyle(e).fontSize))),
    background: getComputedStyle(document.body).backgroundColor,
    fetched: performance.getEntriesByType("resource").map(e => e.name).filter(name => !name.startsWith("data:")),
    dead_links: [...document.querySelectorAll("a")].filter(a => !document.querySelector(a.hash)).length,
    figures: [...document.images].map(i => ({alt: i.alt, natural: i.naturalWidth, shown: i.clientWidth, ...looked(i)})),
    heads: [...document.querySelectorAll("th")].map(e => e.innerText.trim()),
  });
  document.body.append(told);
});
</script>
"""


@pytest.fixture(scope="module")
def measured(reproduced, tmp_path_factory):
    """What the browser says of the report, opened from a folder where nothing else is."""
    place = tmp_path_factory.mktemp("alone")
    text = (reproduced.place / "report.html").read_text(encoding="utf-8")
    (place / "report.html").write_text(text.replace("</body>", MEASURE + "</body>"), encoding="utf-8")
    assert CHROMIUM is not None, "CI needs a browser: install chromium"
    command = [CHROMIUM, *OPTIONS, f"--user-data-dir={place / 'profile'}", (place / "report.html").as_uri()]
    run = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    found = re.search(r'<pre id="measured">(.*?)</pre>', run.stdout)
    assert found is not None, run.stderr[-2000:]
    return json.loads(html.unescape(found.group(1)))


def test_every_figure_shows(measured):
    figures = measured["figures"]
    assert len(figures) == 4 + 7 * 2
    assert all(figure["natural"] >= 1.3 * figure["shown"] > 1000 for figure in figures)


def test_no_figure_is_blank(measured):
    """Lines and letters of one colour at least, all over the picture, and more paper than ink but in the maps."""
    for figure in measured["figures"]:
        is_map = figure["alt"].startswith(("Figure 2.2", "Figure 2.3"))
        assert 0.01 < figure["ink"] < (0.9 if is_map else 0.4), figure
        assert figure["colour"] > 0.001, figure
        assert figure["fields"] > 48, figure


def test_every_panel_of_every_figure_says_its_quantity_and_unit(reproduced):
    """By the words in the files, which are taken from the axes that were drawn."""
    unit = re.compile(r"\[[^\]]+\]|sample \(4 ms each\)|^1: .*, 0: ")  # the last is a ratio that says what its ends are
    for path in reproduced.place.glob("*.png"):
        with Image.open(path) as picture:
            panels = picture.info["Description"].splitlines()
        assert panels, path.name
        for panel in panels:
            title, _, words = panel.partition(": ")
            labels = [label for label in words.split(" over ") if label.strip()]
            assert len(labels) == (2 if title else 1), (path.name, panel)  # a colour bar has no title, and one axis
            assert all(map(unit.search, labels)), (path.name, panel)


def test_every_figure_is_told_in_words(measured):
    alts = [figure["alt"] for figure in measured["figures"]]
    for number in ("2.2", "2.3", *(f"6.{k}" for k in range(2, 11))):
        assert any(alt.startswith((f"Figure {number}:", f"Figure {number},")) for alt in alts), number
    units = ("N·m", "mm", "m/s", "deg", "rad/s", "ratio")
    assert all(any(unit in alt for unit in units) for alt in alts)


def test_nothing_leaves_the_page_at_1280_pixels(measured):
    assert measured["window"] == 1280
    assert measured["document"] <= 1280
    assert measured["beyond"] == 0


def test_it_is_light_legible_and_needs_nothing_from_elsewhere(measured):
    assert measured["background"] == "rgb(255, 255, 255)"
    assert measured["least_font"] >= 14.0
    assert measured["fetched"] == []
    assert measured["dead_links"] == 0


def test_tables_have_units(measured):
    heads = " ".join(measured["heads"])
    assert all(unit in heads for unit in ("[mm]", "[m/s]", "[N·m]", "[µs]", "[ms]"))
