"""How a call becomes a command of the library, and its answer a result."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

from gyroid import _gyroid
from gyroid._errors import Error, of_kind
from gyroid._input import Given
from gyroid._options import DriveOptions, RestOptions

#: Units at the end of an argument's name; options of the command line have none.
_UNIT = re.compile(r"_(rad_s|s|hz|deg|mb|c|kg)$")
#: Options whose values stand apart by commas; others are given again for each value.
_COMMAS = {"axis", "estimators", "mounting", "mounting-quaternion", "start-offset", "terms"}


def option(argument: str) -> str:
    """The option of the command line that an argument is called there."""
    return _UNIT.sub("", argument).replace("_", "-")


#: Arguments of all readers by their options.
_ARGUMENTS = {option(name): name for typed in (RestOptions, DriveOptions) for name in typed.__annotations__}


class Call:
    """A call of a function: its arguments in the words of the command line, and the places in memory that they need."""

    def __init__(self, name: str, *, unnamed: Sequence[Given] = (), outputs: Mapping[str, str] = {}) -> None:
        self.name, self._unnamed = name, list(unnamed)
        self._options: list[str] = []
        self._shown = [given.name for given in unnamed]
        self._given = list(unnamed)
        self._arguments = dict(_ARGUMENTS)
        self.outputs = {key: _gyroid.Place(file) for key, file in outputs.items()}

    def named(self, argument: str, values: Sequence[Sequence[Given]], many: bool = False) -> None:
        """Adds an option of files, once for each sequence of them."""
        for files in values:
            self._options += [f"--{option(argument)}", *(given.path for given in files)]
            self._given += files
        names = [given.name for files in values for given in files]
        if names:
            self._shown.append(f"{argument}={names[0] if len(names) == 1 else '[' + ', '.join(names) + ']'}")

    def loads(self, argument: str, values: Sequence[Sequence[Given]], load_kg: float | Sequence[float] | None) -> None:
        """Adds the load of each drive, kg."""
        if load_kg is None:
            return
        loads = list(load_kg) if isinstance(load_kg, Sequence) else [load_kg]
        if len(loads) != len(values):
            raise Error("usage", argument, None, f"{len(loads)} loads of {len(values)} drives", "give one for each drive")
        self._shown.append(f"{argument}={load_kg!r}")
        self._arguments["load"] = argument
        self._options += [f"--load={files[0].path}={load}" for files, load in zip(values, loads, strict=True)]

    def options(self, arguments: Mapping[str, Any]) -> None:
        """Adds options; None and False leave one out."""
        for argument, value in arguments.items():
            name = option(argument)
            self._arguments[name] = argument
            if value is None or value is False:
                continue
            if isinstance(value, Given):
                self._given.append(value)
                self._options.append(f"--{name}={value.path}")
                self._shown.append(f"{argument}={value.name}")
                continue
            self._shown.append(f"{argument}={value!r}")
            if value is True:
                self._options.append(f"--{name}")
            elif isinstance(value, Mapping):
                self._options += [f"--{name}={key}={item}" for key, item in value.items()]
            elif isinstance(value, Sequence) and not isinstance(value, str):
                items = [str(item) for item in value]
                self._options += [f"--{name}={item}" for item in ([",".join(items)] if name in _COMMAS else items)]
            else:
                self._options.append(f"--{name}={value}")

    def run(self, *command: str) -> tuple[dict[str, Any], str, bool]:
        """The answer's JSON, its page, and whether it is fit for use."""
        outputs = [f"--{option(key)}={place.path}" for key, place in self.outputs.items()]
        unnamed = ["--", *(given.path for given in self._unnamed)] if self._unnamed else []
        try:
            answer, text, fit = _gyroid.answer([*command, *self._options, *outputs, *unnamed], self.typed())
        except Error as error:
            raise self.told(error) from None
        return json.loads(self._clean(answer)), self._clean(text), fit

    def read(self) -> tuple[dict[str, bytearray], tuple[str, ...]]:
        """The columns of a log, and the reader's notes."""
        try:
            columns, notes = _gyroid.read_log(
                [*self._options, "--", *(given.path for given in self._unnamed)], self.typed()
            )
        except Error as error:
            raise self.told(error) from None
        return columns, tuple(map(self._clean, notes))

    def typed(self) -> str:
        """The call as it was written, for provenance and messages."""
        return f"gyroid.{self.name}({', '.join(self._shown)})"

    def text(self, output: str) -> str | None:
        """What was written to an output, if anything was."""
        content = self.outputs[output].bytes() if output in self.outputs else None
        return None if content is None else content.decode()

    def told(self, error: Error) -> Error:
        """The error in the words of Python: arguments for options, and no places in memory."""

        def words(text: str | None) -> str | None:
            if text is None:
                return None
            named = re.sub(r"--([a-z]+(?:-[a-z]+)*)", lambda m: self._arguments.get(m[1], m[0]), text)
            return self._clean(named)

        file, place, finding, hint = map(words, (error.file, error.place, error.finding, error.hint))
        return of_kind(error.kind, file or "", place, finding or "", hint)

    def _clean(self, text: str) -> str:
        places = [given.place for given in self._given if given.place is not None]
        for place in [*places, *self.outputs.values()]:
            text = text.replace(place.prefix, "")
        return text
