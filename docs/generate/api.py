"""Pages of the Python API: one for each package, made from the source by `ast`, without importing it."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Iterator
from pathlib import Path

from generate.rst import anchor, docstring, heading, table, write

SOURCE = Path(__file__).parents[2] / "src"
HIDDEN = ("__main__.py",)


def write_api(folder: Path) -> None:
    """Write a page for each package of chefbot and the table of them, and delete pages of packages that are gone."""
    packages = sorted({path.parent for path in (SOURCE / "chefbot").rglob("*.py")})
    names = {".".join(package.relative_to(SOURCE).parts) for package in packages}
    for page in folder.glob("*.rst"):
        if page.stem not in {*names, "index"}:
            page.unlink()
    rows = []
    for package in packages:
        name = ".".join(package.relative_to(SOURCE).parts)
        _write_package(folder / f"{name}.rst", name, package)
        rows.append((f":doc:`{name} <{name}>`", docstring(_summary(package / "__init__.py")).strip()))
    pages = [f"   {'.'.join(package.relative_to(SOURCE).parts)}" for package in packages]
    write(
        folder / "index.rst",
        [
            heading("Python API"),
            "Every public class and function of every package, from its docstring and signature.\n",
            table(("package", "contents"), rows, "30 70"),
            ".. toctree::\n   :hidden:\n",
            *pages,
        ],
    )


def class_index() -> dict[str, str]:
    """Return the full name of each public class by its own name; names of several classes are left out."""
    found: dict[str, list[str]] = {}
    for path in (SOURCE / "chefbot").rglob("*.py"):
        module = ".".join(path.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__")
        for node in _members(ast.parse(path.read_text()).body):
            if isinstance(node, ast.ClassDef):
                found.setdefault(node.name, []).append(f"{module}.{node.name}")
    return {name: places[0] for name, places in found.items() if len(places) == 1}


def _summary(path: Path) -> str:
    if not path.exists():
        return ""
    return (ast.get_docstring(ast.parse(path.read_text())) or "").split("\n\n")[0]


def _write_package(path: Path, name: str, package: Path) -> None:
    parts = [anchor(f"api-{name}"), heading(name)]
    for file in sorted(package.glob("*.py")):
        if file.name in HIDDEN or (file.stem.startswith("_") and file.name != "__init__.py"):
            continue
        tree = ast.parse(file.read_text())
        module = name if file.name == "__init__.py" else f"{name}.{file.stem}"
        text = ast.get_docstring(tree)
        members = list(_members(tree.body))
        if file.name != "__init__.py":
            parts.append(heading(module, "-"))
        parts += [f".. py:module:: {module}\n", docstring(text or "")]
        for member in members:
            parts.append(_member(member, ""))
    write(path, parts)


def _members(body: list[ast.stmt]) -> Iterator[ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef]:
    for node in body:
        named = isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef)
        if named and not node.name.startswith("_") and ast.get_docstring(node) is not None:  # type: ignore[union-attr]
            yield node  # type: ignore[misc]


def _member(node: ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef, indent: str) -> str:
    """Return the directive of a class with its public methods and fields, or of a function."""
    if isinstance(node, ast.ClassDef):
        return _class(node, indent)
    return _function(node, indent, "method" if indent else "function")


def _class(node: ast.ClassDef, indent: str) -> str:
    bases = ", ".join(ast.unparse(base) for base in node.bases)
    lines = [f"{indent}.. py:class:: {node.name}", ""]
    inner = indent + "   "
    if bases:
        lines += [f"{inner}Bases: ``{bases}``", ""]
    lines.append(docstring(inspect.cleandoc(ast.get_docstring(node) or ""), inner))
    for field, annotation, text in _fields(node):
        lines += [f"{inner}.. py:attribute:: {field}", f"{inner}   :type: {annotation}", ""]
        lines.append(docstring(text, inner + "   "))
    lines += [_member(member, inner) for member in _members(node.body) if not _is_overload(member)]
    return "\n".join(lines)


def _fields(node: ast.ClassDef) -> Iterator[tuple[str, str, str]]:
    """Yield name, annotation and the docstring behind it, of each public annotated field."""
    for statement, following in zip(node.body, [*node.body[1:], None], strict=True):
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            text = ""
            if isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant):
                text = inspect.cleandoc(str(following.value.value))
            if not statement.target.id.startswith("_"):
                yield statement.target.id, _type(statement.annotation), text


def field_docstrings(kind: type) -> dict[str, str]:
    """Return the docstrings behind the fields of a class and its bases by field name."""
    texts: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        if base.__module__.startswith("chefbot."):
            node = ast.parse(textwrap.dedent(inspect.getsource(base))).body[0]
            assert isinstance(node, ast.ClassDef)
            texts |= {name: " ".join(text.split()) for name, _, text in _fields(node)}
    return texts


def _type(annotation: ast.expr) -> str:
    """Return the annotation, of `Annotated[...]` only the type."""
    inner = annotation.slice if isinstance(annotation, ast.Subscript) else None
    if inner is not None and ast.unparse(annotation.value) == "Annotated" and isinstance(inner, ast.Tuple):  # type: ignore[attr-defined]
        return ast.unparse(inner.elts[0])
    return " ".join(ast.unparse(annotation).split())


def _is_overload(node: ast.AST) -> bool:
    return any("overload" in ast.unparse(one) for one in getattr(node, "decorator_list", []))


def _function(node: ast.FunctionDef | ast.AsyncFunctionDef, indent: str, kind: str) -> str:
    decorators = [ast.unparse(decorator).split("(")[0] for decorator in node.decorator_list]
    parameters = node.args.posonlyargs + node.args.args
    text = ast.unparse(node.args)
    if kind == "method" and parameters and "staticmethod" not in decorators:
        text = text.partition(",")[2].strip()
        text = text.removeprefix("/, ").removeprefix("/")
    returns = f" -> {ast.unparse(node.returns)}" if node.returns else ""
    inner = indent + "   "
    if (
        "property" in decorators
        or "cached_property" in decorators
        or "functools.cached_property" in decorators
    ):
        result = ast.unparse(node.returns) if node.returns else "Any"
        head = [f"{indent}.. py:property:: {node.name}", f"{inner}:type: {result}"]
    else:
        head = [f"{indent}.. py:{kind}:: {node.name}({text}){returns}"]
        head += [f"{inner}:{option}:" for option in ("classmethod", "staticmethod") if option in decorators]
        head += [f"{inner}:async:"] if isinstance(node, ast.AsyncFunctionDef) else []
    return "\n".join([*head, "", docstring(ast.get_docstring(node) or "", inner)])
