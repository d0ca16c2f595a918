"""A sample of mutants of the numerical core, and the tests that catch them.

cargo-mutants names the mutants. It compiles every test program anew for each of them, which takes minutes. Here all
mutants of the sample are compiled into one build, and a variable of the environment picks one at run time:

    a + b    becomes    (if crate::mutant::is(7) { a - b } else { a + b })

So one build serves hundreds of mutants. Run from the repository, with `cargo install cargo-mutants` and
`pip install tree-sitter tree-sitter-rust` before it:

    python tests/mutation/run.py --mutants 300 --json mutants.json

A mutant is caught if a test of its area fails, or runs longer than its limit. What survives is listed.
The tree is that of HEAD, copied to FOLDER/tree; the build is FOLDER/target unless CARGO_TARGET_DIR says else.
"""

import argparse
import json
import os
import pathlib
import random
import re
import subprocess
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor

import tree_sitter
import tree_sitter_rust

ROOT = pathlib.Path(__file__).resolve().parents[2]

# area: its sources; what is asked of the program "answers" first, for it is quick and catches most; the library's tests; the programs after them
AREAS = {
    "fit": (["src/identify/**/*.rs"], ["of_fits", "of_noise", "of_validations"], ["identify::"], ["fit", "noise"]),
    "validate": (["src/validate/**/*.rs", "src/math/whiteness.rs"], ["of_validations", "of_fits"], ["validate::", "whiteness"], ["fit"]),
    "selection": (["src/gap/selection/**/*.rs"], ["of_effects"], ["gap::"], ["gap"]),
    "filter": (["src/navigate/**/*.rs"], ["of_the_filter"], ["navigate::"], ["navigate", "no_allocation"]),
    "exports": (["src/export/**/*.rs"], ["of_exports"], ["export::"], ["export_command", "noise", "gap"]),
}

SWITCH = """//! The mutant that the environment picks.
use std::sync::LazyLock;

static PICKED: LazyLock<u32> =
    LazyLock::new(|| std::env::var("GYROID_MUTANT").ok().and_then(|n| n.parse().ok()).unwrap_or(0));

#[inline(always)]
pub(crate) fn is(number: u32) -> bool {
    *PICKED == number
}
"""


class Source:
    """One file, its syntax tree, and the mutants that are put into it."""

    def __init__(self, tree, file):
        self.path = tree / file
        self.text = subprocess.run(["git", "show", f"HEAD:{file}"], cwd=tree, capture_output=True, check=True).stdout
        self.starts = [0] + [i + 1 for i, byte in enumerate(self.text) if byte == 10]
        self.tree = tree_sitter.Parser(tree_sitter.Language(tree_sitter_rust.language())).parse(self.text)
        self.sites = {}

    def offset(self, place):
        """The byte of a place that cargo-mutants gives as line and column (characters, both from 1)."""
        start = self.starts[place["line"] - 1]
        line = self.text[start : self.text.find(b"\n", start)].decode()
        return start + len(line[: place["column"] - 1].encode())

    def place(self, mutant):
        """The node that the mutant changes, or None where a switch cannot stand."""
        start, end = self.offset(mutant["span"]["start"]), self.offset(mutant["span"]["end"])
        node = self.tree.root_node.descendant_for_byte_range(start, end)
        genre = mutant["genre"]
        wanted = {
            "BinaryOperator": ("binary_expression", "compound_assignment_expr"),
            "UnaryOperator": ("unary_expression",),
            "FnValue": ("block",),
            "MatchArmGuard": ("match_pattern",),
            "MatchArm": ("match_arm",),
        }.get(genre, ())
        while node and node.type not in wanted:
            node = node.parent
        if not node:
            return None
        if genre == "BinaryOperator" and not any(c.start_byte == start and c.end_byte == end for c in node.children):
            return None
        if genre == "UnaryOperator" and node.start_byte != start:
            return None
        if genre == "FnValue" and not (node.parent and node.parent.type == "function_item"):
            return None
        return node

    def add(self, number, mutant, node):
        self.sites.setdefault((node.start_byte, node.end_byte, node.type), (node, []))[1].append((number, mutant))

    def render(self):
        return self.range(0, len(self.text), sorted(self.sites, key=lambda k: (k[0], -k[1])))

    def range(self, start, end, keys):
        """The text of a range with its switches; `keys` are the sites within it, outer ones first."""
        out, at = [], start
        while keys:
            key, rest = keys[0], keys[1:]
            inner = [k for k in rest if k[1] <= key[1]]
            keys = rest[len(inner) :]
            out.append(self.text[at : key[0]])
            out.append(self.switch(self.sites[key][0], self.sites[key][1], inner))
            at = key[1]
        return b"".join(out) + self.text[at:end]

    def part(self, node, keys):
        return self.range(node.start_byte, node.end_byte, [k for k in keys if node.start_byte <= k[0] and k[1] <= node.end_byte])

    def switch(self, node, mutants, inner):
        if node.type == "block":
            body = self.range(node.start_byte + 1, node.end_byte, inner)
            heads = [f" if crate::mutant::is({n}) {{ return {m['replacement']}; }}" for n, m in mutants]
            return b"{" + "".join(heads).encode() + body
        if node.type == "match_pattern":
            guard = node.child_by_field_name("condition")
            text = self.part(guard, inner)
            for n, m in mutants:
                is_ = f"crate::mutant::is({n})".encode()
                text = b"(" + is_ + b" || (" + text + b"))" if m["replacement"] == "true" else b"(!" + is_ + b" && (" + text + b"))"
            return self.range(node.start_byte, guard.start_byte, [k for k in inner if k[1] <= guard.start_byte]) + text
        if node.type == "match_arm":
            pattern = node.child_by_field_name("pattern")
            guard = pattern.child_by_field_name("condition")
            off = " && ".join(f"!crate::mutant::is({n})" for n, _ in mutants).encode()
            tail = self.range(pattern.end_byte, node.end_byte, [k for k in inner if k[0] >= pattern.end_byte])
            if guard:
                return self.text[node.start_byte : guard.start_byte] + off + b" && (" + self.part(guard, inner) + b")" + tail
            return self.text[node.start_byte : pattern.end_byte] + b" if " + off + tail
        if node.type == "unary_expression":
            operand = self.part(node.children[-1], inner)
            whole = node.children[0].text + operand
            return b"(if crate::mutant::is(%d) { %s } else { %s })" % (mutants[0][0], operand, whole)
        left, operator, right = node.children[0], node.children[1], node.children[2]
        left, right = self.part(left, inner), self.part(right, inner)
        arms = [b"if crate::mutant::is(%d) { %s %s %s } else " % (n, left, m["replacement"].encode(), right) for n, m in mutants]
        return b"(" + b"".join(arms) + b"{ " + left + b" " + operator.text + b" " + right + b" })"


def run(command, **more):
    return subprocess.run(command, capture_output=True, text=True, check=False, **more)


def sample(tree, count, seed):
    """Mutants of each area in equal number, drawn without replacement; (area, mutant) in order. `tree` is a clean one."""
    chosen = []
    for area, (globs, *_) in AREAS.items():
        files = [x for glob in globs for x in ("-f", glob)]
        done = run(["cargo", "mutants", "--list", "--json", *files], cwd=tree)
        if done.returncode:
            raise SystemExit(done.stderr)
        mutants = [m for m in json.loads(done.stdout) if m["genre"] != "StructField"]
        mutants.sort(key=lambda m: m["name"])
        random.Random(f"{seed} {area}").shuffle(mutants)
        chosen += [(area, m) for m in mutants[: count // len(AREAS)]]
    return chosen


def write(tree, chosen, dropped):
    """Puts the switches into the tree; returns the numbers of the mutants that got none."""
    sources, without = {}, set()
    for number, (_, mutant) in enumerate(chosen, 1):
        file = mutant["file"]
        if file not in sources:
            sources[file] = Source(tree, file)
        node = None if number in dropped else sources[file].place(mutant)
        if node is None:
            without.add(number)
        else:
            sources[file].add(number, mutant, node)
    for source in sources.values():
        write_new(source.path, source.render())
    return without


def write_new(path, content):
    """Writes what is not there: cargo builds anew what has another date."""
    if not path.exists() or path.read_bytes() != content:
        path.write_bytes(content)


def compiler(tree, env, command):
    """What cargo says, one object a line, and where the errors are: (file, line, column)."""
    done = run(["cargo", *command, "--locked", "--message-format=json"], cwd=tree, env=env)
    said = [json.loads(line) for line in done.stdout.splitlines()]
    errors = [m["message"] for m in said if m["reason"] == "compiler-message" and m["message"]["level"] == "error"]
    places = [(s["file_name"], s["line_start"], s["column_start"]) for e in errors for s in e["spans"] if s["is_primary"]]
    if done.returncode and not places:
        raise SystemExit(done.stderr)
    return said, places


def at(tree, file, line, column):
    """The mutant whose switch stands last before a place, or None."""
    switches = re.finditer(r"crate::mutant::is\((\d+)\)", (tree / file).read_text().split("\n")[line - 1])
    return next((int(s[1]) for s in reversed(list(switches)) if s.start() < column), None)


def build(tree, env, chosen, notes):
    """The test programs by name, and the numbers of the mutants that are not in them, which the file `notes` keeps."""
    names = [mutant["name"] for _, mutant in chosen]
    kept = json.loads(notes.read_text()) if notes.exists() else {}
    dropped = set(kept.get("dropped", [])) if kept.get("mutants") == names else set()
    while True:
        without = write(tree, chosen, dropped)
        _, places = compiler(tree, env, ["check", "--lib"])
        if not places:
            break
        wrong = {at(tree, *place) for place in places} - {None} - dropped
        if not wrong:
            raise SystemExit(f"the build fails where no mutant stands: {places[:5]}")
        dropped |= wrong
        print(f"{len(dropped)} of {len(chosen)} mutants do not compile", flush=True)
    notes.write_text(json.dumps({"mutants": names, "dropped": sorted(dropped)}))
    said, _ = compiler(tree, env, ["test", "--no-run"])
    made = [m for m in said if m.get("executable") and m["profile"]["test"]]
    return {m["target"]["name"]: m["executable"] for m in made}, without


def stages(area, programs):
    _, answers, library, names = AREAS[area]
    return [(programs["answers"], answers), (programs["gyroid"], library), *((programs[name], []) for name in names)]


def test(tree, env, program, filters, number, limit):
    """(passed, failed tests) of a program under a mutant."""
    env = {**env, "GYROID_MUTANT": str(number), "RUSTC_BOOTSTRAP": "1"}
    command = [program, "-Z", "unstable-options", "--fail-fast", "--test-threads=1", *filters]
    try:
        done = run(command, cwd=tree, env=env, timeout=limit)
    except subprocess.TimeoutExpired:
        return False, ["time limit"]
    return done.returncode == 0, re.findall(r"^test (\S+) .*FAILED", done.stdout, re.M)[:3] or ["ended"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", 1)[0])
    parser.add_argument("--mutants", type=int, default=300, help="mutants in all, the same number in each area")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=pathlib.Path, default=ROOT / "target/mutation")
    parser.add_argument("--json", type=pathlib.Path, help="every mutant and what caught it; what is there is taken over")
    asked = parser.parse_args()

    tree = asked.folder / "tree"
    head = run(["git", "rev-parse", "HEAD"], cwd=ROOT).stdout
    if not tree.exists():
        run(["git", "worktree", "add", "--detach", "--force", str(tree), "HEAD"], cwd=ROOT)
    elif run(["git", "rev-parse", "HEAD"], cwd=tree).stdout != head:
        run(["git", "checkout", "-q", "--force", "--detach", head.strip()], cwd=tree)
    env = {**os.environ, "CARGO_INCREMENTAL": "1", "CARGO_MANIFEST_DIR": str(tree)}
    env.setdefault("CARGO_TARGET_DIR", str(asked.folder / "target"))

    with tempfile.TemporaryDirectory(dir=asked.folder) as clean:
        archive = subprocess.run(["git", "archive", "HEAD"], cwd=tree, capture_output=True, check=True).stdout
        subprocess.run(["tar", "-x", "-C", clean], input=archive, check=True)
        chosen = sample(clean, asked.mutants, asked.seed)
    write_new(tree / "src/mutant.rs", SWITCH.encode())
    write_new(tree / "src/lib.rs", Source(tree, "src/lib.rs").text + b"\nmod mutant;\n")
    programs, without = build(tree, env, chosen, asked.folder / "left_out.json")
    limits = {}
    for area in AREAS:
        for program, filters in stages(area, programs):
            start = time.monotonic()
            passed, failed = test(tree, env, program, filters, 0, None)
            if not passed:
                raise SystemExit(f"without a mutant {program} {filters} fails: {failed}")
            limits[program, tuple(filters)] = 20 + 6 * (time.monotonic() - start)

    def judge(numbered):
        number, (area, mutant) = numbered
        for program, filters in stages(area, programs):
            passed, failed = test(tree, env, program, filters, number, limits[program, tuple(filters)])
            if not passed:
                return area, mutant["name"], failed
        return area, mutant["name"], None

    # what an earlier run found is taken over; areas in turn, so that a run that is broken off is a sample too
    results = json.loads(asked.json.read_text()) if asked.json and asked.json.exists() else []
    known = {r["mutant"] for r in results}
    each = asked.mutants // len(AREAS)
    live = [(n, c) for n, c in enumerate(chosen, 1) if n not in without and c[1]["name"] not in known]
    live.sort(key=lambda numbered: (numbered[0] - 1) % each)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for area, name, failed in pool.map(judge, live):
            results.append({"area": area, "mutant": name, "caught_by": failed})
            print(f"{'caught  ' if failed else 'SURVIVES'} {area}: {name}{' ' + failed[0] if failed else ''}", flush=True)
            if asked.json:
                asked.json.write_text(json.dumps(results, indent=1))
    for area in AREAS:
        of = [r for r in results if r["area"] == area]
        print(f"{area}: {len(of)} run, {sum(r['caught_by'] is None for r in of)} survive")
    print(f"all: {len(results)} run, {sum(r['caught_by'] is None for r in results)} survive")


if __name__ == "__main__":
    main()
