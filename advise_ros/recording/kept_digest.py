"""The digest of core's code and a hash of the sources that it was made of. Made by tools/core_digest.py."""

SOURCES = '2000556986f44e01680b2182a6e803baf3a29faf6d8faf2d5094e17793de4f89'
DIGEST = 'f6252c1c7e096828'
