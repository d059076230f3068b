"""Endpoints and namespaces as people write them, checked before Zenoh sees them.

The rules and words are those of the program (``crates/runtime/src/endpoint.rs``); one table of examples, in
``tests/data/endpoints.toml``, holds both to them.
"""

from __future__ import annotations

import ipaddress
import re

from .errors import ConnectionFailed

_LINKS = ("tcp", "tls", "unixsock-stream")
_HOST = "127.0.0.1"
_PORT = "7447"
_SOCKET = "unixsock-stream//run/curionav/robot.sock"
_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]*", re.ASCII)
_PROTOCOL = re.compile(r"[A-Za-z_-]+", re.ASCII)


class _Wrong(Exception):  # noqa: N818 - never leaves this module
    """What is wrong with an endpoint, and the right form."""

    def __init__(self, problem: str, right: str) -> None:
        super().__init__(problem)
        self.problem = problem
        self.right = right


def check_endpoint(endpoint: str) -> None:
    """Refuses what is no ``tcp/HOST:PORT``, ``tls/HOST:PORT`` or ``unixsock-stream/PATH``.

    Raises:
        ConnectionFailed: With what is wrong and the right form.
    """
    try:
        _parse(re.split(r"[?#]", endpoint, maxsplit=1)[0])
    except _Wrong as wrong:
        raise ConnectionFailed(f"`{endpoint}` is no endpoint: {wrong.problem}; give {wrong.right}") from None


def _parse(text: str) -> None:
    if not text:
        raise _Wrong("it is empty", _right_form("tcp", ""))
    plain = "".join(c for c in text if not c.isspace() and c.isprintable())
    if plain != text:
        raise _Wrong("it has blanks", plain)
    scheme, is_url, rest = text.partition("://")
    if is_url:
        raise _Wrong("it is a URL", _right_form(scheme, rest))
    protocol, has_protocol, address = text.partition("/")
    if not has_protocol or not _PROTOCOL.fullmatch(protocol):
        raise _Wrong("it names no protocol", _right_form("tcp", text))
    if protocol not in _LINKS:
        problem = f"`{protocol}` is none of the protocols {_LINKS[0]}, {_LINKS[1]} and {_LINKS[2]}"
        raise _Wrong(problem, _right_form(protocol.lower(), address))
    if protocol == "unixsock-stream":
        if not address:
            raise _Wrong("it has no path", _SOCKET)
        return
    fault = _problem_of(address)
    if fault is not None:
        raise _Wrong(fault, _right_form(protocol, address))


def _problem_of(address: str) -> str | None:
    host, port = _split(address)
    if not host:
        return "it has no host"
    if ":" in host and not host.startswith("["):
        return "an IPv6 address stands in brackets"
    if not _is_host(host):
        return f"`{host}` is no host name and no address"
    if not port:
        return "it has no port"
    if not _is_port(port):
        return f"its port `{port}` is no number from 1 to 65535"
    return None


def _split(address: str) -> tuple[str, str | None]:
    """Host and port, either of which may be wrong."""
    if address.startswith("[") and "]" in address:
        host, _, rest = address.partition("]")
        return f"{host}]", rest[1:] if rest.startswith(":") else None
    if _is_ipv6(address):
        host, _, port = address.rpartition(":")
        return (host, port) if _is_ipv6(host) else (address, None)
    if address.startswith("::"):
        return address, None
    host, has_port, port = address.partition(":")
    return host, port if has_port else None


def _is_ipv6(text: str) -> bool:
    try:
        ipaddress.IPv6Address(text)
    except ValueError:
        return False
    return True


def _is_host(host: str) -> bool:
    if host.startswith("["):
        return host.endswith("]") and _is_ipv6(host[1:-1])
    if re.fullmatch(r"[0-9.]*", host, re.ASCII):
        try:
            ipaddress.IPv4Address(host)
        except ValueError:
            return False
        return True
    return _NAME.fullmatch(host) is not None


def _is_port(port: str) -> bool:
    return re.fullmatch(r"0*[0-9]{1,5}", port, re.ASCII) is not None and 0 < int(port) < 1 << 16


def _right_form(protocol: str, address: str) -> str:
    """What was probably meant, with a host and a port where they are missing or wrong."""
    protocol = protocol if protocol in _LINKS else "tcp"
    host, port = _split(address.rstrip("/"))
    if not _is_host(host):
        host = f"[{host}]" if _is_ipv6(host) else _HOST
    return f"{protocol}/{host}:{port if port and _is_port(port) else _PORT}"


def check_namespace(namespace: str) -> None:
    """Refuses what cannot be the prefix of keys.

    Raises:
        ConnectionFailed: With what is wrong and the right form.
    """
    names = ("".join(c for c in name if c.isprintable() and c not in " *$?#") for name in namespace.split("/"))
    right = "/".join(name for name in names if name)
    if right == namespace and right:
        return
    problem = "it is made of names, without blanks and *, $, ? and #, and with one slash between two"
    mend = f"give {right}" if right else "leave it out"
    raise ConnectionFailed(f"`{namespace}` is no namespace: {problem}; {mend}")
