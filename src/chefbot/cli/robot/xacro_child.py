"""Expansion of an untrusted xacro file in a separate process. All functions of xacro that evaluate Python, read
the environment, or read files outside the description's package are replaced.

Usage: python -P -m chefbot.cli.robot.xacro_child FILE BYTES_OF_MEMORY; the URDF goes to standard output.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import xacro

from chefbot.cli.robot.packages import home_package, package_folder
from chefbot.config import read_bytes
from chefbot.design.export.urdf_check import parse_xml
from chefbot.design.export.xacro_expression import Function, builtin_functions, evaluate, math_names
from chefbot.errors import UserError

MAX_BYTES = 10_000_000
MAX_INCLUDES = 30
_YAML = (".yaml", ".yml")
_WITHOUT_SPACE = ("load_yaml", "abs_filename", "dotify")
"""Functions of xacro's namespace that older files call without the prefix."""


class Sandbox:
    """Permissions of a description at `path` during its expansion by xacro."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._roots = {home_package(path)}
        """Folders whose files may be read: the description's package and those that it finds by name."""
        self._parse, self._load_yaml = xacro.parse, xacro.load_yaml

    def install(self) -> None:
        """Replace xacro's access to Python, the environment and files."""
        xacro.safe_eval = self._evaluate
        xacro.eval_extension = self._substitute
        xacro.parse = self._parse_checked
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
            "load_yaml": self._load_yaml_checked,
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
            return str(self._find(arguments[0]))
        if command == "dirname" and not arguments:
            return str(Path(xacro.filestack[-1]).resolve().parent)
        if command == "cwd" and not arguments:
            return str(Path.cwd())
        if command == "optenv" and arguments:
            return " ".join(arguments[1:])
        if command in ("eval", "env"):
            raise UserError(
                f"{text:.80} is not evaluated: a check evaluates neither Python nor the"
                " environment; write ${...} or an <xacro:arg>"
            )
        raise UserError(
            f"{text:.80} is no substitution of xacro; there are arg, find, dirname, cwd and optenv"
        )

    @staticmethod
    def _argument(name: str) -> str:
        values: dict[str, str] = xacro.substitution_args_context["arg"]
        if name not in values:
            raise UserError(f"$(arg {name}) has no value; give <xacro:arg name={name!r}> a default")
        return str(values[name])

    def _find(self, name: str) -> Path:
        folder = package_folder(name, self._path, f"$(find {name})")
        if folder.joinpath("package.xml").is_file():
            self._roots.add(folder.resolve())
        return folder

    def _check_place(self, name: str) -> Path:
        file = Path(name).resolve()
        if not any(file.is_relative_to(root) for root in self._roots):
            places = ", ".join(sorted(map(str, self._roots)))
            raise UserError(
                f"{name} lies outside {places}; a check reads only the description's own package:"
                " put the file there, or a package.xml above both"
            )
        return file

    def _load_yaml_checked(self, name: str) -> Any:
        file = self._check_place(xacro.abs_filename_spec(name))
        if file.suffix not in _YAML:
            raise UserError(f"load_yaml of {name}: only .yaml and .yml files are read")
        read_bytes(file, "YAML file", MAX_BYTES)
        return self._load_yaml(str(file))

    def _parse_checked(self, given: object, name: str) -> Any:
        """Parse an included file, or the first one, after checking its place."""
        file = self._check_place(name)
        above = [Path(each).resolve() for each in xacro.filestack[:-1]]
        if file in above:
            raise UserError(f"{name} includes itself, possibly by other files; remove the circular include")
        if len(above) > MAX_INCLUDES:
            raise UserError(f"{name}: includes are nested more than {MAX_INCLUDES} deep")
        if file.is_file():  # xacro reports a missing one: the include may be optional
            parse_xml(read_bytes(file, "robot description", MAX_BYTES), f"robot description {name}")
        return self._parse(given, name)


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


def _limit_memory(size: int) -> None:
    """Limit the memory against recursive macros; on systems without such a limit the timeout ends them."""
    if find_spec("resource") is not None:
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (size, size))


def _sentence(error: Exception) -> str:
    """Return the innermost error, with its type if its message is empty, and the included file."""
    while isinstance(getattr(error, "exc", None), xacro.XacroException):
        error = error.exc  # type: ignore[attr-defined]
    cause = getattr(error, "exc", None)
    unnamed = type(cause).__name__ if cause is not None and not str(cause) else ""
    files = xacro.filestack or []
    place = f" (in {files[-1]})" if len(files) > 1 else ""
    return (f"{unnamed} {error}".strip() or type(error).__name__) + place


def main() -> None:
    """Expand the file of the first argument; exit with a sentence if that fails."""
    path = Path(sys.argv[1])
    _limit_memory(int(sys.argv[2]))
    Sandbox(path).install()
    try:
        text = xacro.process_file(str(path)).toxml()
    except RecursionError:
        sys.exit("a macro or an include calls itself without end")
    except MemoryError:
        sys.exit("it needs too much memory")
    except Exception as error:
        sys.exit(_sentence(error))
    sys.stdout.buffer.write(text.encode())


if __name__ == "__main__":
    main()
