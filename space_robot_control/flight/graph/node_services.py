"""Calls of the nodes' services: their lifecycle, and their parameters."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from space_robot_msgs_py.errors import FlightError

TIMEOUT_S = 180.0
"""A node that is configured for the first time with so many joints compiles its kernels first."""
POLL_S = 0.02
ASK_AGAIN_S = 3.0
"""A node in flight looks for calls once a second if its last answer was slow."""

Check = Callable[[], None]
"""Called while waiting; raises to give up."""


def change_state(node: Any, names: Sequence[str], transition: str, check: Check) -> list[str]:
    """Put nodes through a transition of their lifecycle, all at once.

    Args:
        node: the rclpy node to call from.
        names: names of the nodes in the namespace of that one.
        transition: its label, as ``configure``.
        check: see `Check`.

    Returns:
        The nodes that refused.

    Raises:
        FlightError: a node does not answer.
    """
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState

    number = getattr(Transition, f"TRANSITION_{transition.upper()}")
    request = ChangeState.Request(transition=Transition(id=number))
    answers = _call(node, ChangeState, [f"{name}/change_state" for name in names], request, check)
    return [name for name, answer in zip(names, answers, strict=True) if not answer.success]


def set_parameters(
    node: Any, name: str, parameters: Mapping[str, str | int | list[float]], check: Check
) -> None:
    """Set parameters of a live node, all of them or none; return when it has done so.

    Args:
        node: the rclpy node to call from.
        name: name of the node whose parameters they are, in the namespace of that one.
        parameters: their values.
        check: see `Check`.

    Raises:
        FlightError: the node refuses, or does not answer.
    """
    from rcl_interfaces.srv import SetParametersAtomically
    from rclpy.parameter import Parameter

    make: Any = Parameter
    request = SetParametersAtomically.Request(
        parameters=[make(n, value=v).to_parameter_msg() for n, v in parameters.items()]
    )
    service = f"{name}/set_parameters_atomically"
    (answer,) = _call(node, SetParametersAtomically, [service], request, check)
    if not answer.result.successful:
        raise FlightError(f"{name} refused to change its parameters: {answer.result.reason}")


def get_parameters(node: Any, name: str, parameters: Sequence[str], check: Check) -> list[Any]:
    """Return the values of a node's parameters, None of one that it does not have (yet).

    Args:
        node: the rclpy node to call from.
        name: name of the node whose parameters they are, in the namespace of that one.
        parameters: their names.
        check: see `Check`.

    Raises:
        FlightError: the node does not answer.
    """
    from rcl_interfaces.srv import GetParameters
    from rclpy.parameter import parameter_value_to_python

    request = GetParameters.Request(names=list(parameters))
    (answer,) = _call(node, GetParameters, [f"{name}/get_parameters"], request, check)
    values = [parameter_value_to_python(value) for value in answer.values]
    return values or [None] * len(parameters)


def call_trigger(node: Any, service: str, check: Check) -> tuple[bool, str]:
    """Call a service of std_srvs/Trigger, however long it takes; return its success and message.

    Args:
        node: the rclpy node to call from.
        service: its name, in the namespace of that one.
        check: see `Check`.
    """
    from std_srvs.srv import Trigger

    (answer,) = _call(node, Trigger, [service], Trigger.Request(), check, math.inf)
    return answer.success, answer.message


def _call(
    node: Any, kind: Any, services: Sequence[str], request: Any, check: Check,
    timeout_s: float = TIMEOUT_S,
) -> list[Any]:  # fmt: skip
    """Call services of one kind at the same time, each once; return their answers."""
    from rclpy.executors import SingleThreadedExecutor

    clients = {service: node.create_client(kind, service) for service in services}
    probes = {service: _Probe(node, service.rpartition("/")[0]) for service in services}
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    answers: dict[str, Any] = {}
    until = time.monotonic() + timeout_s
    try:
        while len(answers) < len(clients) or not all(a.done() for a in answers.values()):
            check()
            for service, client in clients.items():
                if service in answers or not client.service_is_ready():
                    continue
                if probes[service].is_answered():
                    answers[service] = client.call_async(request)
            if time.monotonic() > until:
                silent = [s for s in services if s not in answers or not answers[s].done()]
                raise FlightError(f"no answer of {', '.join(silent)} for {timeout_s:.0f} s")
            executor.spin_once(timeout_sec=POLL_S)
        return [answers[service].result() for service in services]
    finally:
        executor.shutdown()
        for client in clients.values():
            node.destroy_client(client)
        for probe in probes.values():
            probe.close()


class _Probe:
    """Finds out whether a node's answers arrive here.

    A node that has not discovered a caller yet drops its answer after 0.1 s, which a loaded machine
    may take; the caller cannot see that. Discovery is in order: once the answer to a client that
    was made after another one arrives, those to the other do, too.
    """

    def __init__(self, node: Any, name: str) -> None:
        """``name``: the lifecycle node that is asked for its state, in the namespace of ``node``."""
        from lifecycle_msgs.srv import GetState

        self._node, self._request = node, GetState.Request()
        self._client = node.create_client(GetState, f"{name}/get_state")
        self._answers: list[Any] = []
        self._ask_at = 0.0

    def is_answered(self) -> bool:
        """Tell whether an answer has come; else ask, if it is time again."""
        now = time.monotonic()
        if now >= self._ask_at and self._client.service_is_ready():
            self._ask_at = now + ASK_AGAIN_S
            self._answers.append(self._client.call_async(self._request))
        return any(answer.done() for answer in self._answers)

    def close(self) -> None:
        """Ask no more."""
        self._node.destroy_client(self._client)
