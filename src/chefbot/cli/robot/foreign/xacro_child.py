"""Expansion of an untrusted xacro file in a confined process of its own. All functions of xacro that evaluate Python,
read the environment or open files are replaced; files come from the parent, see `xacro_process`.

Usage: python -P -m chefbot.cli.robot.foreign.xacro_child, with the protocol at standard input and output.
"""

from __future__ import annotations

import json
import re
import sys
import unicodedata  # noqa: F401 - Python imports it for the first name that is not ASCII
import warnings
import xml.dom.expatbuilder  # minidom imports it with the first file
import xml.dom.minidom
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import IO, Any

import xacro
import yaml

from chefbot.cli.robot.foreign.confinement import confine
from chefbot.cli.robot.foreign.xacro_files import FileKind, Files, GivenFile
from chefbot.design.export.urdf_xml import parse_urdf_xml
from chefbot.design.export.xacro_expression import Function, builtin_functions, evaluate, math_names
from chefbot.errors import UserError

MAX_INCLUDES = 30
ENCODINGS = (
    "ascii",
    "latin-1",
    "utf-8-sig",
    "utf-16",
    "utf-16-le",
    "utf-16-be",
    "utf-32",
    "cp1252",
    "iso8859-15",
)
"""Encodings of XML files, whose tables Python imports with their first use."""
_WITHOUT_SPACE = ("load_yaml", "abs_filename", "dotify")
"""Functions of xacro's namespace that older files call without the prefix."""
_UNITS = {unit.value.tag: unit.value.conversion_constant for unit in xacro.ConstructUnits}


def expand(path: Path, files: Files) -> str:
    """Return the URDF of a xacro file, whose text and includes are read from `files`.

    Raises UserError with the innermost reason.
    """
    sandbox = _Sandbox(files)
    sandbox.install()
    try:
        return str(xacro.process_file(str(path)).toxml())
    except RecursionError:
        raise UserError("a macro or an include calls itself without end") from None
    except MemoryError:
        raise UserError("it needs too much memory") from None
    except Exception as error:
        raise UserError(_sentence(error)) from None


class _Sandbox:
    """What a description may do while xacro expands it."""

    def __init__(self, files: Files) -> None:
        self._files = files
        self._real: dict[str, str] = {}
        """Path without symbolic links of each file that was read, by the name that xacro has for it."""

    def install(self) -> None:
        """Replace xacro's access to Python, the environment and files."""
        xacro.safe_eval = self._evaluate
        xacro.eval_extension = self._substitute
        xacro.parse = self._parse
        xacro.glob = SimpleNamespace(glob=self._files.match)
        xacro.warning = xacro.error = xacro.print_location = _ignore_message
        xacro._global_symbols.clear()
        xacro._global_symbols.update(self._symbols())

    def _symbols(self) -> dict[str, Any]:
        """Return the names in expressions, as in xacro: those of math and Python directly and in namespaces."""
        python, maths, own = builtin_functions(), math_names(), self._own_functions()
        spaces = {"math": _space(maths), "python": _space(python), "xacro": _space(own)}
        return {**maths, **python, **{name: own[name] for name in _WITHOUT_SPACE}, **spaces}

    def _own_functions(self) -> dict[str, Function]:
        functions = {
            "load_yaml": self._load_yaml,
            "abs_filename": xacro.abs_filename_spec,
            "dotify": xacro.YamlDictWrapper,
            "arg": lambda name: xacro.substitution_args_context["arg"][name],
            "tokenize": _tokenize,
            "fatal": _fail,
            **dict.fromkeys(("message", "warning", "error", "print_location"), _ignore_message),
        }
        return {name: Function(name, call) for name, call in functions.items()}

    @staticmethod
    def _evaluate(expression: str, symbols: Mapping[str, Any], _: object = None) -> Any:
        return evaluate(expression, symbols)

    def _substitute(self, text: str) -> str:
        """Evaluate `$(...)`: arguments, packages and folders; neither Python nor the environment."""
        command, *arguments = text[2:-1].split() or [""]
        if command == "arg" and len(arguments) == 1:
            return self._argument(arguments[0])
        if command == "find" and len(arguments) == 1:
            return self._files.find(arguments[0])
        if command == "dirname" and not arguments:
            return str(Path(self._real[xacro.filestack[-1]]).parent)
        if command == "cwd" and not arguments:
            return str(Path.cwd())
        if command == "optenv" and arguments:
            return " ".join(arguments[1:])
        raise _unsupported(text, command)

    @staticmethod
    def _argument(name: str) -> str:
        values: dict[str, str] = xacro.substitution_args_context["arg"]
        if name not in values:
            raise UserError(f"$(arg {name}) has no value; give <xacro:arg name={name!r}> a default")
        return str(values[name])

    def _load_yaml(self, name: str) -> Any:
        """Load a YAML file, with xacro's units: `!degrees 90`."""
        name = xacro.abs_filename_spec(name)
        try:
            file = self._files.read(name, "YAML file")
        except FileNotFoundError as error:
            raise UserError(str(error)) from None
        xacro.filestack.append(name)
        value = yaml.load(file.data.decode(), Loader=_UnitLoader)
        xacro.filestack.pop()
        return xacro.YamlListWrapper.wrap(value)

    def _parse(self, given: object, name: str) -> Any:
        """Parse an included file, or the first one."""
        if given is not None:
            return given
        try:
            file = self._files.read(name, "robot description")
        except FileNotFoundError as error:  # xacro itself continues if the include is optional
            xacro.filestack.pop()
            raise xacro.XacroException(str(error), exc=error) from None
        above = [self._real.get(each) for each in xacro.filestack[:-1]]
        self._real[name] = file.path
        if file.path in above:
            raise UserError(f"{name} includes itself, possibly by other files; remove the circular include")
        if len(above) > MAX_INCLUDES:
            raise UserError(f"{name}: includes are nested more than {MAX_INCLUDES} deep")
        parse_urdf_xml(file.data, f"robot description {name}")
        return xml.dom.minidom.parseString(file.data)


class _UnitLoader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """A loader of plain values and of xacro's units."""


def _with_unit(loader: Any, tag: str, node: Any) -> float:
    """Construct a value with a unit; its number may be an expression of xacro."""
    value = loader.construct_scalar(node)
    return float(evaluate(value, xacro._global_symbols)) * float(_UNITS[f"!{tag}"])


for _tag in _UNITS:
    _UnitLoader.add_constructor(_tag, lambda loader, node: _with_unit(loader, node.tag[1:], node))


def _unsupported(text: str, command: str) -> UserError:
    if command in ("eval", "env"):
        return UserError(
            f"{text:.80} is not evaluated: a check evaluates neither Python nor the"
            " environment; write ${...} or an <xacro:arg>"
        )
    return UserError(
        f"{text:.80} is not a substitution of xacro; there are arg, find, dirname, cwd and optenv"
    )


def _space(names: Mapping[str, Any]) -> Any:
    space = xacro.NameSpace()
    dict.update(space, names)
    return space


def _tokenize(text: str, sep: str = ",; ", skip_empty: bool = True) -> list[str]:
    """Split at any of the characters of `sep`, which is not a regular expression."""
    parts = re.split(f"[{re.escape(sep)}]", text)
    return [part for part in parts if part] if skip_empty else parts


def _fail(*messages: object) -> None:
    raise UserError(" ".join(map(str, messages)))


def _ignore_message(*_: object, **__: object) -> str:
    return ""


def _sentence(error: Exception) -> str:
    """Return the innermost error, with its type if its message is empty, and the included file."""
    while isinstance(getattr(error, "exc", None), xacro.XacroException):
        error = error.exc  # type: ignore[attr-defined]
    cause = getattr(error, "exc", None)
    if isinstance(cause, RecursionError):
        return "a macro or an include calls itself without end"
    unnamed = type(cause).__name__ if cause is not None and not str(cause) else ""
    # xacro writes the message of some causes twice
    text = str(cause) if cause is not None and str(error).count(str(cause)) == 2 else str(error)
    files = xacro.filestack or []
    place = f" (in {files[-1]})" if len(files) > 1 else ""
    return " ".join((f"{unnamed} {text}".strip() or type(error).__name__).split()) + place


class FilesOfParent:
    """The files, as the parent process gives them."""

    def __init__(self, to: IO[bytes], source: IO[bytes]) -> None:
        self._to, self._from = to, source

    def read(self, name: str, kind: FileKind) -> GivenFile:
        """Read a file. Raises UserError with the parent's reason, FileNotFoundError for none."""
        answer = self._request({"read": name, "kind": kind})
        return GivenFile(answer["value"], self._from.read(answer["bytes"]))

    def find(self, package: str) -> str:
        """Return a package's folder. Raises UserError with the parent's reason."""
        return str(self._request({"find": package})["value"])

    def match(self, pattern: str) -> list[str]:
        """Return the files of a pattern. Raises UserError with the parent's reason."""
        return list(self._request({"match": pattern})["value"])

    def send(self, message: Mapping[str, object], data: bytes = b"") -> None:
        """Send a message, and bytes behind it."""
        self._to.write(json.dumps(message).encode() + b"\n" + data)
        self._to.flush()

    def _request(self, question: Mapping[str, object]) -> dict[str, Any]:
        self.send(question)
        answer: dict[str, Any] = json.loads(self._from.readline())
        if "missing" in answer:
            raise FileNotFoundError(answer["missing"])
        if "error" in answer:
            raise UserError(answer["error"])
        return answer


def main() -> None:
    """Expand the file that the parent names; send the URDF, or a sentence if that fails."""
    files = FilesOfParent(sys.stdout.buffer, sys.stdin.buffer)
    order = json.loads(sys.stdin.buffer.readline())
    for name in ENCODINGS:
        "".encode(name)
    warnings.simplefilter("ignore")
    confine(order["memory"], order["cpu"])
    try:
        data = expand(Path(order["path"]), files).encode()
    except UserError as error:
        files.send({"fail": str(error)[:1000]})
        return
    except UnicodeEncodeError:
        files.send({"fail": "its text has half of a surrogate pair, which no character has"})
        return
    files.send({"urdf": len(data)}, data)


if __name__ == "__main__":
    main()
