"""The digest of core's code and a hash of the sources that it was made of. Made by tools/core_digest.py."""

SOURCES = '7c4fbd639238180117317a4c7d879a523d90b1b9ca0247e2942be520052b383c'
DIGEST = '274edd2fc0addbe4'
