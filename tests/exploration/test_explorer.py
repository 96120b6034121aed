import math

import numpy as np
import pytest

from chefbot.costmap.layered_costmap import LayeredCostmap
from chefbot.costmap.params import CostmapParams
from chefbot.costmap.raytrace import mark_and_clear
from chefbot.exploration.explorer import CLOSE_VIEW, DIMINISHED, HELD_UP_WEIGHT, LEARNED_WEIGHT, Explorer
from chefbot.exploration.frontiers import find_frontiers, frontier_mask
from chefbot.maths.footprint import disc
from chefbot.maths.grid import Grid
from chefbot.maths.se2 import SE2
from chefbot.planning.grid_planner import GridPlanner, path_length

RADIUS, CELL = 0.16, 0.05


def hotel():
    """15 x 12 m: four rooms with doors of 0.9 m on a corridor, with some tables; 1 is occupied."""
    truth = np.zeros((240, 300), np.int8)
    truth[[0, 1, -1, -2]] = truth[:, [0, 1, -1, -2]] = 1
    for row in (96, 140):
        truth[row : row + 2] = 1
        for door in (60, 210):
            truth[row : row + 2, door : door + 18] = 0
    truth[:96, 150:152] = truth[142:, 150:152] = 1
    for r, c in ((40, 40), (40, 220), (190, 70), (200, 240), (60, 100)):
        truth[r : r + 16, c : c + 16] = 1
    return truth


class Mapper:
    """A perfect mapper: rays through the true world into a grid."""

    def __init__(self, truth, field, reach):
        self.truth, self.known = truth, np.full(truth.shape, 255, np.uint8)
        self.angles = np.linspace(-field / 2, field / 2, max(90, round(field * 115)))
        self.reach = reach

    def look(self, pose):
        r = np.arange(0.02, self.reach, 0.02)
        x = pose.x + r[None] * np.cos(pose.yaw + self.angles)[:, None]
        y = pose.y + r[None] * np.sin(pose.yaw + self.angles)[:, None]
        h, w = self.truth.shape
        rows, columns = np.clip((y / CELL).astype(int), 0, h - 1), np.clip((x / CELL).astype(int), 0, w - 1)
        hit = self.truth[rows, columns] > 0
        first = np.where(hit.any(axis=1), r[hit.argmax(axis=1)], np.inf)
        free = np.minimum(first, self.reach)
        mark_and_clear(
            self.known,
            CELL,
            0.0,
            0.0,
            pose.array(),
            self.angles,
            first,
            np.zeros_like(free),
            free,
            self.known,
            np.zeros(self.known.shape),
            0.0,
        )

    def grid(self):
        cells = np.full(self.known.shape, -1, np.int8)
        cells[self.known == 0] = 0
        cells[self.known == 254] = 100
        return Grid(cells, CELL, 0.0, 0.0)


def explore(field, reach, start):
    """(metres driven, turns about, the map, what is left) of a robot that follows its paths exactly."""
    mapper, explorer, planner = Mapper(hotel(), field, reach), Explorer(RADIUS, field), GridPlanner()
    pose, driven, turns, goal = start, 0.0, 1, None
    for k in range(12):
        mapper.look(SE2(pose.x, pose.y, pose.yaw + k * math.pi / 6))
    for _ in range(150):
        costs = LayeredCostmap(CostmapParams(), disc(RADIUS))
        costs.set_static(mapper.grid())
        costmap = costs.update()
        decision = explorer.decide(mapper.grid(), planner.potential(costmap, pose), pose)
        last, goal = goal, decision.goal
        if goal is None:
            return driven, turns, mapper, decision.skipped
        if last is not None and math.hypot(goal.x - last.x, goal.y - last.y) < 0.3:
            explorer.mark_failed(goal)
        path = planner.plan(costmap, pose, goal.pose)
        for p in path[::8]:
            mapper.look(SE2.of(p))
        for k in range(12 if goal.look_around else 1):
            mapper.look(goal.pose @ SE2(0.0, 0.0, k * math.pi / 6))
        turns += goal.look_around
        pose, driven = goal.pose, driven + path_length(path)
    raise AssertionError("it never ends")


@pytest.mark.parametrize(
    ("field", "reach", "longest"),
    [(2 * math.pi, 8.0, 80.0), (math.radians(58), 6.0, 75.0)],
    ids=["lidar", "camera"],
)
@pytest.mark.slow
def test_the_hotel_is_explored_fully(field, reach, longest):
    driven, _, mapper, left = explore(field, reach, SE2(7.5, 6.0, 0.0))
    free = hotel() == 0
    assert (mapper.known[free] != 255).mean() > 0.99
    assert driven < longest
    assert all(one.reason for one in left)


def grid_of(rows):
    cells = np.array([[{".": 0, "#": 100, "?": -1}[c] for c in row] for row in rows], np.int8)
    return Grid(np.kron(cells, np.ones((4, 4), np.int8)), CELL, 0.0, 0.0)


def test_frontiers_are_free_cells_beside_unknown_ones():
    grid = grid_of(["....", "....", "..##", "..??"])
    mask = frontier_mask(grid, 35)
    assert {int(c) for c in np.nonzero(mask)[1]} == {7}
    assert {int(r) for r in np.nonzero(mask)[0]} == {12, 13, 14, 15}


def test_frontier_pieces_cover_every_cell_once_within_length():
    grid = grid_of(["." * 40, "?" * 40])
    pieces = find_frontiers(grid, 35, 2.0)
    cells = np.concatenate([piece.cells for piece in pieces])
    assert len(np.unique(cells, axis=0)) == len(cells) == frontier_mask(grid, 35).sum()
    assert max(piece.length for piece in pieces) < 2.2


def decide(rows, reachable, explorer=None):
    grid = grid_of(rows)
    cost = np.where(reachable & (grid.cells == 0), np.float32(1.0), np.float32(np.inf))
    return (explorer or Explorer(RADIUS)).decide(grid, cost, SE2(0.5, 0.5, 0.0))


ROOM = ["........", "........", "........", "????????"]


def test_the_goal_pose_faces_the_frontier():
    goal = decide(ROOM, True).goal
    assert goal is not None
    aim = math.atan2(goal.y - goal.pose.y, goal.x - goal.pose.x)
    assert goal.pose.distance(SE2(goal.x, goal.y, 0.0)) < CELL or abs(aim - goal.pose.yaw) < 1e-6
    assert goal.gain > 0.0


def test_every_skipped_frontier_has_a_reason():
    assert "unreachable" in decide(ROOM, False).skipped[0].reason
    assert "too small" in decide(["#####", "#...#", "##.##", "##?##"], True).skipped[0].reason
    explorer = Explorer(RADIUS)
    goal = decide(ROOM, True, explorer).goal
    for _ in range(explorer.params.max_attempts):
        explorer.mark_failed(goal)
    decision = decide(ROOM, True, explorer)
    assert decision.goal is None
    assert "failed 2 times" in decision.skipped[0].reason


def test_a_frontier_that_remained_is_looked_at_from_beside_it():
    """The unknown corner behind a door leaf is seen along its edge only, from the place that is nearest by path."""
    grid = grid_of(["." * 30] * 30 + ["?" * 30] * 10)
    away = np.arange(grid.height)[:, None] * CELL
    cost = np.where(grid.cells == 0, away, np.inf).astype(np.float32)
    explorer = Explorer(RADIUS)
    first = explorer.decide(grid, cost, SE2(0.5, 0.1, 0.0)).goal
    assert first is not None
    distance = math.hypot(first.x - first.pose.x, first.y - first.pose.y)
    assert distance == pytest.approx(explorer.params.view_distance, abs=2 * CELL)
    explorer.mark_failed(first)
    second = explorer.decide(grid, cost, SE2(0.5, 0.1, 0.0)).goal
    assert second is not None and (second.x, second.y) == (first.x, first.y)
    assert math.hypot(second.x - second.pose.x, second.y - second.pose.y) <= CLOSE_VIEW * distance + CELL


def test_after_goals_that_show_nothing_small_gains_do_not_count():
    explorer = Explorer(RADIUS)
    goal = decide(ROOM, True, explorer).goal
    while explorer._required_gain.value <= goal.gain:
        explorer.note_gain(goal, 0.0)
    decision = decide(ROOM, True, explorer)
    assert decision.goal is None and decision.skipped[0].reason == DIMINISHED
    explorer.note_gain(goal, goal.gain)
    assert decide(ROOM, True, explorer).goal == goal


def test_a_fully_known_map_is_done():
    assert decide(["####", "#..#", "####"], True) == (None, (), False)


def two_rooms(blocked):
    """5 m x 5 m each, the right one seen through the door only, in which somebody stands if `blocked`."""
    cells = np.full((100, 200), -1, np.int8)
    cells[:, :100] = 0
    cells[30:70, 100:140] = 0
    cells[[0, -1], :100] = cells[:, 0] = 100
    cells[:, 100] = 100
    cells[40:60, 100] = 100 if blocked else 0
    return Grid(cells, CELL, 0.0, 0.0)


def decide_at_the_door(explorer, blocked):
    grid, pose = two_rooms(blocked), SE2(2.5, 2.5, 0.0)
    costs = LayeredCostmap(CostmapParams(), disc(RADIUS))
    costs.set_static(grid)
    return explorer.decide(grid, GridPlanner().potential(costs.update(), pose), pose).goal


def test_a_blocked_door_is_retried_before_exploration_ends():
    explorer = Explorer(RADIUS)
    goal = decide_at_the_door(explorer, True)
    assert goal.blocked and goal.look_around and goal.pose.x == pytest.approx(4.8, abs=0.2)
    explorer.mark_failed(goal)
    free = decide_at_the_door(explorer, False)
    assert free is not None and not free.blocked
    for _ in range(20):
        if (goal := decide_at_the_door(explorer, True)) is None:
            return
        explorer.mark_failed(goal)
    raise AssertionError("it never ends")


def room_with_a_door_leaf():
    """6 x 4 m, with a doorway in the lower wall that an open door leaf hides from the upper left."""
    truth = np.zeros((80, 120), np.int8)
    truth[[0, 1, -1, -2]] = truth[:, [0, 1, -1, -2]] = 1
    truth[20, :60] = truth[20, 80:] = 1
    for share in np.linspace(0.0, 1.0, 60):
        truth[round(20 + 17 * share), round(60 + 11 * share)] = 1
    return truth


def test_what_a_door_leaf_hides_is_looked_at_from_beside_it():
    """Along the leaf the cheapest viewpoint sees the edge of the unknown, and little of it."""
    pose, mapper = SE2(2.0, 2.6, 0.0), Mapper(room_with_a_door_leaf(), 2 * math.pi, 8.0)
    mapper.look(pose)
    grid, explorer = mapper.grid(), Explorer(0.45)  # a large robot, to which that is too little
    costs = LayeredCostmap(CostmapParams(), disc(RADIUS))
    costs.set_static(grid)
    cost = np.ascontiguousarray(GridPlanner().potential(costs.update(), pose), np.float32)
    (hidden,) = [one for one in find_frontiers(grid, 35, 2.0) if math.hypot(one.x - 4.1, one.y - 1.7) < 0.1]
    cheapest, beside = explorer._viewpoints(grid, cost, hidden, close_first=False)
    gains = [explorer._goal(grid, 1.0, pose, hidden, cell).gain for cell in (cheapest, beside)]
    assert gains[0] < explorer._required_gain.value < 1.0 < gains[1]
    assert (hidden.x, hidden.y) not in [(one.x, one.y) for one in explorer.decide(grid, cost, pose).skipped]


@pytest.mark.parametrize("weight", [LEARNED_WEIGHT, HELD_UP_WEIGHT])
@pytest.mark.parametrize("blocked", [False, True])
def test_an_attempt_that_may_end_otherwise_next_counts_less(weight: float, blocked: bool):
    """One that showed an obstacle, or that a person held up; in the end the frontier is given up all the same."""
    explorer, count = Explorer(RADIUS), 0
    while (goal := decide_at_the_door(explorer, blocked)) is not None and goal.blocked == blocked:
        explorer.mark_failed(goal, weight)
        count += 1
    assert count * weight == explorer.params.max_attempts


def test_a_robot_that_can_reach_hardly_any_floor_is_enclosed():
    grid = two_rooms(False)
    cost = np.full(grid.cells.shape, np.inf, np.float32)
    assert Explorer(RADIUS).decide(grid, cost, SE2(2.5, 2.5, 0.0)).enclosed
    cost[45:55, 45:55] = 0.0
    assert not Explorer(RADIUS).decide(grid, cost, SE2(2.5, 2.5, 0.0)).enclosed
