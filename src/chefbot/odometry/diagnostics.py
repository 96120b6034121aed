"""How the sensors of motion are, in a sentence for people."""

from __future__ import annotations

from chefbot.odometry.ekf import Ekf
from chefbot.odometry.sensor_health import Condition, Source

SIDES = ("left", "right")
WELL = "Wheels and gyro agree."
_FLAWS = {
    Condition.STUCK: "says the same to the last bit while the wheels turn",
    Condition.SATURATED: "is at the end of its range",
    Condition.REVERSED: "turns against the wheels: it is mounted upside down",
    Condition.LATE: "comes late",
}
_WITHOUT = {
    Source.GYRO: "going on with the wheels alone",
    Source.ACCELEROMETER: "the floor counts as level",
    Source.ATTITUDE: "going on without it",
    Source.SCANS: "going on without them",
}


def complaint(ekf: Ekf, now_ns: int) -> str | None:
    """All that is wrong at an instant, or None if nothing is."""
    if ekf.belief.stamp_ns is None:
        return None  # not begun
    found = [_of(ekf, source, now_ns) for source in Source]
    found.append(_contradiction(ekf))
    return " ".join(sentence for sentence in found if sentence) or None


def _of(ekf: Ekf, source: Source, now_ns: int) -> str | None:
    condition = ekf.condition(source, now_ns)
    if condition is Condition.FRESH or (condition is Condition.ABSENT and source is not Source.GYRO):
        return None
    if source is Source.WHEELS:
        return _wheels(ekf, condition, now_ns)
    if condition in (Condition.LOST, Condition.ABSENT):
        age = ekf.silent_for(source, now_ns)
        silent = f"No {source.value} for {age:.1f} s" if age < 1e6 else f"No {source.value} so far"
        return f"{silent}: {_WITHOUT[source]}."
    left_out = "" if condition is Condition.LATE else f"; {_WITHOUT[source]}"
    return f"The {source.value} {_FLAWS[condition]}{left_out}."


def _wheels(ekf: Ekf, condition: Condition, now_ns: int) -> str:
    if condition is Condition.LOST:
        return (
            f"No wheels for {ekf.silent_for(Source.WHEELS, now_ns):.1f} s: "
            "the robot counts as standing, and its place grows uncertain."
        )
    return f"The wheels' counts {_FLAWS.get(condition, condition.value)}."


def _contradiction(ekf: Ekf) -> str | None:
    belief = ekf.belief
    if belief.silent_side is not None:
        silent, other = SIDES[belief.silent_side], SIDES[1 - belief.silent_side]
        return (
            f"The {silent} wheel counts nothing while the {other} one rolls and the gyro does not turn: "
            f"its encoder is dead, or the {other} wheel spins."
        )
    if not ekf.slipping:
        return None
    if belief.counters.standing:
        return "The gyro turns while the wheels stand: the robot is carried, or both encoders are dead."
    return "Wheels and gyro contradict each other: the wheels slip."
