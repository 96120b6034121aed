"""Behavior trees: the control nodes of BehaviorTree.CPP and Nav2 on py_trees, and their XML format."""
