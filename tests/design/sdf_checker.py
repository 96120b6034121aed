"""A small program on Debian's libsdformat that reads an SDF file and reports what it found."""

from __future__ import annotations

import json
import shutil
import subprocess
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

SOURCE = r"""
#include <iomanip>
#include <iostream>
#include <sdf/sdf.hh>

static void print_model(const sdf::Model &model, bool first) {
  std::cout << (first ? "" : ",") << "\"" << model.Name() << "\":{\"static\":" << (model.Static() ? "true" : "false")
            << ",\"collisions\":{";
  const char *comma = "";
  for (size_t i = 0; i < model.LinkCount(); ++i)
    for (size_t j = 0; j < model.LinkByIndex(i)->CollisionCount(); ++j, comma = ",") {
      const auto *solid = model.LinkByIndex(i)->CollisionByIndex(j);
      std::cout << comma << "\"" << model.LinkByIndex(i)->Name() << "/" << solid->Name()
                << "\":"
                << solid->Element()->GetElement("surface")->GetElement("friction")->GetElement("ode")
                       ->Get<double>("mu");
    }
  std::cout << "},\"sensors\":{";
  comma = "";
  for (size_t i = 0; i < model.LinkCount(); ++i)
    for (size_t j = 0; j < model.LinkByIndex(i)->SensorCount(); ++j, comma = ",") {
      const auto *sensor = model.LinkByIndex(i)->SensorByIndex(j);
      ignition::math::Pose3d at;
      if (!sensor->SemanticPose().Resolve(at, "__model__").empty()) std::exit(3);
      std::cout << comma << "\"" << sensor->Name() << "\":[" << at.Pos().X() << "," << at.Pos().Y() << ","
                << at.Pos().Z() << "]";
    }
  std::cout << "},\"links\":{";
  for (size_t i = 0; i < model.LinkCount(); ++i) {
    const auto *link = model.LinkByIndex(i);
    ignition::math::Pose3d at;
    if (!link->SemanticPose().Resolve(at, "__model__").empty()) std::exit(3);
    const auto inertial = link->Inertial();
    const auto m = inertial.MassMatrix();
    const auto c = inertial.Pose().Pos();
    std::cout << (i ? "," : "") << "\"" << link->Name() << "\":[" << m.Mass() << "," << c.X() << "," << c.Y() << ","
              << c.Z() << "," << m.Ixx() << "," << m.Iyy() << "," << m.Izz() << "," << m.Ixy() << "," << m.Ixz()
              << "," << m.Iyz() << "," << at.Pos().X() << "," << at.Pos().Y() << "," << at.Pos().Z() << "]";
  }
  std::cout << "},\"frames\":{";
  for (size_t i = 0; i < model.FrameCount(); ++i) {
    const auto *frame = model.FrameByIndex(i);
    ignition::math::Pose3d at;
    if (!frame->SemanticPose().Resolve(at, "__model__").empty()) std::exit(3);
    std::cout << (i ? "," : "") << "\"" << frame->Name() << "\":[" << at.Pos().X() << "," << at.Pos().Y() << ","
              << at.Pos().Z() << "," << at.Rot().W() << "," << at.Rot().X() << "," << at.Rot().Y() << ","
              << at.Rot().Z() << "]";
  }
  std::cout << "}}";
}

int main(int, char **argv) {
  sdf::Root root;
  const auto errors = root.Load(argv[1]);
  for (const auto &error : errors) std::cerr << error << "\n";
  if (!errors.empty()) return 1;
  std::cout << std::setprecision(15) << "{";
  if (root.Model() != nullptr) print_model(*root.Model(), true);
  for (size_t w = 0; w < root.WorldCount(); ++w) {
    const auto *world = root.WorldByIndex(w);
    for (size_t i = 0; i < world->ModelCount(); ++i) print_model(*world->ModelByIndex(i), i == 0);
  }
  std::cout << "}";
}
"""


@lru_cache(maxsize=1)
def _checker() -> TemporaryDirectory[str]:
    """Build the checker; its folder is removed with this process."""
    folder = TemporaryDirectory(prefix="chefbot_sdf_")
    source = Path(folder.name, "check.cpp")
    source.write_text(SOURCE)
    flags = subprocess.run(
        ["pkg-config", "--cflags", "--libs", "sdformat12"], capture_output=True, text=True, check=True
    ).stdout.split()
    program = str(source.with_suffix(""))
    subprocess.run(["g++", "-std=c++17", "-O0", str(source), "-o", program, *flags], check=True)
    return folder


def read_by_libsdformat(path: Path) -> dict[str, Any]:
    """Model to its links, frames, sensors, and friction of what collides.

    Fails the test when libsdformat complains; skips it where the library is not installed.
    """
    if shutil.which("g++") is None or shutil.which("pkg-config") is None:
        pytest.skip("needs g++ and pkg-config")
    if subprocess.run(["pkg-config", "--exists", "sdformat12"], check=False).returncode != 0:
        pytest.skip("needs libsdformat 12: apt-get install libsdformat-dev")
    done = subprocess.run(
        [f"{_checker().name}/check", str(path)], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    return json.loads(done.stdout)
