"""A node as `rmw_zenoh_cpp` has it, on a plain Zenoh session: its own keys, tokens and attachments."""

from __future__ import annotations

import hashlib
import itertools
import json
import os
import struct
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, Self

import zenoh
import zenoh.ext
from rclpy.serialization import deserialize_message, serialize_message

VOLATILE, LATCHED = "::,10:,:,:,,", ":1:,1:,:,:,,"


@cache
def hashes() -> dict[str, str]:
    """The hash of each type that the wheels and the generated packages name."""
    found = {}
    for prefix in os.environ["AMENT_PREFIX_PATH"].split(":"):
        for file in Path(prefix, "share").glob("*/*/*.json"):
            for entry in json.loads(file.read_text()).get("type_hashes", []):
                found[entry["type_name"]] = entry["hash_string"]
    return found


def name_of(of: type) -> str:
    """`sensor_msgs/msg/LaserScan` of the class."""
    package, kind = of.__module__.split(".")[:2]
    return f"{package}/{kind}/{of.__name__}"


def interface(name: str) -> str:
    """DDS name and hash of a type, or of the service that a request belongs to, as they stand in keys."""
    package, kind, message = name.removesuffix("_Request").removesuffix("_Response").split("/")
    return f"{package}::{kind}::dds_::{message}_/{hashes()[f'{package}/{kind}/{message}']}"


def open_session(endpoint: str) -> Any:
    config = zenoh.Config()
    for key, value in {
        "mode": "client",
        "connect/endpoints": [endpoint],
        "scouting/multicast/enabled": False,
        "timestamping/enabled": True,
    }.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def attachment(number: int, gid: bytes) -> bytes:
    return struct.pack("<qqB", number, time.time_ns(), 16) + gid


class RmwNode:
    """A node in a namespace, with a session of its own at the robot's router."""

    def __init__(self, endpoint: str, name: str, namespace: str, domain: int = 0) -> None:
        self.session, self.domain = open_session(endpoint), domain
        self.place = f"%/{namespace.replace('/', '%')}/{name}"
        self.entities = itertools.count(1)
        self.zid = str(self.session.info.zid())
        self.kept = [self._token(f"0/0/NN/{self.place}")]

    def _token(self, rest: str) -> Any:
        return self.session.liveliness().declare_token(f"@ros2_lv/{self.domain}/{self.zid}/{rest}")

    def _declare(self, kind: str, topic: str, name: str, qos: str) -> bytes:
        """Declares the token of an entity; gives its gid."""
        rest = f"0/{next(self.entities)}/{kind}/{self.place}/{topic.replace('/', '%')}/{interface(name)}/{qos}"
        self.kept.append(self._token(rest))
        return hashlib.md5(rest.encode()).digest()

    def key(self, topic: str, name: str) -> str:
        return f"{self.domain}/{topic.strip('/')}/{interface(name)}"

    def publisher(self, topic: str, of: type, latched: bool = False) -> Callable[[Any], None]:
        name = name_of(of)
        gid = self._declare("MP", topic, name, LATCHED if latched else VOLATILE)
        if latched:
            publisher = zenoh.ext.declare_advanced_publisher(
                self.session, self.key(topic, name), cache=zenoh.ext.CacheConfig(max_samples=1),
                publisher_detection=True,
                sample_miss_detection=zenoh.ext.MissDetectionConfig(sporadic_heartbeat=0.5),
            )  # fmt: skip
        else:
            publisher = self.session.declare_publisher(self.key(topic, name))
        self.kept.append(publisher)
        numbers = itertools.count(1)
        return lambda message: publisher.put(serialize_message(message), attachment=attachment(next(numbers), gid))

    def subscribe(self, topic: str, of: type, heard: Callable[[Any], None], latched: bool = False) -> None:
        """`heard` gets each message. One that is malformed would end a real node; here it raises in Zenoh's thread."""
        self.subscribe_raw(topic, name_of(of), lambda s: heard(deserialize_message(bytes(s.payload), of)), latched)

    def subscribe_raw(self, topic: str, name: str, heard: Callable[[Any], None], latched: bool = False) -> None:
        self._declare("MS", topic, name, LATCHED if latched else VOLATILE)
        key = self.key(topic, name)
        if latched:
            history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1)
            recovery = zenoh.ext.RecoveryConfig(heartbeat=True)
            self.kept.append(
                zenoh.ext.declare_advanced_subscriber(
                    self.session, key, heard, history=history, recovery=recovery, subscriber_detection=True
                )
            )
        else:
            self.kept.append(self.session.declare_subscriber(key, heard))

    def call(self, service: str, request: Any, response: type, patience: float) -> Any:
        """The reply of a service, or nothing."""
        name = name_of(type(request))
        replies = self.session.get(
            self.key(service, name), payload=serialize_message(request), attachment=attachment(1, bytes(16)),
            target=zenoh.QueryTarget.ALL_COMPLETE, timeout=patience,
        )  # fmt: skip
        for reply in replies:
            if reply.ok is not None:
                return deserialize_message(bytes(reply.ok.payload), response)
        return None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.session.close()
