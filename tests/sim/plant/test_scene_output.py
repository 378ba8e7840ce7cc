"""A plant tells who comes late what its robot looks like, and the recorder where it is."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import pytest

from space_robot_model.robot import Robot
from space_robot_model.robot.urdf_text import urdf_text
from space_robot_msgs_py import topics
from space_robot_msgs_py.samples import RobotState, Timebase
from space_robot_msgs_py.wire.carrier import unwrap
from space_robot_msgs_py.wire.definitions import decode

pytest.importorskip("rclpy")

from space_robot_msgs_py.ros.locks import look, topic_lock
from space_robot_sim.plant import scene_output

if TYPE_CHECKING:
    from ground import Ground

    from space_robot_msgs_py.ros.endpoints import RawSubscription


def wait_for_message(ground: Ground, subscription: RawSubscription) -> bytes:
    heard: list[bytes] = []

    def has_come() -> bool:
        if data := subscription.take():
            heard.append(data)
        return bool(heard)

    ground.until(has_come, subscription.full_name)
    time.sleep(0.1)
    assert subscription.take() is None, "once"
    return heard[0]


def test_who_comes_late_is_told_all_that_holds_for_the_flight(
    start: Callable[..., object], ground: Ground, domain: int, paper_robot: Robot
) -> None:
    """The plant has sent its first state, and waits for an answer, when the listener comes.

    It has claimed what it does not send, too, so others' messages there are foreign.
    """
    from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawSubscription

    start("plant")
    ground.until(lambda: ground.value("plant", "sent /joint_states") > 0, "the first state")
    group = PolledCallbackGroup()
    description, static = (
        RawSubscription(ground.node, topic, group)
        for topic in (topics.ROBOT_DESCRIPTION, topics.TRANSFORMS_STATIC)
    )
    text = decode(wait_for_message(ground, description), topics.ROBOT_DESCRIPTION.type).data
    assert text.rstrip("\n") == urdf_text(paper_robot).rstrip("\n")
    (tool,) = decode(unwrap(wait_for_message(ground, static)), topics.TF_STATIC.type).transforms
    assert (tool.header.frame_id, tool.child_frame_id) == ("link6", "tool")
    for topic in (topics.ROBOT_DESCRIPTION, topics.TRANSFORMS, topics.WHEELS_STATE):
        is_held, _ = look(topic_lock(domain, topic.full_name))
        assert is_held, topic


class Outputs:
    """A node whose topics keep what is sent; the poses' markers, too."""

    def __init__(self, patch: pytest.MonkeyPatch, installed: set[str]) -> None:
        self.sent: dict[str, list[bytes]] = {}
        self.marked: list[str] = []
        patch.setattr(scene_output, "RawPublisher", self._topic)
        patch.setattr(scene_output, "MarkerOutput", self._markers)
        patch.setattr(scene_output, "find_spec", lambda name: name in installed or None)

    def get_namespace(self) -> str:
        return topics.ROOT

    def _topic(self, node: object, topic: topics.Topic) -> Any:
        return SimpleNamespace(publish=self.sent.setdefault(topic.name, []).append)

    def _markers(self, *_: object) -> Any:
        return SimpleNamespace(
            outputs=("the markers",),
            send=lambda truth: self.marked.append(f"sent {truth.tick}"),
            show=lambda truth: self.marked.append(f"shown {truth.tick}"),
        )

    def counts(self) -> dict[str, int]:
        return {name: len(sent) for name, sent in self.sent.items()}


ALL = {"tf2_msgs", "visualization_msgs"}


@pytest.mark.parametrize("installed", [set(), {"tf2_msgs"}, {"visualization_msgs"}, ALL])
def test_viewers_are_sent_what_they_can_show(
    paper_robot: Robot, monkeypatch: pytest.MonkeyPatch, installed: set[str]
) -> None:
    """To the recorder in any case, 100 times a simulated second; what stands still, to viewers."""
    node: Any = Outputs(monkeypatch, installed)
    output = scene_output.SceneOutput(node, paper_robot, Timebase(500_000))
    has_tf, has_markers = "tf2_msgs" in installed, "visualization_msgs" in installed
    assert len(output.outputs) == 3
    assert len(output.viewed) == 2 * has_tf + has_markers
    for _ in range(2):
        output.begin()
    lasting = {"robot_description": 1, "_transforms": 0, "_transforms/static": 1}
    assert node.counts() == lasting | ({"/tf": 0, "/tf_static": 1} if has_tf else {})
    truth = RobotState.allocate(paper_robot.n)
    truth.quaternion[0] = 1.0
    for truth.tick in range(41):
        output.send(truth)
    assert len(node.sent["_transforms"]) == 3
    output.show(truth)
    assert len(node.sent["_transforms"]) == 3
    if has_tf:
        assert len(node.sent["/tf"]) == 4
        assert node.sent["/tf"][:3] == [unwrap(data) for data in node.sent["_transforms"]]
        assert node.sent["/tf"][3] == node.sent["/tf"][2]
        assert node.sent["/tf_static"] == [unwrap(node.sent["_transforms/static"][0])]
    marked = [*(f"sent {tick}" for tick in range(41)), "shown 40"]
    assert node.marked == (marked if has_markers else [])
