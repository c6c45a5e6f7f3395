#!/usr/bin/env python3
"""Makes the certificates for tests/cli/publish_tls.rs, all with the same key. They are for tests only.

    tests/data/tls/make.py

Needs the package cryptography. All other certificates than self-signed.pem are signed by ca.pem.
"""

import datetime
import ipaddress
import pathlib

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec

FOLDER = pathlib.Path(__file__).parent
KEY = ec.generate_private_key(ec.SECP256R1())
LOCAL = [x509.DNSName("localhost"), x509.IPAddress(ipaddress.ip_address("127.0.0.1"))]


def make(name, common_name, names=(), authority=False, first=2020, last=2126, signed_by="test authority"):
    def name_of(text):
        return x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, text)])

    builder = (
        x509.CertificateBuilder(name_of(signed_by), name_of(common_name), KEY.public_key(), x509.random_serial_number())
        .not_valid_before(datetime.datetime(first, 1, 1))
        .not_valid_after(datetime.datetime(last, 1, 1))
        .add_extension(x509.BasicConstraints(ca=authority, path_length=None), critical=True)
    )
    if names:
        builder = builder.add_extension(x509.SubjectAlternativeName(names), critical=False)
    certificate = builder.sign(KEY, hashes.SHA256())
    (FOLDER / f"{name}.pem").write_bytes(certificate.public_bytes(serialization.Encoding.PEM))


pkcs8 = serialization.PrivateFormat.PKCS8
(FOLDER / "key.pem").write_bytes(
    KEY.private_bytes(serialization.Encoding.PEM, pkcs8, serialization.NoEncryption())
)
make("ca", "test authority", authority=True)
make("localhost", "localhost", LOCAL)
make("other-name", "lab1", [x509.DNSName("lab1.example")])
make("expired", "localhost", LOCAL, last=2021)
make("future", "localhost", LOCAL, first=2120)
make("self-signed", "localhost", LOCAL, signed_by="localhost")
