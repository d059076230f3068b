"""The gateway's CDR codec against two others: rclpy on Fast CDR, and rosbags, which is pure Python."""

from __future__ import annotations

import json
import math
import os
import random
import subprocess
from typing import Any

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message

from conftest import TARGET, need
from random_messages import random_message, type_named
from rmw_zenoh import hashes
from rosbags_types import STORE, in_rosbags

CODEC = TARGET / "release" / "examples" / "ros2_cdr"
SEED = int(os.environ.get("CURIONAV_SEED", "20260801"))
VALUES = 60
"""Random values of each type and kind of test."""


def codec(*arguments: str, lines: str = "") -> list[str]:
    done = subprocess.run([CODEC, *arguments], input=lines, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, f"{done.stderr}\n(built by `cargo test` or `cargo build --examples`)"
    return done.stdout.splitlines()


def types() -> dict[str, str]:
    """The name of each type in ROS, and its hash in kilted.

    `NAME:DISTRIBUTION` is what a type was or will be elsewhere; of those the wheels of kilted know nothing.
    """
    known = (line.split() for line in codec("--types"))
    return {name: hashed for name, _, hashed in known if ":" not in name}


OVERLONG = (
    "rcl_interfaces/srv/GetParameters_Response",
    "rcl_interfaces/srv/SetParameters_Request",
    "rcl_interfaces/srv/SetParametersAtomically_Request",
)
"""rclpy takes empty sequences of numbers of eight bytes for longer than they are, and leaves bytes at the end."""
WITH_NOTHING = (
    "nav2_msgs/action/ComputePathToPose_FeedbackMessage",
    "nav2_msgs/action/ComputePathThroughPoses_FeedbackMessage",
    "nav2_msgs/action/FollowPath_GetResult_Response",
    "lifecycle_msgs/srv/GetState_Request",
)
"""They have a message without fields in them, whose byte may have any value."""

need(CODEC)

TYPES = types()


def random_payloads(name: str, longest: int, count: int) -> list[tuple[Any, bytes]]:
    """Random messages of a type, and what rclpy makes of them."""
    rng = random.Random(f"{SEED} {name} {longest}")
    messages = [random_message(type_named(name), rng, longest) for _ in range(count)]
    return [(message, serialize_message(message)) for message in messages]


def recoded(name: str, payloads: list[bytes]) -> list[dict[str, Any]]:
    said = codec(lines="".join(f"{name} {payload.hex()}\n" for payload in payloads))
    assert len(said) == len(payloads)
    return [json.loads(line) for line in said]


def leaves(value: Any, path: str = "") -> list[tuple[str, Any]]:
    """Path and value of all that is no structure, of a message of rclpy or as the codec shows it.

    Of a path the last two names count: the codec shows the parts of an action without the message around them.
    """
    if hasattr(value, "get_fields_and_field_types"):
        value = {field: getattr(value, field) for field in value.get_fields_and_field_types()}
    if isinstance(value, dict):
        # The codec shows a UUID as its bytes.
        paths = {field: path if field == "uuid" else f"{path}.{field}" for field in sorted(value)}
        return [leaf for field, inner in paths.items() for leaf in leaves(value[field], inner)]
    if isinstance(value, np.generic):
        value = value.item()
    if not isinstance(value, str) and hasattr(value, "__iter__"):
        return [leaf for entry in value for leaf in leaves(entry, path)]
    if isinstance(value, float) and not math.isfinite(value):
        value = None
    if path.endswith(".structure_needs_at_least_one_member"):
        return []  # The byte of a message without fields, of which rclpy knows nothing.
    last = [name for name in path.split(".") if name not in ("feedback", "earlier")][-2:]
    return [(".".join(last), value)]


def same(one: Any, other: Any) -> bool:
    """Whether both have the same leaves."""
    return sorted(leaves(one), key=str) == sorted(leaves(other), key=str)


@pytest.mark.parametrize("name", [name for name in TYPES if name not in OVERLONG])
def test_what_rclpy_writes_is_read_and_written_again(name: str) -> None:
    for longest, count in ((5, VALUES), (4000, 3)):
        values = random_payloads(name, longest, count)
        for (message, payload), said in zip(values, recoded(name, [payload for _, payload in values]), strict=True):
            assert "error" not in said, f"seed {SEED}: {message}: {said['error']}"
            # The same bytes again would be no proof that each field is taken for what it is.
            assert same(said["value"], message), f"seed {SEED}: {message}"
            # Fast CDR leaves in the bytes between fields what was in memory before. All else is the same.
            assert said["hex"] == padded_with_zeros(payload, name).hex(), f"seed {SEED}: {message}"
            again = deserialize_message(bytes.fromhex(said["hex"]), type_named(name))
            assert str(again) == str(message), f"seed {SEED}"


@pytest.mark.parametrize("name", [name for name in TYPES if name not in OVERLONG])
def test_what_rosbags_writes_is_read_in_both_byte_orders(name: str) -> None:
    values = [STORE.deserialize_cdr(payload, in_rosbags(name)) for _, payload in random_payloads(name, 5, VALUES)]
    little, big = (
        [bytes(STORE.serialize_cdr(value, in_rosbags(name), little_endian=order)) for value in values]
        for order in (True, False)
    )
    for written in (little, big):
        for payload, said in zip(little, recoded(name, written), strict=True):
            assert said.get("hex") == payload.hex(), f"seed {SEED}: {said.get('error')}"


@pytest.mark.parametrize("name", [name for name in TYPES if name not in (*OVERLONG, *WITH_NOTHING)])
def test_what_the_codec_writes_is_read_by_both(name: str) -> None:
    for seed in range(SEED, SEED + VALUES):
        said = json.loads(codec("--random", name, str(seed))[0])
        payload = bytes.fromhex(said["hex"])
        message = deserialize_message(payload, type_named(name))
        assert same(message, said["value"]), f"seed {seed}"
        assert padded_with_zeros(serialize_message(message), name) == payload, f"seed {seed}"
        assert padded_with_zeros(payload, name) == payload, f"seed {seed}"


def padded_with_zeros(payload: bytes, name: str) -> bytes:
    """The same message with bytes of zero between the fields."""
    canonical = bytes(STORE.serialize_cdr(STORE.deserialize_cdr(payload, in_rosbags(name)), in_rosbags(name)))
    # After the last field DDS may fill up to a multiple of four.
    assert 0 <= len(payload) - len(canonical) < 4, name
    assert all(one in (0, other) for one, other in zip(canonical, payload, strict=False)), name
    return canonical


@pytest.mark.parametrize("name", [name for name in TYPES if name not in OVERLONG])
def test_broken_bytes_are_refused_and_never_end_the_codec(name: str) -> None:
    rng = random.Random(f"{SEED} broken {name}")
    for _, payload in random_payloads(name, 5, 10):
        short = [payload[:length] for length in sorted({rng.randrange(len(payload)) for _ in range(20)})]
        # Nothing that follows the last field may be missing; bytes of padding at the end are none.
        for cut, said in zip(short, recoded(name, short), strict=True):
            assert "error" in said or len(payload) - len(cut) < 8, f"seed {SEED}: {cut.hex()} of {payload.hex()}"
        flipped = []
        for _ in range(20):
            bytes_ = bytearray(payload)
            bytes_[rng.randrange(len(bytes_))] ^= 1 << rng.randrange(8)
            flipped.append(bytes(bytes_))
        recoded(name, flipped)


@pytest.mark.parametrize("name", TYPES)
def test_the_hash_is_that_of_ros_and_of_rosbags(name: str) -> None:
    service = name.removesuffix("_Request").removesuffix("_Response")
    assert hashes()[service] == TYPES[name]
    if "/msg/" in name:
        assert STORE.hash_rihs01(name) == TYPES[name]
