"""Messages for viewers: rosbags, which has ROS's definitions, writes the same bytes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from space_robot_msgs_py import topics
from space_robot_msgs_py.samples import Timebase
from space_robot_msgs_py.wire.carrier import unwrap, wrap
from space_robot_msgs_py.wire.definitions import definition, jazzy
from space_robot_msgs_py.wire.poses import POSE
from space_robot_msgs_py.wire.robot_description import robot_description
from space_robot_msgs_py.wire.tf import Frame, TransformsCodec

NAMES = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=9)
TIMEBASE = Timebase(500_000)


def rosbags_bytes(frames: Sequence[Frame], stamp_ns: int, poses: np.ndarray) -> bytes:
    types = jazzy().types
    header, time = types["std_msgs/msg/Header"], types["builtin_interfaces/msg/Time"]
    stamped = types["geometry_msgs/msg/TransformStamped"]
    vector, rotation = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]
    message = types["tf2_msgs/msg/TFMessage"](
        transforms=[
            stamped(
                header=header(time(*divmod(stamp_ns, 1_000_000_000)), frame.parent),
                child_frame_id=frame.child,
                transform=types["geometry_msgs/msg/Transform"](
                    vector(*pose[:3]), rotation(*pose[3:])
                ),
            )
            for frame, pose in zip(frames, poses.tolist(), strict=True)
        ]
    )
    return bytes(jazzy().serialize_cdr(message, "tf2_msgs/msg/TFMessage"))


@given(
    st.lists(st.builds(Frame, NAMES, NAMES), max_size=6),
    st.integers(0, 10**9),
    st.integers(0, 2**32),
)
def test_transforms_are_the_bytes_of_rosbags(frames: list[Frame], tick: int, seed: int) -> None:
    """Of a codec that has written another message before."""
    rng, codec = np.random.default_rng(seed), TransformsCodec(frames, TIMEBASE)
    codec.encode(7, rng.normal(size=(len(frames), POSE)))
    poses = rng.normal(size=(len(frames), POSE))
    assert codec.encode(tick, poses) == rosbags_bytes(frames, TIMEBASE.stamp_ns(tick), poses)


@given(st.binary(max_size=99))
def test_a_carrier_is_a_message_of_ros(data: bytes) -> None:
    message = jazzy().deserialize_cdr(wrap(data), topics.CARRIER)
    assert bytes(message.data) == unwrap(wrap(data)) == data


@given(st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=99))
def test_a_description_is_read_back(text: str) -> None:
    """Whole words: so the middleware adds nothing, and all bags have the same bytes."""
    data = robot_description(text)
    read = jazzy().deserialize_cdr(data, "std_msgs/msg/String").data
    assert read in {text + count * "\n" for count in range(4)}
    assert len(data) % 4 == 0
    message = jazzy().types["std_msgs/msg/String"](read)
    assert bytes(jazzy().serialize_cdr(message, "std_msgs/msg/String")) == data


def test_bags_can_tell_what_a_transform_is() -> None:
    text = definition(topics.TF.type)
    assert "TransformStamped[] transforms" in text
    assert text.count("MSG: ") == 6
