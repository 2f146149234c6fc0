"""ROS parameters from a frozen dataclass of options.

A node's options are one frozen dataclass whose fields are made by `option`. `Parameters` declares each field as a
parameter with its description and range, and holds the options as they stand: one object, replaced as a whole, so
that nobody ever sees half of a change.

A parameter that was given to the node and that it does not have is refused. So a parameter file must name the node;
what stands under ``/**`` reaches every node, and each of them must know it.
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import MISSING, Field, field, fields, replace
from difflib import get_close_matches
from typing import Any, Generic, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from mobile_planning.errors import InvalidInput, PlanningError

Options = TypeVar('Options')


def option(default: Any, description: str, *, low: float | None = None, high: float | None = None,
           read_only: bool = False) -> Field:
    """Return a dataclass field that becomes a ROS parameter.

    Parameters
    ----------
    default : bool, int, float, str or tuple of one of these
        Its type is the parameter's type. An empty tuple is one of strings.
    description : str
        What it means, with its unit.
    low, high : float, optional
        The least and the greatest value of a number; both or neither.
    read_only : bool
        Whether it is fixed once the node runs.

    Returns
    -------
    dataclasses.Field
    """
    return field(default=default, metadata={'description': description, 'low': low, 'high': high,
                                            'read_only': read_only})


class Parameters(Generic[Options]):
    """The options of a node, declared as its parameters.

    Parameters
    ----------
    node : rclpy.node.Node
    options : type
        A frozen dataclass whose fields are all made by `option`. Its ``__post_init__`` may raise a
        `PlanningError` for values that do not go together; a change at run time is then refused with that sentence.
    on_change : callable, optional
        Called with the new options after a change at run time. It must not raise.

    Attributes
    ----------
    values : Options

    Raises
    ------
    PlanningError
        If a parameter given at the start is unknown, of another type or out of its range.
    """

    def __init__(self, node: Node, options: type[Options], on_change: Callable[[Options], None] | None = None):
        self._fields = {entry.name: entry for entry in fields(options)}
        self._on_change = on_change
        # What the command line and the parameter files say for this node; rclpy has no public name for it.
        given = node._parameter_overrides
        self._refuse_unknown(node, given)
        given.update({name: self._as_declared(given[name]) for name in self._fields if name in given})
        self.values: Options = options(**{name: self._declare(node, entry) for name, entry in self._fields.items()})
        node.add_pre_set_parameters_callback(lambda changes: [self._as_declared(change) for change in changes])
        node.add_on_set_parameters_callback(self._judge)
        node.add_post_set_parameters_callback(self._adopt)

    def _refuse_unknown(self, node, given):
        """Refuse the first parameter that was given to this node and that it does not have."""
        for name in given:
            if name not in self._fields and not node.has_parameter(name):
                near = get_close_matches(name, self._fields, 1)
                hint = f'did you mean {near[0]}?' if near else f'it has {", ".join(self._fields)}'
                raise InvalidInput(f'{node.get_name()} has no parameter {name}: {hint}')

    def _declare(self, node, entry):
        """Declare one field and return its value."""
        meta = entry.metadata
        descriptor = ParameterDescriptor(description=meta['description'], read_only=meta['read_only'])
        if meta['low'] is not None and isinstance(entry.default, float):
            descriptor.floating_point_range = [FloatingPointRange(from_value=float(meta['low']),
                                                                  to_value=float(meta['high']))]
        elif meta['low'] is not None:
            descriptor.integer_range = [IntegerRange(from_value=int(meta['low']), to_value=int(meta['high']))]
        # rclpy takes an empty list for one of bytes.
        default = [''] if entry.default == () else entry.default
        try:
            return self._from_ros(node.declare_parameter(entry.name, default, descriptor).value)
        except ParameterException:
            given, kind = node._parameter_overrides[entry.name], type(entry.default).__name__
            limits = '' if meta['low'] is None else f' within {meta["low"]} to {meta["high"]}'
            raise InvalidInput(f'parameter {entry.name} of {node.get_name()} must be a {kind}{limits}, '
                               f'not {given.value!r}') from None

    def _as_declared(self, parameter):
        """Return the parameter with integers turned into floats where floats are declared: people write 5 for 5.0."""
        default = getattr(self._fields.get(parameter.name), 'default', MISSING)
        if isinstance(default, float) and parameter.type_ is Parameter.Type.INTEGER:
            return Parameter(parameter.name, value=float(parameter.value))
        if (isinstance(default, tuple) and default and isinstance(default[0], float)
                and parameter.type_ is Parameter.Type.INTEGER_ARRAY):
            return Parameter(parameter.name, value=[float(value) for value in parameter.value])
        return parameter

    @staticmethod
    def _from_ros(value):
        """Return a parameter's value as the dataclass holds it."""
        if isinstance(value, (str, bool, int, float)):
            return value
        return tuple(item for item in value if item != '')

    def _changed(self, parameters):
        """Return the options with these parameters in place of the present ones."""
        return replace(self.values, **{parameter.name: self._from_ros(parameter.value)
                                       for parameter in parameters if parameter.name in self._fields})

    def _judge(self, parameters):
        """Say whether the options may become what these parameters make of them."""
        try:
            self._changed(parameters)
        except PlanningError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _adopt(self, parameters):
        """Take over parameters that were judged good."""
        changed = self._changed(parameters)
        if changed != self.values:
            self.values = changed
            if self._on_change:
                self._on_change(changed)
