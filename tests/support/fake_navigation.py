"""Services of a navigation tree whose actions end when a test lets them."""

from __future__ import annotations

from collections.abc import Callable

from chefbot.msgs.nav2_msgs import BackUp_Result, ComputePathToPose_Result, FollowPath_Result
from chefbot.msgs.nav_msgs import Path


class PendingAction:
    """An action that a test ends."""

    def __init__(self, what: str) -> None:
        self.what, self.done, self.discarded = what, False, False
        self._result: object = None

    def end(self, result: object = None) -> None:
        self.done, self._result = True, result

    def result(self) -> object:
        return self._result

    def discard(self) -> None:
        self.discarded = True

    def add_done_callback(self, waiter: Callable[[], None]) -> None:
        """Nobody waits here."""


def unanswered(_: PendingAction) -> None:
    """Let an action take its time."""


class RecordedNavigation:
    """Records what a tree begins; `answer` may end an action at once."""

    def __init__(self, answer: Callable[[PendingAction], None] = unanswered) -> None:
        self.begun: list[PendingAction] = []
        self.failures: list[tuple[int, str]] = []
        self.localized = self.waits_well = True
        self.may_be_blocked = self.goal_occupied = self.stopped_by_memory = False
        self._answer = answer

    def names(self) -> list[str]:
        return [one.what for one in self.begun]

    def _begin(self, what: str) -> PendingAction:
        pending = PendingAction(what)
        self.begun.append(pending)
        self._answer(pending)
        return pending

    def note_failure(self, error_code: int, error_msg: str) -> None:
        self.failures.append((error_code, error_msg))

    def is_localized(self) -> bool:
        return self.localized

    def is_recoverable(self, error_code: int) -> bool:
        return error_code != 204

    # ruff: noqa: ARG002 (what is done does not matter here)
    def relocalize(self) -> PendingAction:
        return self._begin("relocalize")

    def compute_path(self, goal: object, start: object) -> PendingAction:
        return self._begin("plan" if start is None else "plan from start")

    def follow_path(self, path: object) -> PendingAction:
        return self._begin("follow")

    def spin(self, angle: float, time_allowance: float) -> PendingAction:
        return self._begin(f"spin {angle:g}")

    def back_up(self, distance: float, speed: float, time_allowance: float) -> PendingAction:
        return self._begin(f"back up {distance:g}")

    def back_up_to_see(self) -> PendingAction:
        if self.stopped_by_memory:
            return self._begin("back up to see")
        refused = PendingAction("back up to see")
        refused.end(BackUp_Result(error_code=710, error_msg="Nothing to see."))
        return refused

    def wait(self, seconds: float) -> PendingAction:
        return self._begin(f"wait {seconds:g}")

    def clear_costmaps(self, radius: float) -> PendingAction:
        return self._begin(f"clear {radius:g}")

    def find_blocked_path(
        self, goal: object, error_code: int, find_waiting_pose: bool
    ) -> PendingAction | None:
        return self._begin("look") if self.may_be_blocked else None

    def wait_for_path(self, goal: object, error_code: int) -> PendingAction:
        return self._begin("wait for path")

    def is_at(self, pose: object) -> bool:
        return self.waits_well

    def is_goal_occupied(self) -> bool:
        return self.goal_occupied

    def face_obstacle(self, goal: object) -> PendingAction:
        return self._begin("face")


def path_found() -> ComputePathToPose_Result:
    return ComputePathToPose_Result(Path())


def no_path() -> ComputePathToPose_Result:
    return ComputePathToPose_Result(error_code=208, error_msg="No path leads there.")


def blocked() -> FollowPath_Result:
    return FollowPath_Result(error_code=105, error_msg="Something is in the way.")
