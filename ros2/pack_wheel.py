"""Packs the install tree of one ROS 2 interface package as a pip wheel, laid out like ``ros-*``.

The Python package goes to site-packages, ``lib*.so`` to the environment's ``lib`` (which
``ros-wheels-bootstrapper`` puts on the loader's path), ``share`` to its ``share``.

    usage: pack_wheel.py INSTALL_PREFIX FOLDER kilted|jazzy
"""

from __future__ import annotations

import base64
import hashlib
import re
import sys
import sysconfig
import zipfile
from dataclasses import dataclass
from pathlib import Path

RUNTIME = {
    "kilted": (
        "ros-rosidl-default-runtime~=1.7.1",
        "ros-service-msgs~=2.3.0",
        "ros-rosidl-typesupport-fastrtps-c~=3.8.1",
    ),
    "jazzy": (
        "ros-rosidl-default-runtime~=1.6.0",
        "ros-service-msgs~=2.0.3",
        "ros-rosidl-typesupport-fastrtps-c~=3.6.2",
    ),
}
"""What generated code needs when it runs: it fits one distribution only."""
BOOTSTRAPPER = "ros-wheels-bootstrapper>=0.1.2"
STAMP = (2020, 1, 1, 0, 0, 0)
"""Time of every file in the wheel, so that the same tree always gives the same wheel."""


@dataclass(frozen=True)
class Package:
    """What ``package.xml`` says: its name, version and the packages that it depends on."""

    name: str
    version: str
    depends: tuple[str, ...]


def main(prefix: Path, folder: Path, distribution: str) -> Path:
    """Write the wheel of the package installed under ``prefix`` into ``folder``."""
    site = next(prefix.glob("lib/python3*/site-packages"))
    name = next(p.name for p in site.iterdir() if p.is_dir() and p.suffix != ".egg-info")
    package = read_package(prefix / "share" / name / "package.xml")
    tag = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    full_tag = f"{tag}-{tag}-{platform}"
    files = {**contents(prefix, site, package), **metadata(package, full_tag, distribution)}
    wheel = folder / f"{package.name}-{package.version}-{full_tag}.whl"
    write(wheel, files, f"{package.name}-{package.version}.dist-info/RECORD")
    return wheel


def read_package(file: Path) -> Package:
    """Read ``package.xml``."""
    text = file.read_text(encoding="utf-8")
    name, version = (re.findall(rf"<{tag}>(.*?)</{tag}>", text)[0] for tag in ("name", "version"))
    return Package(name, version, tuple(re.findall(r"<depend>(.*?)</depend>", text)))


def contents(prefix: Path, site: Path, package: Package) -> dict[str, bytes]:
    """The package's own files, by their place in the wheel."""
    data = f"{package.name}-{package.version}.data/data"
    files = {
        str(file.relative_to(site)): file.read_bytes()
        for file in (site / package.name).rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }
    files |= {f"{data}/lib/{lib.name}": lib.read_bytes() for lib in prefix.glob("lib/lib*.so")}
    share = prefix / "share"
    for file in share.rglob("*"):
        if file.is_file() and _is_shared(file):
            files[f"{data}/share/{file.relative_to(share)}"] = file.read_bytes()
    return files


def _is_shared(file: Path) -> bool:
    interfaces = {"srv", "msg", "action", "rosidl_interfaces"} & set(file.parts)
    return bool(interfaces) or file.name == "package.xml" or file.parent.name == "packages"


def metadata(package: Package, tag: str, distribution: str) -> dict[str, bytes]:
    """METADATA and WHEEL."""
    folder = f"{package.name}-{package.version}.dist-info"
    needs = [
        *RUNTIME[distribution],
        BOOTSTRAPPER,
        *(f"ros-{name.replace('_', '-')}" for name in package.depends),
    ]
    lines = [
        "Metadata-Version: 2.1",
        f"Name: {package.name.replace('_', '-')}",
        f"Version: {package.version}",
        f"Requires-Python: =={sys.version_info.major}.{sys.version_info.minor}.*",
        *(f"Requires-Dist: {need}" for need in needs),
    ]
    wheel = ("Wheel-Version: 1.0", "Generator: go2-wbc", "Root-Is-Purelib: false", f"Tag: {tag}")
    return {
        f"{folder}/METADATA": "\n".join([*lines, ""]).encode(),
        f"{folder}/WHEEL": "\n".join([*wheel, ""]).encode(),
    }


def write(wheel: Path, files: dict[str, bytes], record: str) -> None:
    """Write ``files`` and the record of their digests."""
    rows = [f"{name},{_digest(data)},{len(data)}\n" for name, data in sorted(files.items())]
    files = {**files, record: "".join([*rows, f"{record},,\n"]).encode()}
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in sorted(files.items()):
            archive.writestr(zipfile.ZipInfo(name, STAMP), data, zipfile.ZIP_DEFLATED)


def _digest(data: bytes) -> str:
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=")
    return f"sha256={digest.decode()}"


if __name__ == "__main__":
    print(main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]))
