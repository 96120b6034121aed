"""What every ROS 2 package needs besides its own files: package.xml (REP-149, format 3) and CMakeLists.txt."""

from __future__ import annotations

from collections.abc import Iterable
from xml.sax.saxutils import escape


def manifest(
    name: str, about: str, depends: Iterable[str], *, tag: str = "exec_depend", also: Iterable[str] = ()
) -> str:
    """package.xml of a package that installs files and runs others' executables.

    One that compiles something depends on others by another `tag`, and says `also` lines of its own.
    """
    lines = "\n".join((*(f"  <{tag}>{one}</{tag}>" for one in depends), *(f"  {one}" for one in also)))
    return f"""<?xml version="1.0"?>
<package format="3">
  <name>{name}</name>
  <version>0.1.0</version>
  <description>{escape(about)}</description>
  <maintainer email="owner@example.com">The robot's owner</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
{lines}
  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
"""


def cmake(name: str, folders: Iterable[str]) -> str:
    """CMakeLists.txt that installs the folders and compiles nothing."""
    return f"""cmake_minimum_required(VERSION 3.8)
project({name} NONE)

find_package(ament_cmake REQUIRED)

install(DIRECTORY {" ".join(folders)} DESTINATION share/${{PROJECT_NAME}})

ament_package()
"""


def with_papers(name: str, about: str, depends: Iterable[str], files: dict[str, str]) -> dict[str, str]:
    """The package's files with its papers; every folder of a file is installed."""
    folders = dict.fromkeys(path.partition("/")[0] for path in files)
    return {"package.xml": manifest(name, about, depends), "CMakeLists.txt": cmake(name, folders), **files}
