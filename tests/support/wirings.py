"""Robot files of Chefbots whose motor boards are wired in other ways."""

from __future__ import annotations

import re
from pathlib import Path

import chefbot.robot

BASE = Path(chefbot.robot.__file__).with_name("chefbot.yaml")
DIR_PWM = """\
driver:
  {title: a driver with a direction input, channels: 2, inputs: dir_pwm, voltage_min: 5 V, voltage_max: 30 V,
   continuous_current: 10 A, peak_current: 30 A, logic_high_min: 2.5 V, size: {x: 6 cm, y: 5 cm, z: 1 cm}, mass: 60 g,
   source: invented}
"""
WIRINGS = {
    "dir_pwm": DIR_PWM,
    "two_pwm": "driver: ibt2_bts7960\nboard: {at_rest: hold}\n",
    "pins": "driver: ibt2_bts7960\nboard: {kind: pico, pins: {left_a: 20, left_b: 21, estop: 6, cliff_0: 16,"
    " pwm_left: 8, pwm_right: 9, right_a: 14, right_b: 15, enable: 7, echo: 22}}\n",
}
"""Sections of robot files with another wiring than that of the built-in robots."""


def wired(wiring: str, folder: Path) -> str:
    """Write the robot file of the Chefbot with another wiring, and return its path."""
    path = folder / f"{wiring}.yaml"
    text = re.sub(r"^driver: .*$", WIRINGS[wiring].rstrip(), BASE.read_text(), count=1, flags=re.MULTILINE)
    path.write_text(text)
    return str(path)
