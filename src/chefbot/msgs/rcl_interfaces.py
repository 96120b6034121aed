"""rcl_interfaces: parameters and logs of nodes."""
# ruff: noqa: N801 (names on the wire)

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from chefbot.msgs.builtin_interfaces import Time
from chefbot.msgs.idl.message import (
    Bool,
    Float64,
    Float64Array,
    Int64,
    Message,
    String,
    StringArray,
    Uint8,
    Uint8Array,
    Uint32,
    Uint64,
)
from chefbot.msgs.idl.service import define_service

DEBUG, INFO, WARN, ERROR, FATAL = 10, 20, 30, 40, 50
"""Levels of Log."""
NOT_SET, BOOL, INTEGER, DOUBLE, STRING = range(5)
BYTE_ARRAY, BOOL_ARRAY, INTEGER_ARRAY, DOUBLE_ARRAY, STRING_ARRAY = range(5, 10)
"""Types of a ParameterValue."""

ByteArray = Annotated[NDArray[np.uint8], "byte[]"]
BoolArray = Annotated[NDArray[np.bool_], "bool[]"]
Int64Array = Annotated[NDArray[np.int64], "int64[]"]
_NO_BYTES = np.empty(0, np.uint8)
_NO_BOOLS = np.empty(0, np.bool_)
_NO_INTEGERS = np.empty(0, np.int64)
_NO_DOUBLES = np.empty(0, np.float64)


class Log(Message, frozen=True, eq=False):
    """A sentence of a node."""

    stamp: Time = Time()
    level: Uint8 = 0
    name: String = ""
    msg: String = ""
    file: String = ""
    function: String = ""
    line: Uint32 = 0


class ParameterValue(Message, frozen=True, eq=False):
    """A value of one of nine types; `type` says which field holds it."""

    type: Uint8 = 0
    bool_value: Bool = False
    integer_value: Int64 = 0
    double_value: Float64 = 0.0
    string_value: String = ""
    byte_array_value: ByteArray = _NO_BYTES
    bool_array_value: BoolArray = _NO_BOOLS
    integer_array_value: Int64Array = _NO_INTEGERS
    double_array_value: Float64Array = _NO_DOUBLES
    string_array_value: StringArray = ()


class Parameter(Message, frozen=True, eq=False):
    """A named value."""

    name: String = ""
    value: ParameterValue = ParameterValue()


class FloatingPointRange(Message, frozen=True, eq=False):
    """Bounds of a number."""

    from_value: Float64 = 0.0
    to_value: Float64 = 0.0
    step: Float64 = 0.0


class IntegerRange(Message, frozen=True, eq=False):
    """Bounds of a whole number."""

    from_value: Int64 = 0
    to_value: Int64 = 0
    step: Uint64 = 0


class ParameterDescriptor(Message, frozen=True, eq=False):
    """What a parameter is."""

    name: String = ""
    type: Uint8 = 0
    description: String = ""
    additional_constraints: String = ""
    read_only: Bool = False
    dynamic_typing: Bool = False
    floating_point_range: Annotated[tuple[FloatingPointRange, ...], "<=1"] = ()
    integer_range: Annotated[tuple[IntegerRange, ...], "<=1"] = ()


class ParameterEvent(Message, frozen=True, eq=False):
    """Parameters of a node have changed."""

    stamp: Time = Time()
    node: String = ""
    new_parameters: tuple[Parameter, ...] = ()
    changed_parameters: tuple[Parameter, ...] = ()
    deleted_parameters: tuple[Parameter, ...] = ()


class ListParametersResult(Message, frozen=True, eq=False):
    """Names, and what stands before their last dots."""

    names: StringArray = ()
    prefixes: StringArray = ()


class SetParametersResult(Message, frozen=True, eq=False):
    """Whether it was set, or why not."""

    successful: Bool = False
    reason: String = ""


class ListParameters_Request(Message, frozen=True, eq=False):
    """Under which prefixes, how deep (0: all)."""

    prefixes: StringArray = ()
    depth: Uint64 = 0


class ListParameters_Response(Message, frozen=True, eq=False):
    """What there is."""

    result: ListParametersResult = ListParametersResult()


class GetParameters_Request(Message, frozen=True, eq=False):
    """Which ones."""

    names: StringArray = ()


class GetParameters_Response(Message, frozen=True, eq=False):
    """Their values; NOT_SET for one that is not there."""

    values: tuple[ParameterValue, ...] = ()


class GetParameterTypes_Request(Message, frozen=True, eq=False):
    """Which ones."""

    names: StringArray = ()


class GetParameterTypes_Response(Message, frozen=True, eq=False):
    """Their types."""

    types: Uint8Array = _NO_BYTES


class DescribeParameters_Request(Message, frozen=True, eq=False):
    """Which ones."""

    names: StringArray = ()


class DescribeParameters_Response(Message, frozen=True, eq=False):
    """What they are."""

    descriptors: tuple[ParameterDescriptor, ...] = ()


class SetParameters_Request(Message, frozen=True, eq=False):
    """New values, each set or refused by itself."""

    parameters: tuple[Parameter, ...] = ()


class SetParameters_Response(Message, frozen=True, eq=False):
    """How each went."""

    results: tuple[SetParametersResult, ...] = ()


class SetParametersAtomically_Request(Message, frozen=True, eq=False):
    """New values, all set or none."""

    parameters: tuple[Parameter, ...] = ()


class SetParametersAtomically_Response(Message, frozen=True, eq=False):
    """How it went."""

    result: SetParametersResult = SetParametersResult()


ListParameters = define_service(ListParameters_Request, ListParameters_Response)
GetParameters = define_service(GetParameters_Request, GetParameters_Response)
GetParameterTypes = define_service(GetParameterTypes_Request, GetParameterTypes_Response)
DescribeParameters = define_service(DescribeParameters_Request, DescribeParameters_Response)
SetParameters = define_service(SetParameters_Request, SetParameters_Response)
SetParametersAtomically = define_service(SetParametersAtomically_Request, SetParametersAtomically_Response)
