"""Temporary node of a command in a graph, and its calls of lifecycle and parameter services."""

from __future__ import annotations

import math
import os
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from space_robot_msgs_py.config.validation import full_namespace
from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_msgs_py.ros.locks import is_held, living_nodes, node_lock
from space_robot_msgs_py.ros.process import set_defaults
from space_robot_msgs_py.topics import ROOT
from space_robot_sim.plant.settings import MOST_TICKS

from .domain import domain_asked_for
from .node_names import MISSION, PLANT

TIMEOUT_S = 180.0
"""A node that is configured for the first time with so many joints compiles its kernels first."""
POLL_S = 0.02
FIND_S = 5.0
"""Discovery of a running node takes 0.1 to 1.8 s."""
ASK_AGAIN_S = 3.0
"""A node in flight looks for calls once a second if its last answer was slow."""

Check = Callable[[], None]
"""Called while waiting; raises to give up."""


def own_name(name: str) -> str:
    """Return the name of this process's node of a ``name``."""
    return f"{name}_{os.getpid()}"


class TemporaryNode:
    """Node ``<name>_<pid>`` in a domain, without services or logs."""

    def __init__(self, name: str, domain: int, namespace: str = ROOT) -> None:
        """Join."""
        set_defaults()
        import rclpy
        from rclpy.context import Context
        from rclpy.signals import SignalHandlerOptions

        self._context = Context()
        try:
            rclpy.init(
                args=[],
                context=self._context,
                domain_id=domain,
                signal_handler_options=SignalHandlerOptions.NO,
            )
        except Exception as error:  # RCLError is private
            raise FlightError(f"ROS does not start: {str(error).splitlines()[0]}") from None
        self.node = rclpy.create_node(
            own_name(name),
            context=self._context,
            namespace=namespace,
            start_parameter_services=False,
            enable_rosout=False,
        )

    def leave(self) -> None:
        """Leave the graph."""
        self.node.destroy_node()
        self._context.try_shutdown()


def change_state(node: Any, names: Sequence[str], transition: str, check: Check) -> list[str]:
    """Put nodes through a transition of their lifecycle, all at once.

    Returns:
        The nodes that refused.
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
    """Set parameters of a live node, all of them or none; return when it has done so."""
    from rcl_interfaces.srv import SetParametersAtomically
    from rclpy.parameter import Parameter

    make: Any = Parameter
    request = SetParametersAtomically.Request(
        parameters=[make(n, value=v).to_parameter_msg() for n, v in parameters.items()]
    )
    service = f"{name}/set_parameters_atomically"
    (answer,) = _call(node, SetParametersAtomically, [service], request, check, may_repeat=True)
    if not answer.result.successful:
        raise FlightError(f"{name} refused to change its parameters: {answer.result.reason}")


def call_trigger(node: Any, service: str, check: Check) -> tuple[bool, str]:
    """Call a service of std_srvs/Trigger, however long it takes; return its success and message."""
    from std_srvs.srv import Trigger

    (answer,) = _call(node, Trigger, [service], Trigger.Request(), check, math.inf)
    return answer.success, answer.message


def _call(
    node: Any,
    kind: Any,
    services: Sequence[str],
    request: Any,
    check: Check,
    timeout_s: float = TIMEOUT_S,
    may_repeat: bool = False,
) -> list[Any]:
    """Call services of one kind at the same time; return their answers.

    An answer may be lost: see `_Repeated`. A call that ``may_repeat`` is then made again; any other
    is made once, when its answer is known to arrive.
    """
    from lifecycle_msgs.srv import GetState
    from rclpy.executors import SingleThreadedExecutor

    calls = {service: _Repeated(node, kind, service, request) for service in services}
    states = {} if may_repeat else {s: f"{s.rpartition('/')[0]}/get_state" for s in services}
    probes = {s: _Repeated(node, GetState, states[s], GetState.Request()) for s in states}
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    until = time.monotonic() + timeout_s
    try:
        while not all(call.is_answered for call in calls.values()):
            check()
            for service, call in calls.items():
                if service in probes and not probes[service].is_answered:
                    probes[service].ask()
                elif may_repeat or not call.is_asked:
                    call.ask()
            if time.monotonic() > until:
                silent = [service for service, call in calls.items() if not call.is_answered]
                raise FlightError(f"no answer of {', '.join(silent)} for {timeout_s:.0f} s")
            executor.spin_once(timeout_sec=POLL_S)
        return [calls[service].answer for service in services]
    finally:
        executor.shutdown()
        for call in (*calls.values(), *probes.values()):
            call.close()


class _Repeated:
    """A call of a service that is repeated until an answer arrives.

    A node that has not discovered a caller yet drops its answer after 0.1 s, which a loaded machine
    may take; the caller cannot see that. Discovery is in order: once the answer to a client that
    was made after another one arrives, those to the other do, too.
    """

    def __init__(self, node: Any, kind: Any, service: str, request: Any) -> None:
        self._node, self._request = node, request
        self._client = node.create_client(kind, service)
        self._futures: list[Any] = []
        self._ask_at = 0.0

    def ask(self) -> None:
        now = time.monotonic()
        if not self.is_answered and now >= self._ask_at and self._client.service_is_ready():
            self._ask_at = now + ASK_AGAIN_S
            self._futures.append(self._client.call_async(self._request))

    @property
    def is_asked(self) -> bool:
        return bool(self._futures)

    @property
    def is_answered(self) -> bool:
        return any(future.done() for future in self._futures)

    @property
    def answer(self) -> Any:
        return next(future.result() for future in self._futures if future.done())

    def close(self) -> None:
        self._node.destroy_client(self._client)


def call_simulation(action: str, domain: int | None, namespace: str, ticks: int = 1) -> str:
    """Call ``pause``, ``resume``, ``step`` (``ticks``) or ``reset`` of a plant; return its message.

    ``domain``: None: ROS_DOMAIN_ID, or that of the only plant on this machine.

    Raises:
        InputError: no plant is there, or ``ticks`` cannot be.
        FlightError: the plant refuses.
    """
    if not 1 <= ticks <= MOST_TICKS:
        raise InputError(f"--ticks {ticks}: 1 to {MOST_TICKS} were expected")
    service = f"{PLANT}/{action}"
    with _caller("simulation_call", service, domain, namespace) as (node, check):
        if action == "step":
            set_parameters(node, PLANT, {"step_ticks": ticks}, check)
        success, text = call_trigger(node, service, check)
    if not success:
        raise FlightError(f"{PLANT} cannot {action}: {text}")
    return text


def go_to(segment: str, domain: int | None, namespace: str) -> None:
    """Have the mission of a running graph fly a segment, in place of what it was to fly.

    Raises:
        InputError: no mission is there.
        FlightError: the segment is refused; the flight goes on as it was.
    """
    service = f"{MISSION}/set_parameters_atomically"
    with _caller("goto", service, domain, namespace) as (node, check):
        send_segment(node, segment, check)


def send_segment(node: Any, segment: str, check: Check) -> None:
    """Have a mission fly a segment, see `go_to`; ``node`` is in its graph."""
    # a text of its own: the mission ignores one that it has had
    set_parameters(node, MISSION, {"goto": f"{segment} # {uuid.uuid4()}"}, check)


@contextmanager
def _caller(
    name: str, service: str, domain: int | None, namespace: str
) -> Iterator[tuple[Any, Check]]:
    namespace = full_namespace(namespace)
    domain = domain_asked_for(domain)
    domain = _plant_domain(namespace) if domain is None else domain
    visitor = TemporaryNode(name, domain, namespace)
    try:
        yield visitor.node, _wait_for(visitor.node, service, domain)
    finally:
        visitor.leave()


def _plant_domain(namespace: str) -> int:
    domains = sorted(domain for domain, _ in living_nodes(PLANT, namespace))
    if len(domains) != 1:
        name = f"{namespace.rstrip('/')}/{PLANT}"
        there = f"in ROS domains {', '.join(map(str, domains))}" if domains else "on this machine"
        number = "several" if domains else "no"
        raise InputError(f"{number} {name} {there}: name one's ROS domain with --domain")
    return domains[0]


def _wait_for(node: Any, service: str, domain: int) -> Check:
    owner = service.rpartition("/")[0]
    lock = node_lock(domain, node.resolve_service_name(owner))
    begun = time.monotonic()
    while not node.count_services(service):
        # one that lives on this machine is found in the end, however busy that is
        if time.monotonic() - begun > (TIMEOUT_S if is_held(lock) else FIND_S):
            name = node.resolve_service_name(service)
            raise InputError(f"no service {name} in ROS domain {domain}: is a graph flying there?")
        time.sleep(POLL_S)
    is_here = is_held(lock)  # on this machine: discovery lists a killed node for another 20 s

    def check() -> None:
        if not node.count_services(service) or (is_here and not is_held(lock)):
            raise FlightError(f"{owner} has gone")

    return check
