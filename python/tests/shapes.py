#!/usr/bin/env python3
"""Writes `docs/schema`, JSON Schemas made from an answer or more of every command, and from these `gyroid/_shapes`, the types of Python.

python shapes.py [--check]: with `--check` answers are held against the schemas instead, without those about drawn logs, which take minutes,
and the types against those that the schemas give; what differs is shown, and the exit code is 1.
"""

from __future__ import annotations

import difflib
import json
import re
import sys
from pathlib import Path
from typing import Any, TypeAlias

import jsonschema

from answers import answers

PACKAGE = Path(__file__).parents[1] / "gyroid"
SCHEMAS = PACKAGE.parents[1] / "docs" / "schema"
HEAD = '"Types of {}, as the JSON has them. Written by shapes.py: do not edit."'
#: Files of types and the kinds of answers in each.
FILES = {
    "_rest": ("answers on logs at rest", ("Fit", "Noise", "Validate")),
    "_drive": ("answers on drives and gaps", ("Navigate", "Simulate", "GapDiagnose", "GapExplain", "GapCompare", "GapPlan", "GapPower")),
    "_other": ("other answers", ("Export", "Inspect", "Study")),
}
#: Objects whose keys are data, by the end of their path.
MAPS = ("parameters", "std", "axes", "ci95_of", "rms", "rms_ci95", "factors", "nees", "convergence", "estimates")
#: The parameters of a fit are the same in every answer.
FIXED = ("Fit.parameters",)

Schema: TypeAlias = dict[str, Any]


def schema(values: list[Any], path: str) -> Schema:
    """What all of these values are."""
    there = [value for value in values if value is not None]
    kinds = {kind(value) for value in there}
    kinds -= {"integer"} if "number" in kinds else set()
    if not kinds:
        return {}
    names = sorted(kinds) + ["null"] * (len(there) < len(values))
    made: Schema = {"type": names if len(names) > 1 else names[0]}
    if items := [item for value in there if isinstance(value, list) for item in value]:
        # an interval may be open at either end
        made["items"] = schema(items + [None] * path.rpartition(".")[2].startswith("ci95"), path)
    objects = [value for value in there if isinstance(value, dict)]
    if objects and path.endswith(tuple("." + name for name in MAPS)) and path not in FIXED:
        made["additionalProperties"] = schema([item for value in objects for item in value.values()], path + ".value")
    elif objects:
        keys = dict.fromkeys(key for value in objects for key in value)
        made["properties"] = {key: schema([v[key] for v in objects if key in v], f"{path}.{key}") for key in keys}
        made["required"] = [key for key in keys if all(key in value for value in objects)]
        made["additionalProperties"] = False
    return made


def kind(value: Any) -> str:
    """The name that JSON Schema has for a value's type."""
    names = {bool: "boolean", int: "integer", float: "number", str: "string", list: "array", dict: "object"}
    return names[type(value)]


def kinds_of(of: Schema) -> set[str]:
    """The types that a schema allows."""
    kinds = of.get("type", [])
    return set(kinds if isinstance(kinds, list) else [kinds])


def schemas(drawn: bool) -> dict[str, Schema]:
    """The schema of each command; `drawn`: also of answers about drawn logs."""
    made = {}
    for command, kinds in answers(drawn).items():
        each = []
        for name, values in kinds.items():
            one = schema(values, name)
            [mark] = {value["schema"] for value in values}
            one["properties"]["schema"] = {"const": mark}
            each.append({"title": name, **one})
        head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
        made[command] = head | (each[0] if len(each) == 1 else {"title": f"gyroid {command.replace('.', ' ')}", "oneOf": each})
    return made


class Shapes:
    """Classes by what they hold, so that what is alike is one class."""

    def __init__(self) -> None:
        self.classes: dict[str, tuple[str, str, list[tuple[str, str]]]] = {}
        self.by_content: dict[tuple[str, tuple[tuple[str, str], ...]], str] = {}

    def type_of(self, of: Schema, path: str, required: bool = True) -> str:
        """The type of what fits the schema."""
        if "const" in of:
            return "str"
        kinds = kinds_of(of)
        optional = " | None" if "null" in kinds or not required else ""
        kinds -= {"null"}
        if len(kinds) != 1:
            return "Any"
        [one] = kinds
        if one == "object":
            return self.object(of, path) + optional
        if one == "array":
            return self.list(of.get("items", {}), path) + optional
        return {"boolean": "bool", "integer": "int", "number": "float", "string": "str"}[one] + optional

    def list(self, items: Schema, path: str) -> str:
        """The type of a list of such items."""
        kinds = kinds_of(items)
        if kinds == {"object"}:
            return f"Rows[{self.object(items, path)}]"
        if kinds == {"string"}:
            return "tuple[str, ...]"
        return "Array" if kinds and not kinds & {"object", "string"} else "tuple[Any, ...]"

    def object(self, of: Schema, path: str) -> str:
        """The class of such objects."""
        if of["additionalProperties"]:
            return f"dict[str, {self.type_of(of['additionalProperties'], path + '.value')}]"
        keys = [key for key in of["properties"] if key.isidentifier()]
        base = "Estimate" if {"estimate", "std"} <= set(keys) else "Record"
        if base == "Estimate" and set(keys) <= {"estimate", "std", "std_white", "ci95"}:
            return "Estimate"
        fields = []
        for key in keys:
            type_name = self.type_of(of["properties"][key], f"{path}.{key}", key in of["required"])
            if not (base == "Estimate" and key in ("estimate", "std", "std_white", "ci95")):
                fields.append((key, type_name))
        content = (base, tuple(fields))
        if "." not in path or content not in self.by_content:
            words = path.replace(".", "_").split("_")
            name = ("_" if "." in path else "") + "".join(word[:1].upper() + word[1:] for word in words)
            self.by_content[content] = name
            self.classes[name] = (path.split(".")[0], base, fields)
        return self.by_content[content]


def types(of: dict[str, Schema]) -> dict[str, str]:
    """The modules by name."""
    shapes = Shapes()
    variants = {variant.get("title"): variant for one in of.values() for variant in one.get("oneOf", [one])}
    for name in [name for _, names in FILES.values() for name in names]:
        shapes.object(variants[name], name)
    made: dict[str, str] = {}
    where: dict[str, str] = {}
    for file, (what, roots) in FILES.items():
        own = {name: rest for name, (root, *rest) in shapes.classes.items() if root in roots}
        parts, used = [], set()
        for name, (base, fields) in own.items():
            used |= {word for _, kind in fields for word in re.findall(r"\w+", kind)} | {base}
            lines = [f"    {key}: {kind}" for key, kind in fields] or ["    pass"]
            parts.append("\n".join([f"class {name}({base}):", *lines, ""]))
        known = {word: "gyroid._record" for word in ("Array", "Estimate", "Record", "Rows")} | where
        imports = ["from typing import Any", ""] if "Any" in used else []
        for module in dict.fromkeys(known.values()):
            names = sorted(word for word in used if known.get(word) == module)
            imports += [f"from {module} import {name}" for name in names]
        head = "\n".join([f'""{HEAD.format(what)}""', "", "from __future__ import annotations", "", *imports, ""])
        made[file] = "\n\n".join([head, *parts])
        where |= dict.fromkeys(own, f"gyroid._shapes.{file}")
    lines = [f"from {module} import {name} as {name}" for name, module in where.items()]
    made["__init__"] = "\n".join([f'""{HEAD.format("the answers")}""', "", *lines, ""])
    return made


def faults() -> list[str]:
    """What differs between answers and schemas, and between these and the types."""
    known = {path.stem: json.loads(path.read_text()) for path in SCHEMAS.glob("*.json")}
    found = []
    for command, kinds in answers(drawn=False).items():
        validator = jsonschema.Draft202012Validator(known[command])
        errors = [error for values in kinds.values() for value in values for error in validator.iter_errors(value)]
        found += [f"{command}: {error.json_path}: {error.message}" for error in errors]
    for name, text in types(known).items():
        path = PACKAGE / "_shapes" / f"{name}.py"
        found += difflib.unified_diff(path.read_text().splitlines(), text.splitlines(), str(path), "as the schemas have it", lineterm="")
    return found


def main() -> int:
    """Writes the files, or compares them."""
    if "--check" in sys.argv:
        found = faults()
        print("\n".join(found), end="")
        return int(bool(found))
    of = schemas(drawn=True)
    made = {SCHEMAS / f"{command}.json": json.dumps(one, indent=1) + "\n" for command, one in of.items()}
    made |= {PACKAGE / "_shapes" / f"{name}.py": text for name, text in types(of).items()}
    for file, text in made.items():
        file.parent.mkdir(exist_ok=True)
        file.write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
