"""Robot files: found by name or path, read, and checked for robots that cannot be."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from chefbot.config import build, parse_yaml, read_bytes
from chefbot.errors import UserError, nearest
from chefbot.robot.catalogue import KINDS, component
from chefbot.robot.spec import Robot
from chefbot.robot.validation import check_possible

ROBOT_FOLDER = Path(__file__).parent
LIKE = "like"


def built_in_robots() -> dict[str, Path]:
    """Name to file of the robots that come with the package."""
    return {path.stem: path for path in sorted(ROBOT_FOLDER.glob("*.yaml"))}


def load_robot(name_or_path: str) -> Robot:
    """A built-in robot by name, or a file by path. UserError with file, key and reason otherwise."""
    path = find_robot(name_or_path)
    return parse_robot(read_bytes(path, "robot file"), path)


def parse_robot(text: bytes, path: Path) -> Robot:
    """The robot that the text of the file `path` describes; UserError as above."""
    return robot_of(_whole(text, path, ()), f"robot file {path}")


def robot_of(data: Any, where: str) -> Robot:
    """Plain data of a robot file, without `like`, as a Robot that could be built."""
    if isinstance(data, dict):
        named = {key: component(key, data[key], where) for key in KINDS if isinstance(data.get(key), str)}
        data = {**data, **named}
    robot = build(data, Robot, where)
    check_possible(robot, where)
    return robot


def find_robot(name_or_path: str) -> Path:
    """The file of a built-in robot or of a path."""
    known = built_in_robots()
    if name_or_path in known:
        return known[name_or_path]
    if name_or_path.endswith((".yaml", ".yml")) or "/" in name_or_path:
        return Path(name_or_path)
    raise UserError(
        f"no robot is called {name_or_path!r}{nearest(name_or_path, known)}; give one of these or a file"
    )


def _whole(text: bytes, path: Path, seen: tuple[Path, ...]) -> Any:
    """The file's data laid over that of the robot which it is like."""
    where = f"robot file {path}"
    data = parse_yaml(text, where)
    if not isinstance(data, dict) or LIKE not in data:
        return data
    model, seen = data.pop(LIKE), (*seen, path.resolve())
    if not isinstance(model, str):
        raise UserError(f"{where}: {LIKE} must be the name of a robot or of a file")
    file = find_robot(model)
    file = file if file.is_absolute() else path.parent / file
    if file.resolve() in seen:
        raise UserError(f"{where}: {LIKE}: {model} is, over some files, like itself; end the circle")
    return _laid_over(_whole(read_bytes(file, "robot file"), file, seen), data)


def _laid_over(below: Any, above: Any) -> Any:
    """Sections are merged key by key, everything else is replaced."""
    if not (isinstance(below, dict) and isinstance(above, dict)):
        return above
    merged = {key: _laid_over(below[key], above[key]) if key in below else above[key] for key in above}
    return {**below, **merged}
