"""Hashes of what the report of many logs was made from."""

import hashlib

MOST_HASHES = 40


def hash_rows(inputs: dict[str, str]) -> tuple[tuple[str, str], ...]:
    """Hashes one by one, or of many files one over all of their names and hashes."""
    if len(inputs) <= MOST_HASHES:
        return tuple(inputs.items())
    lines = "".join(f"{name} {digest}\n" for name, digest in inputs.items())
    whole = hashlib.sha256(lines.encode(errors="surrogateescape")).hexdigest()
    text = f"sha256:{whole} over the lines 'NAME HASH' of the inputs in the summary JSON"
    return ((f"{len(inputs)} inputs", text),)
