"""Days of service of a delivering robot, without physics: the real battery monitor and round on a modelled pack.

The pack ages, is cold on some mornings, and its voltage is linear or flat with a knee (LiFePO4). Its gauge lies on
some days. Staff charge the robot at night, mostly, and when it stands at home with a low battery.
"""

from __future__ import annotations

import math
from collections import Counter
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from chefbot.battery.consumption import Consumption
from chefbot.battery.gauge import Reading
from chefbot.battery.messages import status_message
from chefbot.battery.monitor import BatteryMonitor
from chefbot.battery.pack import BatteryPack
from chefbot.battery.params import BatteryParams
from chefbot.delivery.battery_round import BatteryRound
from chefbot.delivery.energy_forecast import EnergyForecast, Stop
from chefbot.delivery.round_outcome import BATTERY_TOO_LOW, OrderOutcome
from chefbot.delivery.status_messages import PARKING_PLACE
from chefbot.design.sizing.energy_budget import usable_energy
from chefbot.maths.se2 import SE2
from chefbot.msgs.chefbot_msgs import Order
from chefbot.msgs.geometry_msgs import Pose, PoseStamped
from chefbot.msgs.std_msgs import Header
from chefbot.nodes.battery_monitor import prior_consumption
from chefbot.robot.load import load_robot

STEP = 10.0
"""Time between two readings, s."""
OPEN, CLOSED = 8.0 * 3600.0, 22.0 * 3600.0
"""Hours of service, s after midnight."""
CHARGER = 0.5
"""Current of the charger as a multiple of the capacity per hour."""
PARKING_DISTANCE = 4.0
"""Distance to the nearest parking place from anywhere, m."""
FLAT = ((0.0, 0.0), (0.05, 0.25), (0.1, 0.38), (0.2, 0.5), (0.9, 0.62), (0.97, 0.7), (1.0, 1.0))
"""Share of the voltage range by charge of a LiFePO4 pack."""


class Conditions(NamedTuple):
    """What differs from the robot file today: capacity and resistance as factors, and the gauge's fault."""

    capacity: float
    resistance: float
    fault: str
    fault_time: tuple[float, float]
    offset: float


class ModelledPack:
    """The true pack; `charge` is a share of its capacity."""

    def __init__(self, pack: BatteryPack, energy: float, is_flat: bool) -> None:
        self._pack, self._energy, self._is_flat = pack, energy, is_flat
        self.charge, self.conditions = 1.0, Conditions(1.0, 1.0, "", (0.0, 0.0), 0.0)

    def drain(self, energy: float) -> None:
        """Draw energy (J), or charge with a negative one."""
        self.charge = min(1.0, max(0.0, self.charge - energy / (self._energy * self.conditions.capacity)))

    def voltage(self, power: float) -> float:
        """Return the true terminal voltage while `power` (W) is drawn."""
        share = float(np.interp(self.charge, *zip(*FLAT, strict=True))) if self._is_flat else self.charge
        pack = self._pack
        open_circuit = pack.empty_voltage + share * (pack.full_voltage - pack.empty_voltage)
        return open_circuit - pack.resistance * self.conditions.resistance * power / pack.nominal_voltage


class Service:
    """One robot's days of service; `is_watched` is whether the battery monitor runs."""

    def __init__(self, seed: int, robot: str = "chefbot", *, is_watched: bool = True) -> None:
        self.counts: Counter[str] = Counter()
        self.notes: list[str] = []
        self._rng = rng = np.random.default_rng([seed, 0xBA77])
        self._robot, self._is_watched = load_robot(robot), is_watched
        self._prior = prior = prior_consumption(self._robot)
        usable = usable_energy(self._robot).value
        self._true = Consumption(
            prior.standing * rng.uniform(0.8, 1.25),
            prior.per_metre * rng.uniform(0.6, 1.8),
            prior.seconds_per_metre * rng.uniform(0.8, 1.3),
        )
        self._pack = BatteryPack.of(self._robot, usable)
        self._truth = ModelledPack(self._pack, usable / self._robot.battery.usable, bool(rng.random() < 0.5))
        self._monitor = BatteryMonitor(self._pack, BatteryParams(), prior)
        self._ageing = rng.uniform(0.05, 0.4)
        self._places = _places(rng)
        self._forecast = EnergyForecast(self._length, 60.0)
        self._round = BatteryRound(
            "kitchen", "home", lambda names: names, self._on_end, self._forecast, self._park
        )
        self._time, self._at, self._driven = 0.0, "home", 0.0
        self._leg_number, self._leg_length, self._wait = -1, 0.0, 0.0
        self._charging_at = math.inf
        self._is_dead = self._is_charging = False

    def run(self, days: int) -> Counter[str]:
        """Run whole days and return what happened, counted."""
        for day in range(days):
            self._truth.conditions = self._conditions(day / max(days, 1))
            self._time, orders = day * 86400.0 + OPEN, self._orders()
            while self._time < day * 86400.0 + CLOSED:
                while orders and orders[0][0] <= self._time - day * 86400.0:
                    self._order(orders.pop(0)[1])
                self._step()
            self._night()
        return self.counts

    # -- the day

    def _conditions(self, age: float) -> Conditions:
        rng = self._rng
        is_cold = rng.random() < 0.2
        faults = ("", "", "", "high", "low", "offset", "frozen", "weak")
        begin = float(rng.uniform(OPEN, CLOSED - 3600.0))
        return Conditions(
            (1.0 - self._ageing * age) * (0.8 if is_cold else 1.0),
            (1.0 + age) * (2.5 if is_cold else 1.0),
            str(rng.choice(faults)),
            (begin, begin + float(rng.uniform(600.0, 6 * 3600.0))),
            float(rng.uniform(0.02, 0.35)),
        )

    def _orders(self) -> list[tuple[float, tuple[str, ...]]]:
        rng = self._rng
        times = sorted(rng.uniform(OPEN, CLOSED - 1800.0, rng.integers(15, 50)).tolist())
        tables = [name for name in self._places if name.startswith("table")]
        return [(t, tuple(rng.permutation(tables)[: rng.integers(1, 5)].tolist())) for t in times]

    def _order(self, tables: tuple[str, ...]) -> None:
        self.counts["orders"] += 1
        if not self._is_charging and not self._is_dead:
            self._round.order(Order(tables))

    def _night(self) -> None:
        """Staff find the robot, bring it home, and charge it in nine nights of ten."""
        self._round.cancel()
        self._at, self._is_dead, self._is_charging = "home", False, False
        if self._rng.random() < 0.9:
            self._truth.charge = 1.0
        conditions = self._truth.conditions
        self._truth.conditions = conditions._replace(fault="")
        self._monitor = BatteryMonitor(self._pack, BatteryParams(), self._prior, self._monitor.log)
        self._charging_at = math.inf

    # -- a step

    def _step(self) -> None:
        self._time += STEP
        distance, moving = self._move()
        energy = self._true.standing * STEP + self._true.per_metre * distance
        if self._is_charging:
            energy = -CHARGER / 3600.0 * STEP * self._pack.energy
        self._truth.drain(energy)
        power = energy / STEP
        true, measured = self._truth.voltage(power), self._measured(power)
        if self._is_watched:
            self._monitor.update(Reading(self._time, measured, math.nan, distance, moving))
            self._round.on_battery(status_message(self._monitor.assessment, 0), self._time)
        if min(true, measured) < self._pack.empty_voltage and not self._is_dead:
            self._die(true)
        self._staff()

    def _measured(self, power: float) -> float:
        truth, conditions, pack = self._truth, self._truth.conditions, self._pack
        span = pack.full_voltage - pack.empty_voltage
        begin, end = conditions.fault_time
        true = truth.voltage(power)
        if not begin <= self._time % 86400.0 < end:
            self._frozen_at = true
            return round(true, 3)
        lies = {
            "high": pack.empty_voltage + (0.6 + conditions.offset) * span,
            "low": pack.empty_voltage + 0.3 * conditions.offset * span,
            "offset": true + conditions.offset * span,
            "frozen": self._frozen_at,
            "weak": true - 0.5 * conditions.offset * span,
        }
        return round(lies.get(conditions.fault, true), 3)

    def _move(self) -> tuple[float, float]:
        """Drive, wait for people or stand; return the distance (m) and the time in motion (s) of this step."""
        one, leg = self._round, self._round.leg
        if self._is_dead or self._is_charging:
            return 0.0, 0.0
        if leg is None:
            self._leg_number = -1
            self._wait_for_people()
            return 0.0, 0.0
        if leg.number != self._leg_number:
            self._begin_leg(leg.number, leg.place)
        self._driven += STEP / self._true.seconds_per_metre
        step = min(STEP / self._true.seconds_per_metre, self._leg_length)
        if self._driven >= self._leg_length:
            self._at, self._leg_number = self._target, -1
            one.arrived()
            self._wait = float(self._rng.choice([20.0, 60.0, 120.0, 600.0], p=[0.4, 0.4, 0.15, 0.05]))
        return step, STEP

    def _begin_leg(self, number: int, place: str) -> None:
        here = self._distance_to(place)
        if self._leg_number >= 0 and self._driven > 0.0:
            self._at = self._target if self._leg_length - self._driven < self._driven else self._at
        self._leg_number, self._target, self._driven = number, place, 0.0
        # a detour or people on the way, more than the map shows
        self._leg_length = max(0.1, here * float(self._rng.uniform(0.95, 1.4)))

    def _wait_for_people(self) -> None:
        self._wait -= STEP
        state = self._round.status.state
        if self._wait > 0.0 or state not in ("loading", "waiting", "unloading"):
            return
        if state == "loading":
            self._round.loaded()
        else:
            self._round.taken()
            self.counts["tables served"] += state == "waiting"

    def _staff(self) -> None:
        """Charge a robot that stands at home or parked with a low battery, after a while; unplug it when full."""
        is_low = self._monitor.assessment.level.value in ("return", "park") if self._is_watched else False
        rests = self._round.status.state in ("idle", "failed") and self._at in ("home", PARKING_PLACE)
        if self._is_charging:
            if self._truth.charge >= 0.98:
                self._is_charging, self._charging_at = False, math.inf
            return
        if is_low and rests and self._charging_at == math.inf:
            self._charging_at = self._time + float(self._rng.uniform(300.0, 5400.0))
        if self._time >= self._charging_at and rests:
            self._is_charging, self._is_dead, self._at = True, False, "home"
            self.counts["charged in service"] += 1

    def _die(self, true: float) -> None:
        self._is_dead = True
        status = self._round.status
        stranded = self._round.in_progress or status.state == "errand"
        where = "order stranded" if stranded else f"stopped at {self._at}"
        self.counts[where] += 1
        known = self._monitor.assessment
        self.notes.append(
            f"day {self._time / 86400.0:.2f}: {where} ({status.state} {status.place}), true {self._truth.charge:.2f} "
            f"{true:.2f} V, {known.level.value} {known.charge:.2f} {known.voltage_fault[:60]!r} "
            f"{self._truth.conditions}"
        )
        self._round.cancel()
        self._charging_at = self._time + 3600.0

    # -- distances

    def _distance_to(self, place: str) -> float:
        """Return the distance from the robot to a place, back or on along the present leg."""
        if place == PARKING_PLACE:
            return PARKING_DISTANCE
        if self._leg_number < 0:
            return self._between(self._at, place)
        left = max(0.0, self._leg_length - self._driven)
        return min(left + self._between(self._target, place), self._driven + self._between(self._at, place))

    def _between(self, a: str, b: str) -> float:
        if PARKING_PLACE in (a, b):
            return PARKING_DISTANCE + self._places["home"].distance(self._places["kitchen"])
        return 1.3 * self._places[a].distance(self._places[b])

    def _length(self, stops: tuple[Stop, ...]) -> float:
        names = [stop if isinstance(stop, str) else PARKING_PLACE for stop in stops]
        rest = pairwise(names)
        return self._distance_to(names[0]) + sum(self._between(a, b) for a, b in rest)

    def _park(self) -> tuple[PoseStamped, float]:
        self.counts["parked"] += 1
        return PoseStamped(Header.of(0, "map"), Pose.of(SE2(0.0, 0.0, 0.0))), PARKING_DISTANCE

    def _on_end(self, outcome: OrderOutcome) -> None:
        if outcome.code == BATTERY_TOO_LOW:
            self.counts["given up for the battery" if outcome.delivered else "refused or given up"] += 1
        elif outcome.code:
            self.counts["not complete"] += 1
        else:
            self.counts["orders done"] += 1


def _places(rng: np.random.Generator) -> dict[str, SE2]:
    """Return home, kitchen and tables of a house of 15 to 60 m."""
    size = float(rng.uniform(15.0, 60.0))
    tables = {f"table_{i}": SE2(*rng.uniform(0.0, size, 2).tolist(), 0.0) for i in range(12)}
    return {"home": SE2(0.0, 0.0, 0.0), "kitchen": SE2(3.0, 2.0, 0.0), **tables}
