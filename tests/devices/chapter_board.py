"""A board with the chapter's firmware, as far as its line shows: duties in, rising edges out, nothing checked."""

from __future__ import annotations

import math
import re

from chefbot.robot.load import load_robot

ROBOT = load_robot("chefbot")
PERIOD = 0.02
"""Seconds of one of its loops."""
LAG = 0.1


class ChapterBoard:
    """Two motors of first order; `turn` is one loop of the firmware."""

    def __init__(self) -> None:
        self.us = 4_294_000_000  # its clock wraps within a second
        self.duty = [0, 0]
        self.speed, self.place = [0.0, 0.0], [0.0, 0.0]
        self.commands = b""
        self._edges = ROBOT.motor.ticks_per_turn / 4.0 / (2.0 * math.pi)

    def receive(self, data: bytes) -> None:
        """`s LEFT RIGHT` CR; what has another form is ignored."""
        self.commands += data
        for left, right in re.findall(rb"s (-?\d+) (-?\d+)\r", self.commands):
            self.duty = [max(-255, min(255, int(left))), max(-255, min(255, int(right)))]
        self.commands = self.commands[self.commands.rfind(b"\r") + 1 :]

    def turn(self) -> bytes:
        self.us += round(PERIOD * 1e6)
        for wheel in (0, 1):
            wanted = 0.93 * self.duty[wheel] / 255.0 * ROBOT.motor.no_load_speed
            self.speed[wheel] += (wanted - self.speed[wheel]) * PERIOD / LAG
            self.place[wheel] += self.speed[wheel] * self._edges * PERIOD
        left, right = (math.floor(place) for place in self.place)
        duties = f"{self.duty[0]:.2f}\t{self.duty[1]:.2f}"
        return (
            f"t\t{self.us % 2**32}\t{PERIOD:.2f}\ne\t{left}\t{right}\nu\t87\ns\t{duties}\n"
            f"i\t0.00\t0.00\t0.71\t0.70\nb\t2874\n"
        ).encode()

    @property
    def left_speed(self) -> float:
        """m/s of the left wheel."""
        return self.speed[0] * ROBOT.wheel_radius
