"""Runs a delivery round: drives its legs, presses its buttons by timer, and publishes its status."""

from __future__ import annotations

from collections.abc import Callable

import msgspec

from chefbot.delivery.battery_round import BatteryRound
from chefbot.delivery.button_timer import ButtonPress, ButtonTimer
from chefbot.delivery.drive_retry import NO_NAVIGATOR, DriveRetry
from chefbot.delivery.params import DeliveryParams
from chefbot.delivery.round_outcome import (
    BATTERY_TOO_LOW,
    UNKNOWN_PLACE,
    DriveRequest,
    OrderError,
    OrderOutcome,
)
from chefbot.msgs.chefbot_msgs import BatteryStatus, DeliveryStatus, LocalizationStatus
from chefbot.msgs.nav2_msgs import NavigateToPose, NavigateToPose_Goal, NavigateToPose_Result
from chefbot.msgs.std_msgs import Header, String
from chefbot.nodes.deliveries.energy import DeliveryEnergyNode
from chefbot.runtime.actions import action_client
from chefbot.runtime.coroutines import Cancelled, Task
from chefbot.runtime.node import In, Out, topic
from chefbot.safety.emergency_stop import REFUSED


class DeliveryRoundNode(DeliveryEnergyNode):
    """Base class of the delivery node: the round and its drives, without the events that move it on."""

    localization_status: In[LocalizationStatus]
    navigate_to_pose = action_client(NavigateToPose)
    delivery_status: Out[DeliveryStatus] = topic(latched=True)
    notice: Out[String] = topic("delivery/notice")

    def start(self) -> None:
        """Start idle; the drives begin once `_ready` is set."""
        super().start()
        names = self.params.kitchen, self.params.home
        self._round = BatteryRound(
            *names, self._resolve, self._report_outcome, self._forecast, self._parking_place
        )
        self._round.trays = self.params.trays
        self._published_status: DeliveryStatus | None = None
        self._ready = False
        self._leg: DriveRequest | None = None
        self._drive: Task[None] | None = None
        self._timer = ButtonTimer()

    def reconfigure(self, params: DeliveryParams) -> None:
        """Apply new parameters from the next leg on."""
        self.params = params
        self._round.kitchen, self._round.home = params.kitchen, params.home

    def on_battery_status(self, battery: BatteryStatus) -> None:
        """Shorten the round, go home or park, as the battery allows."""
        self._forecast.stop_time = self.params.stop_time
        if self._ready:
            self._round.on_battery(battery, self.now_ns / 1e9)
            self._update_drive()

    def stop(self) -> None:
        """Cancel the drive when the node stops; the round is kept in the status."""
        self._leg = None
        super().stop()

    def _update_drive(self) -> None:
        """Publish the status and start, replace or cancel the drive according to the round's leg."""
        self._publish()
        leg = self._round.leg if self._ready else None
        requested, current = (each.number if each else None for each in (leg, self._leg))
        if requested == current:
            return
        self._leg, running = leg, self._drive
        if running is not None:
            running.cancel()
        self._drive = self.spawn(self._drive_leg(leg)) if leg is not None else None

    def _apply_event(self, event: Callable[[], None]) -> None:
        """Apply an event to the round and publish a notice if it is refused."""
        try:
            event()
        except OrderError as error:
            self.notice.publish(String(str(error)))
        self._update_drive()

    async def _drive_leg(self, leg: DriveRequest) -> None:
        """Drive a leg until it is reached, fails or is preempted."""
        try:
            result = await self._navigate(leg)
        except Cancelled:
            if self._leg is not leg:
                raise  # cancelled because the round has another leg
            self._round.on_diverted()
        else:
            if result.error_msg == REFUSED:
                self._round.stop(True)  # the emergency stop message has not arrived here yet
            else:
                self._round.arrived(result.error_msg if result.error_code else "")
        self._drive = self._leg = None
        self._update_drive()

    async def _navigate(self, leg: DriveRequest) -> NavigateToPose_Result:
        """Navigate; retry without a navigator, on a blocked path to the kitchen or home, and of a lost robot."""
        pose = leg.pose or self._poses().get(leg.place)
        if pose is None:
            await self.sleep(0.0)
            return NavigateToPose_Result(NO_NAVIGATOR, f"there is no place called {leg.place!r} on this map")
        retry = DriveRetry()
        while True:
            start_ns, result = self.now_ns, await self.navigate_to_pose.call(NavigateToPose_Goal(pose))
            required = leg.place in (self.params.kitchen, self.params.home) and self._map_has_path(pose)
            pause = retry.pause(
                result.error_code, start_ns, self.now_ns, required=required, lost=self._is_lost
            )
            if pause is None:
                return result
            await self.sleep(pause)

    @property
    def _is_lost(self) -> bool:
        status = self.localization_status.last
        return status is not None and not status.localized

    async def _press_after(self, press: ButtonPress) -> None:
        await self.sleep(press.seconds)
        if self._timer.elapse(press, self._round):
            self._update_drive()

    def _publish(self) -> None:
        press = self._timer.update(self._round, self.params)
        if press is not None:
            self.spawn(self._press_after(press))
        status = self._round.status
        if status is self._published_status:
            return
        self._published_status = status
        header = Header.of(self.now_ns, "map")
        self.delivery_status.publish(msgspec.structs.replace(status, header=header))
        self._report_status(status)

    def _report_status(self, status: DeliveryStatus) -> None:
        """Process a status that was published."""

    def _report_outcome(self, outcome: OrderOutcome) -> None:
        """Publish a notice for an order that could not begin, which nobody may expect any more."""
        if outcome.code in (UNKNOWN_PLACE, BATTERY_TOO_LOW) and not outcome.delivered:
            self.notice.publish(String(outcome.sentence))
