"""What a recording shows to Foxglove, read with its own packages: schemas, what fields mean, frames and times."""

from __future__ import annotations

import dataclasses
import math
import os
import signal
import subprocess
import time
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contract import ROOT
from live import program

pytest.importorskip("mcap", reason="no mcap; pip install './python[viewer-test]'")
protobuf = pytest.importorskip("mcap_protobuf.decoder", reason="pip install './python[viewer-test]'")
pytest.importorskip("foxglove_schemas_protobuf", reason="pip install './python[viewer-test]'")

import importlib  # noqa: E402

from google.protobuf.descriptor import Descriptor  # noqa: E402
from google.protobuf.descriptor_pb2 import FileDescriptorSet  # noqa: E402
from google.protobuf.unknown_fields import UnknownFieldSet  # noqa: E402
from mcap.reader import make_reader  # noqa: E402

from curionav.messages import MESSAGES, Message  # noqa: E402

pytestmark = pytest.mark.live

ROBOT = "robot"
SCHEMAS = {
    "/map": "Grid",
    "/tf": "FrameTransform",
    f"/{ROBOT}/scan": "LaserScan",
    f"/{ROBOT}/belief": "PoseInFrame",
    f"/{ROBOT}/belief/ellipse": "SceneUpdate",
    f"/{ROBOT}/particles": "PosesInFrame",
    f"/{ROBOT}/people": "SceneUpdate",
    f"/{ROBOT}/candidates": "SceneUpdate",
    f"/{ROBOT}/path": "PosesInFrame",
    f"/{ROBOT}/goal": "SceneUpdate",
    f"/{ROBOT}/log": "Log",
}
"""As `docs/recording.md` lists them."""
SECOND = 1_000_000_000


def official(schema: str) -> Any:
    """The class of a schema that Foxglove publishes."""
    return getattr(importlib.import_module(f"foxglove_schemas_protobuf.{schema}_pb2"), schema)


@dataclasses.dataclass
class Recording:
    """What a file holds: pictures as Foxglove's own classes, messages as ours, both with their times (ns) by topic."""

    pictures: dict[str, list[tuple[int, Any]]]
    messages: dict[str, list[tuple[int, Message]]]
    raw: dict[str, list[bytes]]
    schemas: dict[str, Any]

    def said(self, stream: str) -> list[tuple[int, Any]]:
        return self.messages[f"curionav/@v1/robot/{ROBOT}/{stream}"]

    def both(self, topic: str, stream: str) -> list[tuple[Any, Any]]:
        """(picture, message) of the same time."""
        drawn, said = dict(self.pictures[topic]), dict(self.said(stream))
        assert drawn.keys() == said.keys(), topic
        return [(drawn[time], said[time]) for time in sorted(said)]


def read(path: Path) -> Recording:
    found = Recording(defaultdict(list), defaultdict(list), defaultdict(list), {})
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            assert schema is not None
            assert message.log_time == message.publish_time
            if channel.message_encoding == "cbor":
                kind = MESSAGES[schema.name.removeprefix("curionav.").removesuffix(".v1")]
                found.messages[channel.topic].append((message.log_time, kind.decode(message.data)))
            else:
                picture = official(schema.name.removeprefix("foxglove.")).FromString(message.data)
                found.pictures[channel.topic].append((message.log_time, picture))
                found.raw[channel.topic].append(message.data)
                found.schemas[channel.topic] = schema
    return found


def record(file: Path, *more: str) -> list[str]:
    """The command that records a run of half a minute."""
    return [str(program()), "run", str(ROOT / "scenarios" / "quickstart.toml"), "--seed", "1000",
            "--record", str(file), *more]  # fmt: skip


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    file = tmp_path_factory.mktemp("foxglove") / "run.mcap"
    done = subprocess.run(record(file), capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return read(file)


# ---- the format ----


def fields(message: Descriptor, seen: dict[str, Any] | None = None) -> dict[str, Any]:
    """Number, type and repetition of every field, by message, for all messages below one."""
    seen = {} if seen is None else seen
    if message.full_name not in seen:
        seen[message.full_name] = {f.name: (f.number, f.type, f.is_repeated) for f in message.fields}
        for field in message.fields:
            if field.message_type is not None:
                fields(field.message_type, seen)
    return seen


def embedded(data: bytes) -> dict[str, Any]:
    """The same of a schema as it stands in a file."""
    label_repeated = 3
    found: dict[str, Any] = {}
    for file in FileDescriptorSet.FromString(data).file:
        prefix = f"{file.package}." if file.package else ""
        waiting = [(f"{prefix}{message.name}", message) for message in file.message_type]
        while waiting:
            name, message = waiting.pop()
            found[name] = {f.name: (f.number, f.type, f.label == label_repeated) for f in message.field}
            waiting += [(f"{name}.{inner.name}", inner) for inner in message.nested_type]
    return found


def test_every_topic_has_the_schema_that_the_documentation_names(recording: Recording) -> None:
    assert {topic: schema.name for topic, schema in recording.schemas.items()} == {
        topic: f"foxglove.{schema}" for topic, schema in SCHEMAS.items()
    }
    table = (ROOT / "docs" / "recording.md").read_text()
    for topic, schema in SCHEMAS.items():
        named = topic.replace(f"/{ROBOT}/", "/{robot}/")
        assert f"| `{named}` | `foxglove.{schema}` |" in table, topic


def test_the_schemas_in_the_file_are_foxgloves(recording: Recording) -> None:
    for topic, schema in recording.schemas.items():
        assert schema.encoding == "protobuf"
        ours, theirs = embedded(schema.data), fields(official(SCHEMAS[topic]).DESCRIPTOR)
        for name, members in theirs.items():
            assert name in ours, f"{topic}: {name}"
            # An older version of a schema may lack a field of a newer one; none may mean something else.
            assert ours[name].items() <= members.items(), f"{topic}: {name}"


def test_no_message_has_a_field_that_its_schema_does_not_know(recording: Recording) -> None:
    def known(message: Any) -> bool:
        below = [
            inner
            for field, value in message.ListFields()
            if field.message_type is not None
            for inner in (value if field.is_repeated else [value])
        ]
        return len(UnknownFieldSet(message)) == 0 and all(map(known, below))

    assert sum(map(len, recording.pictures.values())) > 500
    for topic, drawn in recording.pictures.items():
        assert all(known(picture) for _, picture in drawn[:50]), topic


def test_a_reader_without_foxgloves_classes_reads_the_same(recording: Recording, tmp_path: Path) -> None:
    decoders = protobuf.DecoderFactory()
    for topic, messages in recording.raw.items():
        decode = decoders.decoder_for("protobuf", recording.schemas[topic])
        for data, (_, picture) in list(zip(messages, recording.pictures[topic], strict=True))[:20]:
            assert decode(data).SerializeToString(deterministic=True) == picture.SerializeToString(deterministic=True)


# ---- times and frames ----


def stamps(picture: Any) -> list[int]:
    """Times a picture states, nanoseconds."""
    parts = picture.entities if hasattr(picture, "entities") else [picture]
    return [part.timestamp.seconds * SECOND + part.timestamp.nanos for part in parts]


def test_pictures_state_the_time_they_are_filed_under(recording: Recording) -> None:
    for topic, drawn in recording.pictures.items():
        for log_time, picture in drawn:
            assert stamps(picture) == [log_time], topic
    # The robot's clock: as far apart as its stamps are.
    scans = recording.said("scan")
    (start, first), (end, last) = scans[0], scans[-1]
    assert (end - start) / SECOND == pytest.approx(last.stamp - first.stamp, abs=1e-6)
    assert abs(time.time() - start / SECOND) < 3600.0


def test_all_frames_hang_together(recording: Recording) -> None:
    transforms = recording.pictures["/tf"]
    assert {(t.parent_frame_id, t.child_frame_id) for _, t in transforms} == {("map", ROBOT)}
    for topic, drawn in recording.pictures.items():
        if topic in ("/tf", f"/{ROBOT}/log"):
            continue
        wanted = ROBOT if topic == f"/{ROBOT}/scan" else "map"
        for _, picture in drawn:
            parts = picture.entities if hasattr(picture, "entities") else [picture]
            assert {part.frame_id for part in parts} == {wanted}, topic
    # A scan has a transform of its very time, not one to be guessed from others.
    assert {t for t, _ in recording.pictures[f"/{ROBOT}/scan"]} <= {t for t, _ in transforms}


def heading(rotation: Any) -> float:
    """Of a turn about the vertical, rad."""
    assert rotation.x == rotation.y == 0.0
    assert math.hypot(rotation.z, rotation.w) == pytest.approx(1.0)
    return 2.0 * math.atan2(rotation.z, rotation.w)


def same_pose(position: Any, rotation: Any, pose: Any) -> None:
    assert (position.x, position.y, position.z) == pytest.approx((pose.x, pose.y, 0.0), abs=1e-6)
    assert math.remainder(heading(rotation) - pose.heading, math.tau) == pytest.approx(0.0, abs=1e-6)


def placed(x: Any, y: Any, translation: Any, rotation: Any) -> Any:
    """Points of a frame in the one it stands in, shape [points, 2]."""
    c, s = math.cos(heading(rotation)), math.sin(heading(rotation))
    return np.stack([c * x - s * y + translation.x, s * x + c * y + translation.y], axis=1)


# ---- what the fields mean ----


def test_transform_and_pose_are_the_belief(recording: Recording) -> None:
    for drawn, belief in recording.both("/tf", "belief"):
        same_pose(drawn.translation, drawn.rotation, belief)
    for drawn, belief in recording.both(f"/{ROBOT}/belief", "belief"):
        same_pose(drawn.pose.position, drawn.pose.orientation, belief)


def test_the_ellipse_is_as_wide_as_the_covariance_says(recording: Recording) -> None:
    for drawn, belief in recording.both(f"/{ROBOT}/belief/ellipse", "belief"):
        (entity,) = drawn.entities
        (disc,) = entity.cylinders
        variances, axes = np.linalg.eigh(np.asarray(belief.covariance)[:2, :2])
        # Diameters; chi-square of two degrees of freedom, 95 %: 5.991.
        assert (disc.size.y, disc.size.x) == pytest.approx(2.0 * np.sqrt(5.991 * np.maximum(variances, 0.0)), rel=1e-3)
        along = heading(disc.pose.orientation)
        if variances[1] > 1.05 * variances[0]:
            assert abs(axes[:, 1] @ (math.cos(along), math.sin(along))) == pytest.approx(1.0, abs=1e-3)


def test_particles_and_path_are_poses(recording: Recording) -> None:
    for topic, stream in (("particles", "particles"), ("path", "decision")):
        for drawn, message in recording.both(f"/{ROBOT}/{topic}", stream):
            assert len(drawn.poses) == len(message.x)
            x, y = (np.array([getattr(p.position, axis) for p in drawn.poses]) for axis in "xy")
            assert x == pytest.approx(np.asarray(message.x), abs=1e-6)
            assert y == pytest.approx(np.asarray(message.y), abs=1e-6)
            turned = np.array([heading(p.orientation) for p in drawn.poses]) - message.heading
            assert np.abs(np.remainder(turned + math.pi, math.tau) - math.pi).max(initial=0.0) < 1e-5


def test_the_grid_is_the_map(recording: Recording) -> None:
    ((_, drawn),) = recording.pictures["/map"]
    (messages,) = [m for topic, m in recording.messages.items() if topic.startswith("curionav/@v1/map/")]
    grid: Any = messages[0][1]
    (field,) = drawn.fields
    numeric = importlib.import_module("foxglove_schemas_protobuf.PackedElementField_pb2").PackedElementField
    assert (field.name, field.offset, field.type) == ("occupancy", 0, numeric.UINT8)
    # Columns, strides and rows as Foxglove's documentation has them: row-major, the first cell at the pose.
    assert (drawn.column_count, drawn.cell_stride, drawn.row_stride) == (grid.width, 1, grid.width)
    cells = np.frombuffer(drawn.data, np.uint8).reshape(grid.height, grid.width)
    assert (cells == np.where(grid.cells < 0, 255, grid.cells.astype(np.int16))).all()
    assert (drawn.cell_size.x, drawn.cell_size.y) == (grid.resolution, grid.resolution)
    same_pose(drawn.pose.position, drawn.pose.orientation, grid.origin)


def test_the_scan_put_on_the_map_by_its_transform_meets_the_walls(recording: Recording) -> None:
    ((_, grid),) = recording.pictures["/map"]
    cells = np.frombuffer(grid.data, np.uint8).reshape(-1, grid.column_count)
    rows, columns = np.nonzero(cells == 100)
    x, y = np.stack([columns + 0.5, rows + 0.5]) * grid.cell_size.x
    walls = placed(x, y, grid.pose.position, grid.pose.orientation)
    transforms = dict(recording.pictures["/tf"])
    met, missed, nothing = 0, 0, 0
    for log_time, scan in recording.pictures[f"/{ROBOT}/scan"][20::20]:
        robot = transforms[log_time]
        ranges = np.array(scan.ranges)
        hit = np.isfinite(ranges)
        nothing += int((~hit).sum())
        # Evenly from the first angle to the last, as Foxglove spreads them.
        angles = np.linspace(scan.start_angle, scan.end_angle, len(ranges))[hit] + heading(scan.pose.orientation)
        x = scan.pose.position.x + ranges[hit] * np.cos(angles)
        y = scan.pose.position.y + ranges[hit] * np.sin(angles)
        points = placed(x, y, robot.translation, robot.rotation)
        away = np.linalg.norm(points[:, None] - walls[None], axis=2).min(axis=1)
        met, missed = met + int((away < 0.3).sum()), missed + int((away >= 0.3).sum())
    # The rest has met the walker, or is a little off where the belief is.
    assert met > 10 * missed
    # What hit nothing is drawn nowhere.
    assert nothing > 0


def test_people_and_candidates_are_where_they_were(recording: Recording) -> None:
    for drawn, report in recording.both(f"/{ROBOT}/people", "report"):
        (entity,) = drawn.entities
        people = report.scene.people
        assert [c.pose.position.x for c in entity.cylinders] == pytest.approx(list(people.x))
        # Their middle is half their height above the ground.
        assert {(c.pose.position.z, c.size.z) for c in entity.cylinders} <= {(0.85, 1.7)}
        speeds = np.hypot(people.vx, people.vy)
        assert len(entity.arrows) == int((speeds > 0.05).sum())
    for drawn, report in recording.both(f"/{ROBOT}/candidates", "report"):
        (entity,) = drawn.entities
        assert len(entity.lines) == report.candidates.count
        assert {line.type for line in entity.lines} == {0}, "LINE_STRIP"
        assert [p.x for p in entity.lines[0].points] == pytest.approx(list(report.candidates.x[0]))
        widest = max(range(len(entity.lines)), key=lambda i: entity.lines[i].thickness)
        assert report.chosen is None or widest == report.chosen
        assert not entity.lifetime.seconds
        assert not entity.lifetime.nanos


def test_the_log_has_foxgloves_levels(recording: Recording) -> None:
    logs = [line for _, line in recording.pictures[f"/{ROBOT}/log"]]
    level = importlib.import_module("foxglove_schemas_protobuf.Log_pb2").Log
    assert {line.level for line in logs} <= {level.INFO, level.WARNING}
    assert {line.name for line in logs} == {ROBOT}
    assert any("mission 1 is running" in line.message for line in logs)


# ---- a recording that was killed ----


def test_a_killed_recording_reads_the_same_once_it_is_recovered(tmp_path: Path) -> None:
    killed, whole = tmp_path / "killed.mcap", tmp_path / "whole.mcap"
    process = subprocess.Popen(
        record(killed, "--speed", "realtime"),
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip
    try:
        deadline = time.monotonic() + 60.0
        while not killed.exists() or killed.stat().st_size < 1_000_000:
            assert process.poll() is None, "the run ended before it could be killed"
            assert time.monotonic() < deadline, "nothing is written"
            time.sleep(0.05)
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    recover = [str(program()), "record", str(whole), "--recover", str(killed)]
    done = subprocess.run(recover, capture_output=True, text=True, timeout=60, check=False)
    # The end is missing at least.
    assert done.returncode == 1, done.stderr
    found = read(whole)
    assert {"/map", "/tf", f"/{ROBOT}/scan", f"/{ROBOT}/path"} <= found.schemas.keys()
    for topic, drawn in found.pictures.items():
        assert all(stamps(picture) == [log_time] for log_time, picture in drawn), topic
    test_transform_and_pose_are_the_belief(found)
