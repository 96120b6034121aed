"""A delivery round that obeys the battery: it refuses what it cannot finish, goes home in time, or parks."""

from __future__ import annotations

from collections.abc import Callable

from chefbot.delivery import status_messages
from chefbot.delivery.energy_forecast import EnergyForecast, PlannedRoute
from chefbot.delivery.mission import DeliveryRound
from chefbot.delivery.round_outcome import BATTERY_TOO_LOW, OrderError, OrderOutcome
from chefbot.delivery.round_state import Resolve
from chefbot.delivery.trays import stops_left, with_kitchen
from chefbot.errors import ChefbotError
from chefbot.msgs.chefbot_msgs import BatteryStatus, Errand, Order
from chefbot.msgs.geometry_msgs import PoseStamped

GO_ON_MARGIN, NO_MARGIN = 1.1, 1.0
"""Factors on the energy of what was begun: less than for an order, so that noise does not end it just before its end.
The energy for parking is not part of what is planned with."""
AT_HOME_LENGTH = 1.0
"""Length of the path to the home place below which the robot is there, m."""
RETRY_TIME = 60.0
"""Time after which a robot that did not get home or to its parking place tries again, s."""
Park = Callable[[], tuple[PoseStamped, float] | None]
"""Returns the nearest place to park and the length of the path to it, m; None where there is none."""


class BatteryRefusalError(OrderError):
    """An order that the battery is not enough for."""

    code = BATTERY_TOO_LOW


class BatteryRound(DeliveryRound):
    """The delivery state machine with another input, the status of the battery.

    An order is accepted if the energy is enough for all accepted orders and the drive home. Below the level `return`
    the robot finishes what it carries as far as the energy is enough, and goes home. If that is not possible it
    parks. Nothing moves by itself during an emergency stop or while the round waits for the operator's choice.
    """

    def __init__(
        self,
        kitchen: str,
        home: str,
        resolve: Resolve,
        on_end: Callable[[OrderOutcome], None],
        forecast: EnergyForecast,
        park: Park,
    ) -> None:
        super().__init__(kitchen, home, resolve, on_end)
        self._forecast, self._park = forecast, park
        self._retry_at = 0.0

    # -- orders

    def order(self, order: Order) -> None:
        """Accept an order, or refuse it if the energy is not enough for it after all others."""
        is_new = not order.id or order.id not in self.status.accepted
        if is_new and order.places and self.in_progress:
            refusal = self._refusal_behind_others(order)
            if refusal:
                self._refuse(order, refusal)
                return
        super().order(order)

    def _refuse(self, order: Order, refusal: str) -> None:
        accepted = (*self.status.accepted, order.id) if order.id else self.status.accepted
        self._update_status(accepted=accepted, description=f"{self.status.description} {refusal}")
        self._on_end(OrderOutcome(order.id, (), BATTERY_TOO_LOW, refusal))

    def _refusal_behind_others(self, order: Order) -> str:
        """Return why an order cannot be done after the present round and the waiting ones, or an empty string."""
        route = self._remaining()
        try:
            for waiting in (*self.status.pending_orders, order):
                route += self._route_of(self._resolve(waiting.places))
        except ChefbotError:
            return ""  # an unknown place, which is reported when the order begins
        return self._refusal(order.places, route)

    def _tables(self, order: Order) -> tuple[str, ...]:
        tables = super()._tables(order)
        refusal = self._refusal(tables, self._route_of(tables))
        if refusal:
            raise BatteryRefusalError(refusal)
        return tables

    def go(self, errand: Errand) -> None:
        """Start an errand, if the energy is enough for it and the drive home; else raise OrderError."""
        route = PlannedRoute((errand.pose, self.home), 0)
        if self.in_progress and errand.when == "after":
            route = self._remaining() + route
        if not self._forecast.suffices(route):
            raise BatteryRefusalError(self._too_far((errand.name,), route))
        super().go(errand)

    def _refusal(self, tables: tuple[str, ...], route: PlannedRoute) -> str:
        battery = self._forecast.battery
        if battery is not None and self._forecast.is_low:
            return status_messages.refused_below(tables, battery.charge)
        return "" if self._forecast.suffices(route) else self._too_far(tables, route)

    def _too_far(self, tables: tuple[str, ...], route: PlannedRoute) -> str:
        reach = self._forecast.reach(route.waits)
        return status_messages.refused(tables, reach, self._forecast.length(route.stops))

    def _route_of(self, tables: tuple[str, ...]) -> PlannedRoute:
        stops = with_kitchen(tables, self.trays, self.kitchen)
        return PlannedRoute((*stops, self.home), len(stops))

    def stops_left(self, tables: int | None = None) -> tuple[str, ...]:
        """Return the places that are left, home at last; with all tables of the queue, or the first few."""
        status = self.status
        if status.state not in ("loading", "driving", "waiting"):
            food_back = (self.kitchen,) if status.state == "returning" and status.untaken else ()
            return (*food_back, self.home)
        return (*stops_left(status, status.queue[:tables], self.trays, self.kitchen), self.home)

    def _remaining(self, tables: int | None = None) -> PlannedRoute:
        """Return the route over what is left, and at how many places it waits, the present one included."""
        stops = self.stops_left(tables)
        at_stop = self.status.state in ("loading", "waiting", "unloading")
        return PlannedRoute(stops, len(stops) - 1 + at_stop)

    # -- the drive home

    def on_battery(self, battery: BatteryStatus, time: float) -> None:
        """Process the status of the battery at a time (s): go on, leave out tables, go home or park."""
        self._forecast.battery = battery
        if self.stopped or self.status.hold_reason in ("stop", "choice") or self._is_parking:
            return
        if self.status.state in status_messages.IDLE_STATES:
            self._check_standing(time)
        elif not self._forecast.suffices(PlannedRoute((self.home,), 0), NO_MARGIN):
            self._park_or_go_home()
        elif not self._is_going_home:
            self._check_round()

    @property
    def _is_parking(self) -> bool:
        errands = self.status.errands
        return self.status.state == "errand" and errands[0].name == status_messages.PARKING_PLACE

    @property
    def _is_going_home(self) -> bool:
        return self.status.state == "returning" and not self.status.untaken

    def _check_standing(self, time: float) -> None:
        """Send a robot home that stands elsewhere without an order, once its battery is low."""
        status = self.status
        if not self._forecast.is_low or status.description == status_messages.PARKED or time < self._retry_at:
            return
        if not self._forecast.length((self.home,)) > AT_HOME_LENGTH:
            return
        self._retry_at = time + RETRY_TIME
        if self._forecast.suffices(PlannedRoute((self.home,), 0), NO_MARGIN):
            self._go_home()
        else:
            self._park_or_go_home()

    def _check_round(self) -> None:
        """Leave out what the energy is not enough for; go home if nothing is left or nothing is carried."""
        status = self.status
        if status.hold_reason == "errand" or status.state == "errand":
            route = PlannedRoute((status.errands[0].pose, self.home), 0)
            if not self._forecast.suffices(route, GO_ON_MARGIN):
                self._go_home()
            return
        if self._forecast.is_low and not status.loaded:
            self._go_home()
        elif not self._forecast.suffices(self._remaining(), GO_ON_MARGIN):
            self._shorten()

    def _shorten(self) -> None:
        """Leave out tables from the end until the energy is enough for the rest; go home if none is left.

        A robot at a table waits there as long as it still gets home.
        """
        status = self.status
        fewest = 0 if status.loaded else 1
        for kept in range(len(status.queue) - 1, fewest - 1, -1):
            if self._forecast.suffices(self._remaining(kept), GO_ON_MARGIN):
                break
        else:
            self._go_home()
            return
        for table in status.queue[kept:]:
            self._add_missed(status_messages.battery_skipped(table))
        self._update_status(queue=status.queue[:kept])

    def _go_home(self) -> None:
        """Give up what is left and drive home."""
        if self.in_progress:
            for table in self._unserved_tables():
                self._add_missed(status_messages.battery_skipped(table))
        else:
            self._begin_round()
        self._update_status(queue=(), untaken=(), errands=(), hold_reason="")
        self._drive("returning", self.home)
        self._update_status(
            description=f"{status_messages.LOW_BATTERY} {status_messages.on_the_way(self.home)}"
        )

    def _park_or_go_home(self) -> None:
        """Drive to the nearest place to park, or home if that is nearer or there is none."""
        place = self._park()
        home = self._forecast.length((self.home,))
        if place is None or home <= place[1]:
            if not self._is_going_home:
                self._go_home()
            return
        if self.in_progress:
            self._give_up_round()
        errand = Errand(status_messages.PARKING_PLACE, place[0], "instead")
        self._update_status(errands=(errand,), hold_reason="")
        self._drive("errand", errand.name)
        self._update_status(description=status_messages.PARKING)

    def _give_up_round(self) -> None:
        for table in self._unserved_tables():
            self._add_missed(status_messages.battery_skipped(table))
        status = self.status
        self._set_standing("idle", status_messages.PARKING)
        self._update_status(last_outcome=status_messages.PARKING)
        outcome = OrderOutcome(status.order_id, status.delivered, BATTERY_TOO_LOW, status_messages.PARKING)
        self._on_end(outcome)

    def arrived(self, failure_reason: str = "") -> None:
        """Process the end of a drive; a parked robot asks to be charged."""
        parked = self._is_parking and not failure_reason
        super().arrived(failure_reason)
        if parked and self.status.state == "idle":
            self._update_status(description=status_messages.PARKED)
