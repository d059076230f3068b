"""Sets up real ROS 2 for the tests beside this file, and starts a command in it.

`python3.11 tests/ros2/environment.py python -m pytest tests/ros2` sets up what is missing and runs the tests.

It needs no ROS installation. Into `target/ros2`, or what `--folder` names, go

- `venv`: rclpy on Fast DDS as wheels, the package curionav, pytest, and the tools that the next two need;
- `messages`: tf2_msgs, people_msgs and nav2_msgs, generated from `messages/` beside this file, since there are no
  wheels of them;
- `bridge`: a Zenoh router with Zenoh's own plugin for ROS 2 on DDS, built from `bridge/` beside this file.

What is there already and comes from the same files is kept. The first time takes minutes and needs the network.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
FOLDER = Path(os.environ.get("CURIONAV_ROS2", Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "ros2"))
PACKAGES = ("tf2_msgs", "people_msgs", "nav2_msgs")

CMAKE = """\
cmake_minimum_required(VERSION 3.20)
project({package} LANGUAGES C CXX)
set(CMAKE_CXX_STANDARD 17)
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
find_package(geometry_msgs REQUIRED)
find_package(nav_msgs REQUIRED)
rosidl_generate_interfaces({package} {interfaces} DEPENDENCIES geometry_msgs nav_msgs)
ament_package()
"""
MANIFEST = """\
<?xml version="1.0"?>
<package format="3">
  <name>{package}</name>
  <version>0.0.0</version>
  <description>For tests</description>
  <maintainer email="none@example.org">none</maintainer>
  <license>BSD-3-Clause</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  <depend>geometry_msgs</depend>
  <depend>nav_msgs</depend>
  <depend>action_msgs</depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
</package>
"""
# The bridge's DDS stumbles over Fast DDS's descriptions of types: now and then it takes no note of a publisher.
FAST_DDS = """\
<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns="http://www.eprosima.com">
  <profiles>
    <participant profile_name="no_types" is_default_profile="true">
      <rtps><propertiesPolicy><properties>
        <property><name>fastdds.type_propagation</name><value>disabled</value></property>
      </properties></propertiesPolicy></rtps>
    </participant>
  </profiles>
</dds>
"""


def python(folder: Path) -> Path:
    """The Python that has rclpy."""
    return folder / "venv" / "bin" / "python"


def variables(folder: Path) -> dict[str, str]:
    """The environment in which that Python finds everything, and in which ROS nodes speak to this machine alone."""
    site = next((folder / "venv" / "lib").glob("python3.*/site-packages"))
    generated = folder / "messages"
    libraries = [folder / "venv" / "lib", generated / "lib", *site.glob("ros_*.libs")]
    return {
        **os.environ,
        "PATH": f"{folder / 'venv' / 'bin'}:{os.environ['PATH']}",
        "AMENT_PREFIX_PATH": f"{generated}:{folder / 'venv'}",
        "CMAKE_PREFIX_PATH": f"{folder / 'venv'}",
        "PYTHONPATH": str(generated / "lib" / site.parent.name / "site-packages"),
        "LD_LIBRARY_PATH": ":".join(str(path) for path in libraries),
        "CURIONAV_ROS2": str(folder),
        "FASTDDS_DEFAULT_PROFILES_FILE": str(folder / "fastdds.xml"),
        # The wheels' own way to set LD_LIBRARY_PATH starts every Python a second time.
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        # Killed processes would leave their shared memory behind.
        "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
    }


def run(*command: object, **options: object) -> None:
    subprocess.run([str(part) for part in command], check=True, **options)  # type: ignore[call-overload]


def up_to_date(made: Path, *sources: Path) -> bool:
    """Whether `made` comes from `sources` as they are; if not, it is removed. `note` says what it comes from."""
    stamp = made.with_suffix(".made-of")
    if made.exists() and stamp.is_file() and stamp.read_text() == digest(*sources):
        return True
    stamp.unlink(missing_ok=True)
    shutil.rmtree(made, ignore_errors=True)
    return False


def note(made: Path, *sources: Path) -> None:
    made.with_suffix(".made-of").write_text(digest(*sources))


def digest(*sources: Path) -> str:
    files = sorted(file for source in sources for file in ([source] if source.is_file() else source.rglob("*")))
    hashed = hashlib.sha256(f"{sys.version} {ROOT}".encode())
    for file in files:
        if file.is_file():
            hashed.update(f"{file.relative_to(HERE)}\0".encode() + file.read_bytes() + b"\0")
    return hashed.hexdigest()


def install(folder: Path) -> None:
    """The virtual environment."""
    made, source = folder / "venv", HERE / "requirements.txt"
    if up_to_date(made, source):
        return
    print(f"installing rclpy into {made}", flush=True)
    venv.create(made, with_pip=True)
    pip = (python(folder), "-m", "pip", "install", "--quiet", "--disable-pip-version-check")
    run(*pip, "--requirement", source, "--editable", ROOT / "python")
    # The wheels say where NumPy was where they were built.
    site = next(made.glob("lib/python3.*/site-packages"))
    for file in (made / "share").rglob("*.cmake"):
        text = file.read_text()
        stale = text.find("/opt/python/")
        if stale >= 0:
            prefix = text[stale : text.index("/site-packages", stale) + len("/site-packages")]
            file.write_text(text.replace(prefix, str(site)))
    note(made, source)


def generate(folder: Path) -> None:
    """The messages that are not among the wheels."""
    made, source = folder / "messages", HERE / "messages"
    if up_to_date(made, source, HERE / "environment.py", HERE / "requirements.txt"):
        return
    made.mkdir()
    for package in PACKAGES:
        print(f"generating {package} into {made}", flush=True)
        build = folder / "messages-build" / package
        shutil.rmtree(build, ignore_errors=True)
        shutil.copytree(source / package, build)
        files = sorted(str(file.relative_to(build)) for file in build.rglob("*.*"))
        (build / "CMakeLists.txt").write_text(CMAKE.format(package=package, interfaces=" ".join(files)))
        (build / "package.xml").write_text(MANIFEST.format(package=package))
        options = ("-DCMAKE_BUILD_TYPE=Release", "-DBUILD_TESTING=OFF", f"-DCMAKE_INSTALL_PREFIX={made}")
        options += (f"-DPython3_EXECUTABLE={python(folder)}",)
        log = build / "log"
        try:
            with log.open("w") as output:
                for step in (
                    ("cmake", "-S", build, "-B", build / "build", *options),
                    ("cmake", "--build", build / "build", "--parallel", "2", "--target", "install"),
                ):
                    run(*step, env=variables(folder), stdout=output, stderr=subprocess.STDOUT)
        except subprocess.CalledProcessError:
            print(log.read_text()[-4000:], file=sys.stderr)
            raise
    note(made, source, HERE / "environment.py", HERE / "requirements.txt")


def build(folder: Path) -> None:
    """The bridge. Cargo knows itself what is up to date."""
    site = next(folder.glob("venv/lib/python3.*/site-packages"))
    include = subprocess.run(["gcc", "-print-file-name=include"], check=True, capture_output=True, text=True)
    environment = {
        **os.environ,
        "PATH": f"{folder / 'venv' / 'bin'}:{os.environ['PATH']}",
        "LIBCLANG_PATH": str(site / "clang" / "native"),
        # The wheel of libclang has no header files of its own.
        "BINDGEN_EXTRA_CLANG_ARGS": f"-I{include.stdout.strip()}",
    }
    manifest = HERE / "bridge" / "Cargo.toml"
    print(f"building the bridge in {folder / 'bridge'}", flush=True)
    run("cargo", "build", "--quiet", "--release", "--locked", "--manifest-path", manifest,
        "--target-dir", folder / "bridge", env=environment)  # fmt: skip


def main() -> None:
    arguments = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    arguments.add_argument("--folder", type=Path, default=FOLDER)
    arguments.add_argument("command", nargs=argparse.REMAINDER, help="what to start when everything is there")
    options = arguments.parse_args()
    folder = options.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "fastdds.xml").write_text(FAST_DDS)
    install(folder)
    generate(folder)
    build(folder)
    if options.command:
        os.execvpe(options.command[0], options.command, variables(folder))


if __name__ == "__main__":
    main()
