"""Opens the page of every command in Chromium, without a network, and uses it as a reader does: pointer, zoom, dark paper, a phone.

    python3 tests/pages/check.py [--keep FOLDER] [--only NAME ...] PROGRAM

Needs Chromium (Debian: chromium) and nothing else beside Python. With --keep the pages stay in FOLDER, with pictures of each (wide,
narrow, dark) and the print. Exit code 1 where something does not hold.
"""

import argparse
import base64
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
MOST_BYTES = 2_000_000

# name of a page: commands that lead to it, words apart by spaces; {data} is the folder of that name in the repository
REST = "gap diagnose rest.toml --fit rest.csv --hold hold.csv --html gap_rest.html --quiet"
SIMULATE = "simulate lacking.toml --duration 900 --quiet"
DRIVE = "simulate heavy.toml --course brisk --duration 90 --quiet"
POWER_ONS = {f"{unit}_{day}.csv": 10 * i + day for i, unit in enumerate("ab") for day in range(6)}
PAGES = {
    "fit": ["fit {data}/power_on.csv --html fit.html --quiet"],
    "noise": ["noise {data}/power_on.csv --html noise.html --quiet"],
    "validate": [
        "fit {data}/power_on.csv -o fitted.toml --no-plot --quiet",
        "validate fitted.toml {data}/power_on.csv --html validate.html --quiet",
    ],
    "navigate": ["navigate {data}/truth.toml {data}/drive.parquet --html navigate.html --quiet"],
    "study": ["study --runs 8 --html study.html --quiet"],
    "gap_rest": [f"{SIMULATE} --seed 1 -o rest.csv", f"{SIMULATE} --seed 2 -o hold.csv", REST],
    "gap_drive": [
        f"{DRIVE} --seed 1 -o drive.parquet",
        f"{DRIVE} --seed 2 -o kept.parquet",
        "gap diagnose robot.toml --fit drive.parquet --hold kept.parquet --html gap_drive.html --quiet",
    ],
    "explain": [
        f"{DRIVE} --seed 1 -o drive.parquet",
        "gap explain robot.toml --fit drive.parquet --effect vehicle.payload --html explain.html --quiet",
    ],
    "track": [
        *(f"simulate rest.toml --duration 900 --vary-turn-on --seed {seed} -o {log} --quiet" for log, seed in POWER_ONS.items()),
        f"fit {' '.join(POWER_ONS)} --accept --results fleet.csv --quiet",
        "track fleet.csv --unit ^[ab] --html track.html --quiet",
    ],
}
GYRO = """schema = 1
kind = "stationary"
sample_time_s = 0.5
[gyro]
c1_rad_s = 2e-3
c2_rad_s = -5e-3
time_constant_s = 200.0
angle_random_walk_rad_sqrt_s = 2e-4
turn_on_bias_std_rad_s = 1e-4
"""
TONE = '[[effect]]\nid = "gyro.tone"\nfrequency_hz = 0.31\namplitude_rad_s = 3e-4\n'
PAYLOAD = '[[effect]]\nid = "vehicle.payload"\nmass_relative = 0.3\ninertia_relative = 0.3\n'


class Browser:
    """Chromium by its debugging pipe: requests and answers are JSON that ends in a zero byte."""

    def __init__(self, program):
        self.folder = tempfile.mkdtemp(prefix="gyroid-pages-")
        ours, theirs = os.pipe(), os.pipe()
        options = [
            "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
            "--disable-background-networking", "--disable-component-update", "--host-resolver-rules=MAP * ~NOTFOUND",
            "--hide-scrollbars", "--remote-debugging-pipe", f"--user-data-dir={self.folder}",
        ]
        shell = f'exec "$0" "$@" 3<&{ours[0]} 4>&{theirs[1]}'
        self.process = subprocess.Popen(
            ["bash", "-c", shell, program, *options], pass_fds=(ours[0], theirs[1]), stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL
        )
        os.close(ours[0])
        os.close(theirs[1])
        self.out, self.into = os.fdopen(ours[1], "wb", 0), os.fdopen(theirs[0], "rb")
        self.count, self.session, self.events = 0, None, []
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ["Page", "Runtime", "Log", "Network"]:
            self.ask(f"{domain}.enable")

    def read(self):
        text = bytearray()
        while (byte := self.into.read(1)) != b"\0":
            if not byte:
                sys.exit("Chromium has gone")
            text += byte
        return json.loads(text)

    def ask(self, method, **parameters):
        self.count += 1
        message = {"id": self.count, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        self.out.write(json.dumps(message).encode() + b"\0")
        while True:
            answer = self.read()
            if answer.get("id") == self.count:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]
            self.events.append(answer)

    def open(self, path, width, height=900, dark=False):
        self.events.clear()
        self.ask("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 600)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.ask("Emulation.setEmulatedMedia", media="", features=[scheme])
        self.ask("Page.navigate", url=path.as_uri())
        while not any(e["method"] == "Page.loadEventFired" for e in self.events):
            self.events.append(self.read())

    def run(self, script):
        answer = self.ask("Runtime.evaluate", expression=script, returnByValue=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(f"{script}: {answer['exceptionDetails']}")
        return answer["result"].get("value")

    def pointer(self, kind, x, y, **more):
        self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def complaints(self):
        """Errors on the console, and requests for anything but the page."""
        found = []
        for event in self.events:
            method, params = event["method"], event.get("params", {})
            if method == "Runtime.exceptionThrown":
                found.append("exception: " + str(params["exceptionDetails"].get("exception", {}).get("description")))
            elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning"):
                found.append("console: " + str(params["args"]))
            elif method == "Log.entryAdded" and params["entry"]["level"] == "error":
                found.append("log: " + params["entry"]["text"])
            elif method == "Network.requestWillBeSent" and params["type"] != "Document":
                found.append("request: " + params["request"]["url"])
        return found

    def picture(self, path):
        size = self.ask("Page.getLayoutMetrics")["cssContentSize"]
        clip = {"x": 0, "y": 0, "width": size["width"], "height": min(size["height"], 12000), "scale": 1}
        image = self.ask("Page.captureScreenshot", format="png", captureBeyondViewport=True, clip=clip)
        path.write_bytes(base64.b64decode(image["data"]))

    def printed(self, path):
        path.write_bytes(base64.b64decode(self.ask("Page.printToPDF", printBackground=False)["data"]))

    def close(self):
        self.process.kill()
        self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


# figures without anything drawn in them: neither lines nor cells nor bars nor words
EMPTY = """[...document.querySelectorAll("figure")].filter(f =>
    ![...f.querySelectorAll("svg path.mark, svg rect.mark")].some(m => m.closest("svg[viewBox]") && (m.getAttribute("d") || m.getAttribute("width")))
    && !f.querySelector("table.bars tr, .notice")).map(f => f.querySelector("h3").textContent)"""
CHARTS = "document.querySelectorAll('.chart').length"
# the frame of a chart, in pixels of the window, scrolled into view
FRAME = """(() => { const chart = document.querySelectorAll(".chart")[%d]; chart.scrollIntoView({ block: "center" });
    const r = chart.querySelector("rect.frame").getBoundingClientRect(); return [r.x, r.y, r.width, r.height]; })()"""
TIP = """(() => { const tip = document.querySelectorAll(".chart")[%d].querySelector(".tip"); return tip.hidden ? "" : tip.innerText; })()"""
TICKS = "[...document.querySelectorAll('.chart')[%d].querySelectorAll('svg[viewBox] text')].map(t => t.textContent).join(' ')"
PAPER = "getComputedStyle(document.body).backgroundColor"
WIDER = "document.documentElement.scrollWidth > document.documentElement.clientWidth + 1"
SAID = """[...document.querySelectorAll("figure")].filter(f => !f.querySelector("figcaption").textContent.trim() ||
    [...f.querySelectorAll("svg[viewBox]")].some(s => !s.querySelector("title") || !s.querySelector("desc"))).length"""


def used(browser, path):
    """What does not hold of a page; and how much was tried."""
    faults = []
    size = path.stat().st_size
    if size > MOST_BYTES:
        faults.append(f"{size} bytes")
    browser.open(path, 1280)
    faults += [f"empty figure: {name}" for name in browser.run(EMPTY)]
    if browser.run(SAID):
        faults.append("a figure without words on what good looks like, or without text alternative")
    if browser.run("document.querySelectorAll('figure').length") == 0:
        faults.append("no figure")
    charts = browser.run(CHARTS)
    for i in range(charts):
        x, y, width, height = browser.run(FRAME % i)
        # dots and bars are told near the pointer alone: it goes across the chart
        told = ""
        for step in range(1, 40):
            browser.pointer("mouseMoved", x + width * step / 40, y + height / 2)
            told = browser.run(TIP % i)
            if any(c.isdigit() for c in told):
                break
        if not any(c.isdigit() for c in told):
            faults.append(f"chart {i}: the pointer shows no value: {told!r}")
        before = browser.run(TICKS % i)
        browser.pointer("mousePressed", x + 0.4 * width, y + 0.3 * height, button="left", clickCount=1)
        browser.pointer("mouseMoved", x + 0.5 * width, y + 0.5 * height, button="left")
        browser.pointer("mouseMoved", x + 0.6 * width, y + 0.7 * height, button="left")
        browser.pointer("mouseReleased", x + 0.6 * width, y + 0.7 * height, button="left", clickCount=1)
        if browser.run(TICKS % i) == before:
            faults.append(f"chart {i}: dragging does not zoom")
        for count in [1, 2]:
            browser.pointer("mousePressed", x + 0.5 * width, y + 0.5 * height, button="left", clickCount=count)
            browser.pointer("mouseReleased", x + 0.5 * width, y + 0.5 * height, button="left", clickCount=count)
        if browser.run(TICKS % i) != before:
            faults.append(f"chart {i}: a double click does not show all again")
    paper = browser.run(PAPER)
    browser.run("document.querySelector('.theme button').click()")
    if browser.run(PAPER) == paper:
        faults.append("light stays light")
    faults += browser.complaints()
    browser.open(path, 390, 844)
    if browser.run(WIDER):
        faults.append("wider than a phone")
    faults += browser.complaints()
    return faults, f"{size // 1000} kB, {charts} charts"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("--only", nargs="+", choices=PAGES, default=list(PAGES))
    args = parser.parse_args()
    chromium = next(filter(None, map(shutil.which, ["chromium", "chromium-browser", "google-chrome"])), None)
    if not chromium:
        sys.exit("no Chromium: apt-get install chromium")
    program = args.program.resolve()
    folder = (args.keep or pathlib.Path(tempfile.mkdtemp())).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    robot = (ROOT / "tests/common/robot.toml").read_text()
    texts = {"rest.toml": GYRO, "lacking.toml": GYRO + TONE, "robot.toml": robot, "heavy.toml": robot + PAYLOAD}
    for name, text in texts.items():
        (folder / name).write_text(text)
    browser, failed = Browser(chromium), False
    try:
        for name in args.only:
            for line in PAGES[name]:
                words = [word.format(data=ROOT / "data") for word in line.split(" ")]
                done = subprocess.run([program, *words], cwd=folder, capture_output=True, text=True)
                if done.returncode not in (0, 3):
                    sys.exit(f"gyroid {line}: {done.stderr}")
            path = folder / f"{name}.html"
            faults, tried = used(browser, path)
            print(f"{name}: {tried}: {'; '.join(faults) or 'holds'}", flush=True)
            failed |= bool(faults)
            if args.keep:
                for label, width, dark in [("wide", 1280, False), ("narrow", 390, False), ("dark", 1280, True)]:
                    browser.open(path, width, dark=dark)
                    browser.picture(folder / f"{name}_{label}.png")
                browser.printed(folder / f"{name}.pdf")
    finally:
        browser.close()
        if not args.keep:
            shutil.rmtree(folder, ignore_errors=True)
    sys.exit(int(failed))


main()
