"""Runs the commands of README and book as they stand there, and checks every link.

    python docs/check.py [--update] [--book DIR] GYROID [PAGE ...]

GYROID is the program that the commands find as `gyroid`. Each page has a scratch folder of its own in which `data` is the
repository's; the fenced blocks of the kind `sh` run there, from top to bottom. A block of the kind `text` right behind one
shows what it prints: both are compared line by line, a line `…` standing for any number of lines. With --update the pages are
written anew with what was printed. A comment before a block says what is special about it:

    <!-- check: exit 3 -->        its last command ends with this exit code
    <!-- check: yours REASON -->  needs the reader's own files, and is not run
    <!-- check: elsewhere REASON -->  a build, a test or a bench, and not run here

Commands that are not run, and those in sentences, must have options that the program knows. Shares that README and evidence
state must stand in the benches in `data`, and so must the table of peers. Pages that repeat the code must be those that
`generate.py` makes.

--book DIR is the built book: its internal links and anchors are checked. Exit code 1 where anything is wrong.
"""

import argparse
import difflib
import functools
import html.parser
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import urllib.parse

import generate

ROOT = pathlib.Path(__file__).resolve().parent.parent
README_BYTES = 7000
FENCE = re.compile(r"^```(\w*)[^\n]*\n(.*?)^```$", re.M | re.S)
COMMENT = re.compile(r"<!--\s*([^>]*?)\s*-->\s*$")
TIMEOUT_S = 300


def pages():
    return [ROOT / "README.md", *sorted((ROOT / "docs/src").rglob("*.md"))]


class Block:
    """A fenced block: its kind, text, place and the comment in front of it."""

    def __init__(self, match, page):
        self.kind, self.text = match.group(1), match.group(2)
        (self.start, self.end), self.text_span = match.span(), match.span(2)
        before = page[: self.start]
        self.line = before.count("\n") + 1
        comment = COMMENT.search(before)
        words = comment.group(1) if comment else ""
        if words in ("main-job", "test-command"):
            words = {"main-job": "", "test-command": "check: elsewhere"}[words]
        self.mark, _, self.argument = words.removeprefix("check:").strip().partition(" ")
        if self.mark not in ("", "exit", "yours", "elsewhere") and words.startswith("check:"):
            raise SystemExit(f"line {self.line}: no mark is called {self.mark}")


def blocks(text):
    return [Block(m, text) for m in FENCE.finditer(text)]


def same(shown, printed):
    """Whether the printed lines are those shown, `…` standing for any number of them."""
    shown = [line.rstrip() for line in shown.rstrip("\n").split("\n")]
    printed = [line.rstrip() for line in printed.rstrip("\n").split("\n")]

    @functools.lru_cache(None)
    def match(i, j):
        if i == len(shown):
            return j == len(printed)
        if shown[i] == "…":
            return match(i + 1, j) or (j < len(printed) and match(i, j + 1))
        return j < len(printed) and shown[i] == printed[j] and match(i + 1, j + 1)

    return match(0, 0)


def renewed(shown, printed):
    """The printed text, abridged as the shown one is: for each line behind a `…` the one that is most like it."""
    shown, printed = shown.rstrip("\n").split("\n"), printed.rstrip("\n").split("\n")
    if "…" not in shown:
        return "\n".join(printed) + "\n"
    out, at = [], 0
    for i, line in enumerate(shown):
        if line == "…":
            out.append(line)
            continue
        if i > 0 and shown[i - 1] == "…":
            # behind the last `…` stand the last lines, whatever they say
            last = "…" not in shown[i:]
            like = lambda j: difflib.SequenceMatcher(None, line, printed[j]).ratio()
            at = max(at, len(printed) - len(shown) + i) if last else max(range(at, len(printed)), key=like, default=at)
        out += printed[at : at + 1]
        at += 1
    return "\n".join(out) + "\n"


def run_page(path, text, gyroid, update):
    """Runs a page's blocks; gives its faults, and its text with what was printed now."""
    faults, edits = [], []
    found = blocks(text)
    shell = [b for b in found if b.kind == "sh"]
    if not shell:
        return faults, text
    name = path.relative_to(ROOT)
    with tempfile.TemporaryDirectory() as place:
        os.symlink(ROOT / "data", pathlib.Path(place, "data"))
        environment = {**os.environ, "PATH": f"{gyroid.parent}:{os.environ['PATH']}", "COLUMNS": "100"}
        for block in shell:
            if block.mark in ("yours", "elsewhere"):
                faults += [f"{name}:{block.line}: {f}" for f in unknown_options(block.text, gyroid)]
                continue
            # the README's first command builds the program that is tried here
            script = block.text.replace("cargo run -- ", "gyroid ")
            run = subprocess.run(
                ["bash", "-euo", "pipefail", "-c", script], cwd=place, env=environment, timeout=TIMEOUT_S,
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            )
            wanted = int(block.argument) if block.mark == "exit" else 0
            if run.returncode != wanted:
                faults.append(f"{name}:{block.line}: exit code {run.returncode}, not {wanted}:\n{run.stdout}")
                continue
            behind = (b for b in found if b.kind == "text" and b.start > block.start)
            shown = next((b for b in behind if not text[block.end : b.start].strip()), None)
            if shown is None or same(shown.text, run.stdout):
                continue
            if update:
                edits.append((shown.text_span, renewed(shown.text, run.stdout)))
            else:
                faults.append(f"{name}:{shown.line}: the page shows\n{shown.text}\nand the command prints\n{run.stdout}")
    for (start, end), new in reversed(edits):
        text = text[:start] + new + text[end:]
    return faults, text


@functools.lru_cache(None)
def help_of(gyroid, words):
    run = subprocess.run([gyroid, *words, "--help"], capture_output=True, text=True, check=False)
    return run.stdout if run.returncode == 0 else ""


def unknown_options(script, gyroid):
    """Faults of `gyroid` lines that are not run: commands and long options that the program does not know."""
    faults = []
    script = re.sub(r"\\\n\s*", " ", script)
    for line in script.splitlines():
        try:
            words = shlex.split(line, comments=True)
        except ValueError:
            continue
        if not words or words[0] != "gyroid":
            continue
        words, commands = words[1:], []
        if not words:
            continue
        depth = {"gap": 3 if words[1:2] == ["bench"] else 2}.get(words[0], 1)
        while words and re.fullmatch(r"[a-z]+", words[0]) and len(commands) < depth:
            commands.append(words.pop(0))
        page = help_of(str(gyroid), tuple(commands))
        if not page:
            faults.append(f"`gyroid {' '.join(commands)}`: no such command")
            continue
        for word in words:
            option = re.match(r"--[a-z][a-z-]*", word)
            if option and not re.search(rf"{re.escape(option.group(0))}(?![a-z-])", page):
                faults.append(f"`gyroid {' '.join(commands)}` has no option {option.group(0)}")
    return faults


def inline_commands(path, text, gyroid):
    """Faults of commands that stand in a sentence."""
    plain = FENCE.sub("", text)
    spans = re.findall(r"`(gyroid [^`\n]+)`", plain)
    name = path.relative_to(ROOT)
    ok = lambda span: not re.search(r"[|…]", span)
    return [f"{name}: {fault}" for span in spans if ok(span) for fault in unknown_options(span, gyroid)]


def file_links(path, text):
    """Faults of links to files of the repository: those of a page's source."""
    faults = []
    plain = FENCE.sub("", text)
    for target in re.findall(r"\]\(([^)\s]+)\)", plain) + re.findall(r'<img src="([^"]+)"', plain):
        link = urllib.parse.urlsplit(target)
        if link.scheme or not link.path:
            continue
        if not (path.parent / urllib.parse.unquote(link.path)).exists():
            faults.append(f"{path.relative_to(ROOT)}: no file {target}")
    return faults


def fractions(value):
    """Every (right, of) in a score."""
    if isinstance(value, dict):
        if "right" in value and "of" in value:
            yield value["right"], value["of"]
        value = list(value.values())
    for part in value if isinstance(value, list) else []:
        yield from fractions(part)


def old_figures():
    """Faults of shares that README and evidence state, and that neither a bench nor a report in `data` holds."""
    known = set()
    for path in (ROOT / "data").glob("gap*bench.json"):
        known |= set(fractions(json.loads(path.read_text(encoding="utf-8"))))
    for path in (ROOT / "data").glob("gap*.md"):
        known |= {(int(a), int(b)) for a, b in re.findall(r"(\d+)/(\d+)", path.read_text(encoding="utf-8"))}
    stated = {"README.md": r"(\d+) of (\d+)", "docs/src/evidence.md": r"\| (\d+)/(\d+)(?: = [\d.]+)?(?= \|)"}
    return [
        f"{page}: {right} of {of} stands in no bench"
        for page, form in stated.items()
        for right, of in re.findall(form, (ROOT / page).read_text(encoding="utf-8"))
        if (int(right), int(of)) not in known
    ]


def old_peers():
    """Faults of the table of peers in evidence: it must be that of `data/peers.json`."""
    table = json.loads((ROOT / "data/peers.json").read_text(encoding="utf-8"))["table"]
    page = (ROOT / "docs/src/evidence.md").read_text(encoding="utf-8")
    return [] if "\n".join(table) in page else ["docs/src/evidence.md: its table of peers is not that of data/peers.json"]


class Links(html.parser.HTMLParser):
    """Ids and internal links of a page of the book."""

    def __init__(self):
        super().__init__()
        self.ids, self.links = set(), []

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.ids.add(attributes.get("id") or attributes.get("name"))
        target = attributes.get("href") if tag == "a" else attributes.get("src") if tag == "img" else None
        if target and not urllib.parse.urlsplit(target).scheme:
            self.links.append(target)


def book_links(book):
    """Faults of links and anchors in the built book."""
    read = {}
    for page in book.rglob("*.html"):
        if page.name in ("print.html", "toc.html", "404.html"):
            continue
        read[page.resolve()] = links = Links()
        links.feed(page.read_text(encoding="utf-8"))
    faults = []
    for page, links in read.items():
        for target in links.links:
            link = urllib.parse.urlsplit(target)
            to = (page.parent / urllib.parse.unquote(link.path)).resolve() if link.path else page
            anchor = urllib.parse.unquote(link.fragment)
            if not to.exists():
                faults.append(f"{page.name}: no page {target}")
            elif anchor and to in read and anchor not in read[to].ids:
                faults.append(f"{page.name}: no anchor {target}")
    if not read:
        faults.append(f"{book}: no pages")
    return faults


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("gyroid", type=lambda p: pathlib.Path(os.path.abspath(p)))
    parser.add_argument("pages", nargs="*", type=lambda p: pathlib.Path(p).resolve())
    parser.add_argument("--update", action="store_true", help="write what is printed into the pages")
    parser.add_argument("--book", type=pathlib.Path, help="the built book, whose links are checked")
    given = parser.parse_args()
    if not (given.gyroid.name == "gyroid" and os.access(given.gyroid, os.X_OK)):
        parser.error(f"{given.gyroid} is no program called gyroid")
    faults, ran = [], 0
    for path in given.pages or pages():
        text = path.read_text(encoding="utf-8")
        found, renewed_text = run_page(path, text, given.gyroid, given.update)
        faults += found + inline_commands(path, text, given.gyroid) + file_links(path, text)
        ran += sum(b.kind == "sh" and b.mark in ("", "exit") for b in blocks(text))
        if renewed_text != text:
            path.write_text(renewed_text, encoding="utf-8")
            print(f"renewed {path.relative_to(ROOT)}")
    size = (ROOT / "README.md").stat().st_size
    if size > README_BYTES:
        faults.append(f"README.md: {size} bytes, more than {README_BYTES}")
    faults += [f"docs/src/{name} is not what the code says: python docs/generate.py" for name in generate.old_pages()]
    faults += old_figures() + old_peers()
    if given.book:
        faults += book_links(given.book)
    for fault in faults:
        print(f"docs: {fault}", file=sys.stderr)
    print(f"{ran} blocks of commands ran, {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
