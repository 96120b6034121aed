"""rcl_interfaces: node parameters and log messages."""
# ruff: noqa: N801 (names on the wire)

from __future__ import annotations

from typing import Annotated, Any

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
"""Severity levels of Log messages."""
NOT_SET, BOOL, INTEGER, DOUBLE, STRING = range(5)
BYTE_ARRAY, BOOL_ARRAY, INTEGER_ARRAY, DOUBLE_ARRAY, STRING_ARRAY = range(5, 10)
"""Values of the field `type` of a ParameterValue."""

ByteArray = Annotated[NDArray[np.uint8], "byte[]"]
BoolArray = Annotated[NDArray[np.bool_], "bool[]"]
Int64Array = Annotated[NDArray[np.int64], "int64[]"]
_NO_BYTES = np.empty(0, np.uint8)
_NO_BOOLS = np.empty(0, np.bool_)
_NO_INTEGERS = np.empty(0, np.int64)
_NO_DOUBLES = np.empty(0, np.float64)


class Log(Message, frozen=True, eq=False):
    """A log message of a node."""

    stamp: Time = Time()
    level: Uint8 = 0
    name: String = ""
    msg: String = ""
    file: String = ""
    function: String = ""
    line: Uint32 = 0


class ParameterValue(Message, frozen=True, eq=False):
    """A parameter value of one of nine types; `type` is the position of the field that holds it."""

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

    @property
    def plain(self) -> Any:
        """The value as a number, a text or a list; None if it is not set."""
        if not NOT_SET < self.type <= STRING_ARRAY:
            return None
        value = getattr(self, self.__struct_fields__[self.type])
        if isinstance(value, np.ndarray):
            return value.tolist()
        return list(value) if isinstance(value, tuple) else value


class Parameter(Message, frozen=True, eq=False):
    """A parameter's name and value."""

    name: String = ""
    value: ParameterValue = ParameterValue()


class FloatingPointRange(Message, frozen=True, eq=False):
    """The range and step of a floating-point parameter."""

    from_value: Float64 = 0.0
    to_value: Float64 = 0.0
    step: Float64 = 0.0


class IntegerRange(Message, frozen=True, eq=False):
    """The range and step of an integer parameter."""

    from_value: Int64 = 0
    to_value: Int64 = 0
    step: Uint64 = 0


class ParameterDescriptor(Message, frozen=True, eq=False):
    """The type, description and constraints of a parameter."""

    name: String = ""
    type: Uint8 = 0
    description: String = ""
    additional_constraints: String = ""
    read_only: Bool = False
    dynamic_typing: Bool = False
    floating_point_range: Annotated[tuple[FloatingPointRange, ...], "<=1"] = ()
    integer_range: Annotated[tuple[IntegerRange, ...], "<=1"] = ()


class ParameterEvent(Message, frozen=True, eq=False):
    """A notification of new, changed and deleted parameters of a node."""

    stamp: Time = Time()
    node: String = ""
    new_parameters: tuple[Parameter, ...] = ()
    changed_parameters: tuple[Parameter, ...] = ()
    deleted_parameters: tuple[Parameter, ...] = ()


class ListParametersResult(Message, frozen=True, eq=False):
    """Parameter names, and their prefixes up to the last dot."""

    names: StringArray = ()
    prefixes: StringArray = ()


class SetParametersResult(Message, frozen=True, eq=False):
    """Whether a parameter was set, or the reason why not."""

    successful: Bool = False
    reason: String = ""


class ListParameters_Request(Message, frozen=True, eq=False):
    """A request for parameter names under some prefixes, to a depth (0: no limit)."""

    prefixes: StringArray = ()
    depth: Uint64 = 0


class ListParameters_Response(Message, frozen=True, eq=False):
    """The parameter names that were found."""

    result: ListParametersResult = ListParametersResult()


class GetParameters_Request(Message, frozen=True, eq=False):
    """A request for the values of parameters."""

    names: StringArray = ()


class GetParameters_Response(Message, frozen=True, eq=False):
    """The parameters' values; NOT_SET for one that does not exist."""

    values: tuple[ParameterValue, ...] = ()


class GetParameterTypes_Request(Message, frozen=True, eq=False):
    """A request for the types of parameters."""

    names: StringArray = ()


class GetParameterTypes_Response(Message, frozen=True, eq=False):
    """The types of the requested parameters."""

    types: Uint8Array = _NO_BYTES


class DescribeParameters_Request(Message, frozen=True, eq=False):
    """A request for the descriptors of parameters."""

    names: StringArray = ()


class DescribeParameters_Response(Message, frozen=True, eq=False):
    """The descriptors of the requested parameters."""

    descriptors: tuple[ParameterDescriptor, ...] = ()


class SetParameters_Request(Message, frozen=True, eq=False):
    """A request to set parameters, each one independently of the others."""

    parameters: tuple[Parameter, ...] = ()


class SetParameters_Response(Message, frozen=True, eq=False):
    """The result for each parameter."""

    results: tuple[SetParametersResult, ...] = ()


class SetParametersAtomically_Request(Message, frozen=True, eq=False):
    """A request to set all parameters or none."""

    parameters: tuple[Parameter, ...] = ()


class SetParametersAtomically_Response(Message, frozen=True, eq=False):
    """The result for all parameters together."""

    result: SetParametersResult = SetParametersResult()


ListParameters = define_service(ListParameters_Request, ListParameters_Response)
GetParameters = define_service(GetParameters_Request, GetParameters_Response)
GetParameterTypes = define_service(GetParameterTypes_Request, GetParameterTypes_Response)
DescribeParameters = define_service(DescribeParameters_Request, DescribeParameters_Response)
SetParameters = define_service(SetParameters_Request, SetParameters_Response)
SetParametersAtomically = define_service(SetParametersAtomically_Request, SetParametersAtomically_Response)
