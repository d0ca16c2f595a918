"""Files of a case as gyroid reads them, and labels sealed as `gyroid gap bench make` seals them."""

import hashlib
import json
import os
import secrets

import polars as pl

from drives import ROW_S


def toml(steering, tables):
    """A configuration of schema 1 of a drive."""
    lines = ["schema = 1", 'kind = "driving"', f"sample_time_s = {ROW_S}"]
    for name, table in tables.items():
        lines += ["", f"[{name}]"] + ([f'steering = "{steering}"'] if name == "vehicle" else [])
        lines += [f"{key} = {float(value)!r}" for key, value in table.items()]
    return "\n".join(lines) + "\n"


def sim_toml(vehicle, unit, steering="differential"):
    """The nominal simulator: what the team believes of robot and sensors."""
    tables = {"gyro": unit.gyro, "vehicle": vehicle, "encoder": {"speed_noise_std_rad_s": unit.encoder_std_rad_s}, "pose": unit.pose}
    return toml(steering, tables)


def write_log(path, columns):
    """Columns as Parquet, or as CSV by the ending; NaN is a missing value."""
    table = pl.DataFrame(columns, nan_to_null=True)
    table.write_csv(path) if path.suffix == ".csv" else table.write_parquet(path)


def seal(folder, key_file, labels, seed):
    """Seals `labels` (by case), and returns the commitment: SHA-256 of the salted labels.

    Writes labels.sealed and commitment.txt into `folder`, and the key, 64 hexadecimal digits, readable by its owner alone,
    elsewhere: `gyroid gap bench score` opens them.
    """
    from nacl.bindings import crypto_aead_xchacha20poly1305_ietf_encrypt as encrypt

    plain = json.dumps({"salt": secrets.token_hex(32), "seed": seed, "labels": labels}).encode()
    key, nonce = secrets.token_bytes(32), secrets.token_bytes(24)
    commitment = hashlib.sha256(plain).hexdigest()
    (folder / "labels.sealed").write_bytes(nonce + encrypt(plain, None, nonce, key))
    (folder / "commitment.txt").write_text(commitment + "\n")
    with open(os.open(key_file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as file:
        file.write(key.hex() + "\n")
    return commitment


def unsealed(folder, key_file):
    """The labels (by case) that `seal` sealed."""
    from nacl.bindings import crypto_aead_xchacha20poly1305_ietf_decrypt as decrypt

    sealed, key = (folder / "labels.sealed").read_bytes(), bytes.fromhex(key_file.read_text().strip())
    return json.loads(decrypt(sealed[24:], None, sealed[:24], key))["labels"]
