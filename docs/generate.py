"""Writes the pages of the book that repeat the code: python docs/generate.py

- `configuration.md`: keys, whether they must be given, defaults and meanings are those of `src/config`, `src/bias/discrete.rs`
  and `src/traction`; ranges are those of `src/config/check.rs`.
- `channels.md`, a part of `formats.md`: the channels of `src/signal/log.rs`, and the names of columns that
  `src/ingest/columns/channels.rs` takes for them.

`docs/check.py` says where a page is old. The pages of effects are made by `tests/house/book.rs`.
"""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
BOOK = ROOT / "docs/src"
SOURCES = ["config/schema.rs", "config/noise.rs", "config/temperature.rs", "config/acts_on.rs", "config/custom.rs",
           "bias/discrete.rs", "traction/mod.rs",
           "traction/burckhardt.rs", "traction/pacejka.rs", "traction/dugoff.rs", "traction/linear.rs",
           "noise/low_pass.rs", "noise/narrow_band.rs"]

MADE = "<!-- Made from the code: python docs/generate.py -->\n\n"

# units by the end of a key, the longest that fits
UNITS = {
    "rad_s": "rad/s", "rad_sqrt_s": "rad/√s", "rad_s_sqrt_s": "rad/s/√s", "rad_s2": "rad/s²", "rad": "rad", "s": "s", "hz": "Hz",
    "kg": "kg", "kg_m2": "kg·m²", "m": "m", "m_s": "m/s", "n_m_s": "N·m·s", "n_m_sqrt_s": "N·m·√s", "n_m_a": "N·m/A", "c": "°C",
    "rad2_s2": "rad²/s²", "s2": "s²", "rad_s_k": "rad/s/K", "rad_s_k2": "rad/s/K²", "rad2_s2_k": "rad²/s²/K", "rad2_s2_k2": "rad²/s²/K²",
    "rad2_s2_k3": "rad²/s²/K³", "rad2_s2_k4": "rad²/s²/K⁴",
}

HEAD = """# Configuration

One TOML file is read by every command: simulator, filter, diagnosis and exports. Its units are SI, and each key carries its own. This is schema 1.

Who writes it? You write `[vehicle]`, `[encoder]` and `[pose]`, or take a file from `data/`. `gyroid fit --base` adds `[gyro]`, `[validation]` and `[provenance]`. `gyroid noise --write` adds `[gyro.noise]`.
`gyroid gap diagnose --write-sim` adds `[[effect]]`. A robot without its gyro, as its builder knows it:

```toml
{{#include ../../data/robot.toml}}
```

An unknown key, a missing key and a value that cannot be physical are refused with the file, the line and a hint:

<!-- check: exit 1 -->
```sh
sed 's/mass_kg/mas_kg/' data/robot.toml > slip.toml
gyroid fit data/power_on.csv --base slip.toml -o gyroid.toml
```
```text
```

A file with `[provenance]` is sealed by a checksum over all its bytes. To edit it by hand, delete that table: the file is then read as unsigned, which the commands say.

*must* marks keys without which their table is refused. Tables themselves may be left out; `kind = "driving"` needs `[vehicle]` and `[encoder]` beside `[gyro]`.

"""


class Field:
    def __init__(self, key, kind, docs, attributes):
        self.key = re.search(r'rename = "(\w+)"', attributes).group(1) if "rename =" in attributes else key
        self.kind, self.docs, self.attributes = kind, docs, attributes

    @property
    def inner(self):
        return re.sub(r"^(?:Option|Vec)<(.*)>$", r"\1", self.kind)


def parse():
    structs, enums, text = {}, {}, ""
    for source in SOURCES:
        text += (ROOT / "src" / source).read_text(encoding="utf-8")
    item = re.compile(r"((?:^[ ]*///[^\n]*\n|^[ ]*#\[[^\n]*\n)*)^[ ]*pub (struct|enum) (\w+) \{\n(.*?)^\}", re.M | re.S)
    for head, what, name, body in item.findall(text):
        if "Serialize" not in head:
            continue
        if what == "struct":
            fields = re.findall(r"((?:[ ]*///[^\n]*\n|[ ]*#\[[^\n]*\n)*)[ ]*pub (\w+): ([^\n]*),\n", body)
            structs[name] = (words(head), [Field(k, t, words(h), h) for h, k, t in fields if "serde(skip)" not in h])
        else:
            variants = re.findall(r"((?:[ ]*///[^\n]*\n|[ ]*#\[[^\n]*\n)*)[ ]*(\w+)(?:\((\w+)\))?,\n", body)
            enums[name] = [(re.sub(r"(?<!^)([A-Z])", r"_\1", v).lower(), words(h), "#[default]" in h, t) for h, v, t in variants]
    return structs, enums, text


def words(head):
    return " ".join(re.findall(r"^[ ]*/// ?(.*)$", head, re.M)).strip()


def ranges():
    text = (ROOT / "src/config/check.rs").read_text(encoding="utf-8")
    constants = dict(re.findall(r"const (\w+): f64 = ([^;]+);", text))
    out = {}
    for key, rule in re.findall(r'(?:one|maybe)\(\s*"([\w.]+)",[^;]*?,\s*(\w+(?:\([\w /.]+\))?)\s*\)\?', text):
        bound = re.match(r"Within\((\w+)(?: / ([\d.]+))?\)", rule)
        if bound:
            out[key] = f"within ±{float(constants[bound.group(1)]) / float(bound.group(2) or 1):g}"
        else:
            out[key] = {"Positive": "> 0", "NotNegative": "≥ 0", "Share": "> 0, ≤ 1", "Finite": ""}[rule]
    for law, keys in {"burckhardt": "c1 c2 c3", "pacejka": "b c d e", "dugoff": "friction stiffness", "linear": "stiffness friction"}.items():
        for key in keys.split():
            out[f"traction.law.{law}.{key}"] = {"c3": "≥ 0", "e": "≤ 1"}.get(key, "> 0")
    return out


def unit(key, kind):
    if kind in ("String", "bool", "i64", "u64") or key in ("c1", "c2", "c3", "b", "c", "d", "e"):
        return ""
    fitting = [u for u in UNITS if key.endswith("_" + u)]
    return UNITS[max(fitting, key=len)] if fitting else ""


def default(field, enums, text):
    a = field.attributes
    named = re.search(r'default = "(?:\w+::)?(\w+)"', a)
    if named:
        return re.search(rf"fn {named.group(1)}\(\) -> f64 \{{\s*([\d.]+)", text).group(1)
    if field.kind.startswith("Option") or "default" in a and field.kind.startswith("Vec"):
        return "–"
    if "default" in a:
        if field.inner in enums:
            return f"`\"{next(v for v, _, d, _ in enums[field.inner] if d)}\"`"
        return {"f64": "0", "bool": "false", "String": "empty"}[field.kind]
    return "*must*"


def table(path, name, structs, enums, text, limits, repeated=False):
    docs, fields = structs[name]
    out, below = [], []
    dotted = ".".join(path)
    docs = re.sub(r"^`[^`]*`(?:: ?|\.$)", "", docs)
    docs = docs if docs.startswith(("e(", "db")) else docs[:1].upper() + docs[1:]
    title = "The top of the file" if not path else f"`[[{dotted}]]`" if repeated else f"`[{dotted}]`"
    out.append(f"## {title}\n" + (f"\n{docs}\n" if docs else ""))
    rows = []
    for field in fields:
        inner = field.inner
        if inner in structs:
            shown = f"[[{'.'.join([*path, field.key])}]]" if field.kind.startswith("Vec") else f"[{'.'.join([*path, field.key])}]"
            if inner in ("NoiseTerm", "GaussMarkovTerm"):
                keys = ", ".join(f"`{f.key}`" for f in structs[inner][1])
                rows.append((field.key, "table", unit(field.key, ""), default(field, enums, text), "", f"{field.docs} A table with {keys}."))
            else:
                rows.append((field.key, "table", "", default(field, enums, text), "", f"{field.docs} See `{shown}`."))
                below.append(([*path, field.key], inner, field.kind.startswith("Vec")))
            continue
        if inner in enums and any(t for _, _, _, t in enums[inner]):
            rows.append((field.key, "table", "", default(field, enums, text), "", field.docs))
            below += [([*path, field.key, v], t, False) for v, _, _, t in enums[inner]]
            continue
        meaning = field.docs.replace("None: ", "Where it is not given, ").replace("`None` where", "left out where")
        if inner in enums:
            kind = "one of"
            meaning += " " + "; ".join(f'`"{v}"`: {d[:1].lower() + d[1:].rstrip(".")}' for v, d, _, _ in enums[inner]) + "."
        elif inner == "BTreeMap<String, f64>":
            rows.append(("its parameters", "number, unit in the key", "", "–", "", f"{field.docs} See [effects at rest](effects_rest.md) and [of drives](effects_drives.md)."))
            continue
        else:
            kind = {"f64": "number", "[f64; 2]": "two numbers", "bool": "true, false", "String": "text", "i64": "whole number", "u64": "whole number"}[inner]
            kind = "numbers" if field.kind.startswith("Vec") else kind
        if field.key == "ci95" or inner == "[f64; 2]":
            kind = "two numbers"
        rows.append((field.key, kind, unit(field.key, inner), default(field, enums, text), limits.get(".".join([*path, field.key]), ""), meaning))
    out.append("| key | value | default | range | meaning |\n|---|---|---|---|---|")
    for key, kind, of_unit, value, limit, meaning in rows:
        key, kind = key if " " in key else f"`{key}`", ", ".join(filter(None, (kind, of_unit)))
        out.append(f"| {key} | {kind} | {value} | {limit} | {meaning.replace('|', chr(92) + '|')} |")
    text_of = "\n".join(out) + "\n"
    for place, inner, is_list in below:
        text_of += "\n" + table(place, inner, structs, enums, text, limits, is_list)
    return text_of


def configuration(old):
    """The page of keys; what the command in its head prints is kept as it stands in the old page."""
    structs, enums, text = parse()
    shown = re.search(r"```text\n.*?```", old, re.S)
    head = HEAD.replace("```text\n```", shown.group(0)) if shown else HEAD
    return head + MADE + table([], "Config", structs, enums, text, ranges())


def channels(_):
    """The table of channels."""
    names = re.findall(r'/// ([^\n]*)\n    pub const (\w+): &str = "(\w+)";', (ROOT / "src/signal/log.rs").read_text(encoding="utf-8"))
    code = (ROOT / "src/ingest/columns/channels.rs").read_text(encoding="utf-8")
    entries = re.findall(r"(?:entry|side)\(\s*channel::(\w+),\s*Quantity::\w+,\s*&\[([^]]*)\],?\s*(?:&\[([^]]*)\],?\s*)?\)", code)
    spellings = {name: re.findall(r'"(\w+)"', words) for name, words, _ in entries}
    bare = {name: re.findall(r'"(\w+)"', words) for name, _, words in entries}
    rows = []
    for docs, name, column in names:
        others = [f"`{w}`" for w in spellings[name] if not column.startswith(w)]
        without = [f"`{w}`" for w in bare[name]]
        rows.append(f"| `{column}` | {docs.rstrip('.')} | {', '.join(others)} | {', '.join(without)} |")
    head = "| channel | is | with a unit also | without a unit also |\n|---|---|---|---|\n"
    return MADE + head + "\n".join(rows) + "\n"


PAGES = {"configuration.md": configuration, "channels.md": channels}


def old_pages():
    """Pages that no longer say what the code says."""
    kept = {name: (BOOK / name).read_text(encoding="utf-8") if (BOOK / name).exists() else "" for name in PAGES}
    return {name: new for name, make in PAGES.items() if (new := make(kept[name])) != kept[name]}


if __name__ == "__main__":
    if len(sys.argv) > 1:
        sys.exit(__doc__)
    for name, text in old_pages().items():
        (BOOK / name).write_text(text, encoding="utf-8")
        print(f"wrote {name}")
