"""Robot files: found by name or path, parsed, and checked for robots that cannot be built."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from chefbot.config import build, find_file, parse_yaml, read_bytes
from chefbot.file_kinds import ROBOT, check_kind
from chefbot.robot.catalogue import KINDS, component
from chefbot.robot.errors import RobotFileError
from chefbot.robot.spec import Robot
from chefbot.robot.validation import check_buildable

ROBOT_FOLDER = Path(__file__).parent
LIKE = "like"
PIN_NAME = re.compile(r"GP\d{1,2}")


def built_in_robots() -> dict[str, Path]:
    """Return the robots that come with the package as name to file path."""
    return {path.stem: path for path in sorted(ROBOT_FOLDER.glob("*.yaml"))}


def load_robot(name_or_path: str) -> Robot:
    """Load a built-in robot by name or a robot file by path. Raises RobotFileError with file, key and reason."""
    path = find_robot(name_or_path)
    return parse_robot(read_bytes(path, "robot file"), path)


def parse_robot(text: bytes, path: Path) -> Robot:
    """Parse the text of the robot file `path`. Raises RobotFileError with file, key and reason."""
    where = f"robot file {path}"
    return build_robot(_resolve_like(text, path, ()), where)


def build_robot(data: Any, where: str) -> Robot:
    """Build a Robot from plain data of a robot file (`like` resolved) and check that it can be built."""
    if isinstance(data, dict):
        components = {
            key: component(key, data[key], where) for key in KINDS if isinstance(data.get(key), str)
        }
        data = _with_pin_numbers({**data, **components})
    robot = build(data, Robot, where)
    check_buildable(robot, where)
    return robot


def _with_pin_numbers(data: dict[str, Any]) -> dict[str, Any]:
    """Return the data with pins such as GP22, as they are printed on the board, as numbers."""
    board = data.get("board")
    pins = board.get("pins") if isinstance(board, dict) else None
    if not (isinstance(board, dict) and isinstance(pins, dict)):
        return data
    numbers = {name: int(pin[2:]) if PIN_NAME.fullmatch(str(pin)) else pin for name, pin in pins.items()}
    return {**data, "board": {**board, "pins": numbers}}


def find_robot(name_or_path: str) -> Path:
    """Return the path of a robot file for a built-in robot's name or a path."""
    return find_file("robot", name_or_path, built_in_robots(), RobotFileError)


def _resolve_like(text: bytes, path: Path, seen: tuple[Path, ...]) -> Any:
    """Return the file's data merged over that of the robot that its key `like` names, recursively."""
    where = f"robot file {path}"
    data = parse_yaml(text, where)
    check_kind(data, ROBOT, where, RobotFileError)
    if not isinstance(data, dict) or LIKE not in data:
        return data
    base_name, seen = data.pop(LIKE), (*seen, path.resolve())
    if not isinstance(base_name, str):
        raise RobotFileError(f"{where}: {LIKE} must be the name of a robot or of a file")
    try:
        base_path = find_robot(base_name)
    except RobotFileError as error:
        raise RobotFileError(f"{where}: {LIKE}: {error}") from None
    base_path = base_path if base_path.is_absolute() else path.parent / base_path
    base = read_bytes(base_path, "robot file")
    if base_path.resolve() in seen:
        raise RobotFileError(f"{where}: {LIKE}: {base_name} refers back to itself: circular 'like'")
    return _merge(_resolve_like(base, base_path, seen), data)


def _merge(base: Any, override: Any) -> Any:
    """Merge sections key by key; replace everything else."""
    if not (isinstance(base, dict) and isinstance(override, dict)):
        return override
    merged = {key: _merge(base[key], override[key]) if key in base else override[key] for key in override}
    return {**base, **merged}
