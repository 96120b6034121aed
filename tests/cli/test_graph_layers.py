"""Where the boxes of a graph go: none over another, and no farther apart than they need be."""

import itertools

from hypothesis import given
from hypothesis import strategies as st

from chefbot.ros2.tools.graph_layout import GAP_X, Layout, lay_out

names = st.sampled_from([f"n{i}" for i in range(12)])
graphs = st.lists(st.tuples(names, names).filter(lambda edge: edge[0] != edge[1]), max_size=25, unique=True)


@given(graphs)
def test_boxes_lie_apart_and_within_the_picture(edges):
    sizes = {f"n{i}": (60.0 + 5 * i, 20.0) for i in range(12)}
    layout = lay_out(sizes, edges)
    for a, b in itertools.combinations(layout.boxes.values(), 2):
        assert a.x + a.width <= b.x or b.x + b.width <= a.x or a.y + a.height <= b.y or b.y + b.height <= a.y
    assert all(box.y + box.height <= layout.height + 1e-6 for box in layout.boxes.values())
    assert set(layout.lines) == set(edges)


@given(graphs, graphs)
def test_what_is_not_joined_does_not_push_each_other_away(one, other):
    first = [(f"a{a}", f"a{b}") for a, b in one]
    second = [(f"b{a}", f"b{b}") for a, b in other]
    heights = [laid_out(edges).height for edges in (first, second, first + second)]
    assert heights[2] <= heights[0] + heights[1] + GAP_X + 1e-6


def laid_out(edges: list[tuple[str, str]]) -> Layout:
    return lay_out({name: (50.0, 20.0) for edge in edges for name in edge}, edges)
