"""The base of our lifecycle nodes: they start themselves, say what they are, and survive a failed transition."""
from __future__ import annotations

from collections.abc import Mapping

from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from mobile_planning.errors import PlanningError
from mobile_planning.nodes.diagnostics import Diagnostics, Level
from mobile_planning.nodes.guard import Guard
from mobile_planning.nodes.parameters import Parameters


class ManagedNode(LifecycleNode):
    """A lifecycle node with checked parameters, guarded callbacks and diagnostics.

    A subclass fills in `configure`, `activate`, `deactivate`, `cleanup`, `facts` and `change`, and calls `start` at
    the end of its ``__init__``. A transition that raises is logged, and the node is unconfigured and alive.

    Parameters
    ----------
    name : str
        Of the node.
    options : type
        The dataclass of its parameters (see `Parameters`), with a field ``autostart``.
    **kwargs
        For ``rclpy.node.Node``.

    Attributes
    ----------
    guard : Guard
    options : object
        The parameters as they stand.
    is_active : bool
    """

    def __init__(self, name: str, options: type, **kwargs):
        super().__init__(name, **kwargs)
        self.guard = Guard(self)
        self.is_active = False
        self._state, self._problem = 'unconfigured', ''
        self._declared = Parameters(self, options, self.guard.callback(lambda changed: self.change(changed)))
        self._diagnostics = Diagnostics(self, self.guard, self._report)

    @property
    def options(self):
        """The parameters as they stand."""
        return self._declared.values

    def start(self) -> None:
        """Configure and activate the node, unless its parameter ``autostart`` says no."""
        if self.options.autostart and self.trigger_configure() == TransitionCallbackReturn.SUCCESS:
            self.trigger_activate()

    def require_active(self) -> None:
        """Refuse a request while the node is not active.

        Raises
        ------
        PlanningError
        """
        if not self.is_active:
            raise PlanningError(f'{self.get_name()} is {self._state}: it answers once it is active')

    def configure(self) -> None:
        """Make what the node needs before it is active; may raise."""

    def activate(self) -> None:
        """Begin to publish; may raise."""

    def deactivate(self) -> None:
        """Stop publishing."""

    def cleanup(self) -> None:
        """Give back what `configure` made, as far as it came."""

    def change(self, options) -> None:
        """Take over parameters that were changed while the node runs."""

    def facts(self) -> Mapping[str, object]:
        """Return what the diagnostics show beside the counts of failures."""
        return {}

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer the transition from unconfigured to inactive."""
        return self._pass(self.configure, super().on_configure, state, 'inactive')

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer the transition from inactive to active."""
        return self._pass(self.activate, super().on_activate, state, 'active')

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer the transition from active to inactive."""
        return self._pass(self.deactivate, super().on_deactivate, state, 'inactive')

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer the transition from inactive to unconfigured."""
        return self._pass(self.cleanup, super().on_cleanup, state, 'unconfigured')

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Answer the transition to finalized, where nothing leads out."""
        return self._pass(self.cleanup, super().on_shutdown, state, 'finalized')

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Go back to unconfigured after a transition that failed."""
        return self._pass(self.cleanup, super().on_error, state, 'unconfigured')

    def destroy_node(self) -> None:
        """End the node and free what it has in the middleware."""
        super().destroy_node()
        # rclpy forgets it, and it holds the node and with it the participant until the garbage collector comes by.
        self._state_machine.destroy_when_not_in_use()

    def _pass(self, hook, base, state, label):
        """Run a transition: the publishers' part, then ours."""
        result = base(state)
        if result == TransitionCallbackReturn.SUCCESS:
            # rclpy would take the exception for an error too, but without a word.
            try:
                hook()
            except Exception as error:
                self.guard.note(error, hook.__name__)
                self._problem = f'could not {hook.__name__}: {self.guard.newest}'
                self.get_logger().error(f'could not {hook.__name__}: the node is unconfigured')
                return TransitionCallbackReturn.ERROR
            self._state, self.is_active = label, label == 'active'
            self._problem = '' if self.is_active else self._problem
        return result

    def _report(self):
        """Return level, message and facts for the diagnostics."""
        level = Level.OK if self.is_active else Level.ERROR if self._problem else Level.WARN
        return level, self._problem or self._state, {'state': self._state, **self.facts()}
