"""Links over TLS, with the certificates of a folder that ``curionav secure`` or ``curionav up --secure`` has made."""

from __future__ import annotations

import json
import os
import socket
import ssl
from dataclasses import dataclass
from pathlib import Path

from .errors import ConnectionFailed

DEFAULT_ENDPOINT = "tls/127.0.0.1:7447"
"""Where ``curionav up --secure`` listens unless told otherwise."""

_GREETING = 0.5
"""How long a router may take to object, s. One that is content says nothing."""


@dataclass(frozen=True)
class Identity:
    """A certificate of a folder, with its key and the authority's certificate."""

    folder: Path
    name: str

    @classmethod
    def of(cls, folder: str | os.PathLike[str], name: str) -> Identity:
        """The certificate ``name`` of ``folder``.

        Raises:
            ConnectionFailed: A file is missing.
        """
        identity = cls(Path(folder), name)
        for file in (identity.authority, identity.certificate, identity.key):
            if not file.is_file():
                mend = f"where the authority's key is: curionav secure issue {identity.folder} {name}"
                raise ConnectionFailed(f"{file}: is missing; {mend}")
        return identity

    @property
    def authority(self) -> Path:
        """The authority's certificate."""
        return self.folder / "ca.pem"

    @property
    def certificate(self) -> Path:
        """Its own certificate."""
        return self.folder / f"{self.name}.pem"

    @property
    def key(self) -> Path:
        """Its key: the one that systemd has handed to the unit (``LoadCredential=``), or else that in the folder."""
        file = f"{self.name}.key"
        handed = Path(os.environ.get("CREDENTIALS_DIRECTORY", self.folder)) / file
        return handed if handed.is_file() else self.folder / file

    def settings(self) -> dict[str, str]:
        """Zenoh's settings, as JSON by path: links over TLS alone, with certificates of both sides."""
        tls = {
            "root_ca_certificate": str(self.authority),
            "connect_certificate": str(self.certificate),
            "connect_private_key": str(self.key),
            "enable_mtls": True,
            "verify_name_on_connect": True,
            "close_link_on_expiration": True,
        }
        return {
            "transport/link/protocols": '["tls"]',
            "transport/link/tls": json.dumps(tls),
            "transport/shared_memory/enabled": "false",
        }

    def distrust(self, endpoint: str) -> str | None:
        """Why the router at ``endpoint`` and this certificate do not go together, if it is there and they do not.

        Zenoh itself only logs it.
        """
        host, _, port = endpoint.removeprefix("tls/").rpartition(":")
        host = host.strip("[]")
        try:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
            context.minimum_version = ssl.TLSVersion.TLSv1_3
            context.load_verify_locations(self.authority)
            context.load_cert_chain(self.certificate, self.key)
            with (
                socket.create_connection((host, int(port)), _GREETING) as plain,
                context.wrap_socket(plain, server_hostname=host) as link,
            ):
                link.recv(1)
        except ssl.SSLCertVerificationError as error:
            return f"the router's certificate is not trusted by {self.authority}: {error.verify_message}"
        except ssl.SSLError as error:
            return f"the certificate `{self.name}` is not accepted: {error.reason or error}"
        except (OSError, ValueError):
            return None
        return None


def check_endpoint(endpoint: str) -> None:
    """Refuses an endpoint that is not over TLS.

    Raises:
        ConnectionFailed: It is not.
    """
    if not endpoint.startswith("tls/"):
        raise ConnectionFailed(f"{endpoint}: with `secure`, links go over tls alone; write tls/HOST:PORT")
