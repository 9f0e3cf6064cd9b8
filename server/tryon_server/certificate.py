"""A certificate for development: browsers give AR, and sensors at all, to pages of https only.

An authority of this installation signs it. Who installs the authority's certificate on a headset or telephone is not
warned any more; it is made once and kept, while the server's own certificate is made anew at each start.
"""

from __future__ import annotations

import contextlib
import datetime
import os
import socket
from dataclasses import dataclass
from pathlib import Path

import trustme

from tryon_server.problems import problem_error

VALID_DAYS = 397  # of the server's certificate: browsers trust none that is valid for longer than 398
ORGANISATION = "tryon development"
LOCAL = ("localhost", "127.0.0.1", "::1")
ELSEWHERE = ("192.0.2.1", 9)  # an address that is nobody's (RFC 5737): asking for the way to it sends nothing


@dataclass(frozen=True)
class Certificate:
    """Files, in PEM.

    Attributes:
        authority: certificate of the authority, to be installed where the server shall be trusted.
        chain: the server's certificate.
        key: its private key.
    """

    authority: Path
    chain: Path
    key: Path


def development_certificate(folder: Path, names: tuple[str, ...], now: datetime.datetime) -> Certificate:
    """A certificate for these host names and addresses, signed by the authority that is kept in ``folder``.

    Raises:
        ProblemError: the folder can't be written, or what lies there is no authority.
    """
    made = Certificate(folder / "authority.pem", folder / "server.pem", folder / "server.key")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        authority = _authority(made.authority, folder / "authority.key")
        leaf = authority.issue_cert(
            *names,
            common_name=names[0],
            organization_name=ORGANISATION,
            not_before=now - datetime.timedelta(days=1),
            not_after=now + datetime.timedelta(days=VALID_DAYS),
        )
        made.chain.write_bytes(b"".join(part.bytes() for part in leaf.cert_chain_pems))
        _write_secret(made.key, leaf.private_key_pem.bytes())
    except OSError as error:
        raise problem_error(
            "tls.unwritable", f"no certificate can be kept in {folder}: {error.strerror}", "Choose another --data-dir"
        ) from error
    except ValueError as error:
        raise problem_error(
            "tls.unreadable", f"{folder} holds no certificate authority ({error})", f"Remove {folder} and start again"
        ) from error
    return made


def names_of(host: str) -> tuple[str, ...]:
    """The names and addresses under which a server that listens on ``host`` can be asked for."""
    names = [*LOCAL]
    if host in ("0.0.0.0", "::"):
        names += [socket.gethostname(), f"{socket.gethostname()}.local", *own_addresses()]
    else:
        names.append(host)
    return tuple(dict.fromkeys(name for name in names if name))


def own_addresses() -> tuple[str, ...]:
    """This machine's address in the network that leads elsewhere; none without a network."""
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(ELSEWHERE)
        return (str(probe.getsockname()[0]),)
    return ()


def _authority(certificate: Path, key: Path) -> trustme.CA:
    if certificate.exists() and key.exists():
        return trustme.CA.from_pem(certificate.read_bytes(), key.read_bytes())
    authority = trustme.CA(organization_name=ORGANISATION, organization_unit_name=socket.gethostname())
    certificate.write_bytes(authority.cert_pem.bytes())
    _write_secret(key, authority.private_key_pem.bytes())
    return authority


def _write_secret(path: Path, content: bytes) -> None:
    """Write a file that nobody else may read, from its first byte on."""
    path.unlink(missing_ok=True)
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
        file.write(content)
