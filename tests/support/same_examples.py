"""Makes the examples of Hypothesis independent of the imported modules."""

from __future__ import annotations

from hypothesis.internal.conjecture import providers


def ignore_constants_of_the_code() -> None:
    """Draw no constants from the modules that happen to be loaded.

    Hypothesis collects them, also with `derandomize`: the examples then depend on which tests the process ran before,
    and change with every constant of the code. There is no setting for it.
    """
    none = providers.Constants(
        integers=providers.SortedSet(),
        floats=providers.SortedSet(key=providers.float_to_int),
        bytes=providers.SortedSet(),
        strings=providers.SortedSet(),
    )
    providers.HypothesisProvider._local_constants = none  # type: ignore[assignment]
    # to find those that are not used would take a second in each process
    providers._get_local_constants = lambda: none
