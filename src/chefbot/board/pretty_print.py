"""The board's lines as readable text in SI units, for debugging the serial link."""

from __future__ import annotations

from chefbot.board import messages as board
from chefbot.board.chapter_messages import (
    ChapterAttitude,
    ChapterBattery,
    ChapterEcho,
    ChapterLine,
    ChapterTicks,
    ChapterTime,
)
from chefbot.board.imu_chips import chip_name
from chefbot.board.sensors import SPEED_OF_SOUND
from chefbot.board.status_codes import BoardFlag, BoardState, faults, reason, warnings


def describe(line: board.BoardLine) -> tuple[str, str]:
    """Return the title of a line (letter and name) and its content as text."""
    match line:
        case board.VersionLine():
            return "v handshake", _version(line)
        case board.UnsupportedVersionLine():
            return "v handshake", f"protocol {line.protocol}, which this program does not support"
        case board.MotionLine():
            angle = f"angle {line.angle * 1e-8:.5f} rad of {line.samples} samples"
            return "e motion", f"ticks {line.left} {line.right}, {angle}, {flags(line.flags)}"
        case board.InertiaLine():
            return "i inertia", _inertia(line)
        case board.StatusLine():
            return "s status", _status(line)
        case board.EchoLine():
            return "u echo", _echo(line.echo)
        case board.BatteryLine():
            return "b battery", f"{line.millivolts / 1000:.2f} V"
        case board.UptimeLine():
            counts = f"up {line.uptime} s, {line.dropped} lines dropped, {line.missed} steps missed"
            return "t time", f"{counts}, IMU {chip_name(line.imu)}"
    raise TypeError(f"no description of a {type(line).__name__}")


def describe_chapter(line: ChapterLine) -> tuple[str, str]:
    """Return title and content of a line of the chapter's protocol as text."""
    match line:
        case ChapterTime():
            return "t time", f"{line.t / 1e6:.3f} s"
        case ChapterTicks():
            return "e motion", f"ticks {line.left} {line.right} (one edge of four)"
        case ChapterEcho():
            return "u echo", f"{line.centimetres / 100:.2f} m" if line.centimetres else "no echo"
        case ChapterAttitude():
            return "i attitude", f"quaternion {line.x} {line.y} {line.z} {line.w}"
        case ChapterBattery():
            return "b battery", f"{line.raw}, as the converter reads it"
    return "s status", "duties as sent"


def flags(value: int) -> str:
    """Return the flags in hexadecimal and as text; flags of an idle session only by name."""
    session_flags = [
        str(flag.name).lower().replace("_", " ")
        for flag in (BoardFlag.NO_SESSION, BoardFlag.NO_SPEED, BoardFlag.NEUTRAL_FIRST)
        if value & flag
    ]
    descriptions = [*faults(value), *warnings(value), *session_flags]
    return f"flags {value:04X}" + (f" ({'; '.join(descriptions)})" if descriptions else "")


def _version(line: board.VersionLine) -> str:
    limits = f"wheel {line.max_wheel}, forward {line.max_forward}, turn {line.max_turn} ticks/s"
    return (
        f"{line.name} protocol {line.protocol} on {line.port}, robot {line.hash:08X}, "
        f"{line.ticks_per_turn_milli / 1000:g} ticks per turn, {limits}, {line.acceleration} ticks/s^2"
    )


def _inertia(line: board.InertiaLine) -> str:
    rates = " ".join(f"{rate * 1e-6:+.4f}" for rate in (line.gx, line.gy, line.gz))
    accelerations = " ".join(f"{value * 1e-3:+.3f}" for value in (line.ax, line.ay, line.az))
    other = f"{line.temperature / 100:.1f} degC, bias z {line.bias_z * 1e-6:+.4f} rad/s"
    return f"rates {rates} rad/s, force {accelerations} m/s^2, {other}"


def _status(line: board.StatusLine) -> str:
    known_state = line.state in BoardState.__members__.values()
    state = BoardState(line.state).name.lower() if known_state else f"state {line.state}"
    refused = f"{line.refused} refused" + (f", the last as {reason(line.reason)}" if line.reason else "")
    illegal = f"illegal steps {line.illegal_left} {line.illegal_right}"
    return (
        f"{state}, set {line.set_left} {line.set_right} ticks/s, duty {line.duty_left} {line.duty_right}, "
        f"{refused}, {illegal}, {flags(line.flags)}"
    )


def _echo(echo: int) -> str:
    if echo == board.NO_SENSOR:
        return "no sensor answers"
    return f"{echo * 1e-6 * SPEED_OF_SOUND / 2:.3f} m" if echo != board.NO_ECHO else "no echo"
