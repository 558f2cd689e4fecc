"""Names of the metadata records that the logger adds to a bag, and that replay looks for."""

from __future__ import annotations

# The prefix before a node's name: the parameters that it was started with, each as JSON.
PARAMETERS_RECORD = 'parameters '
# What the recording was made on (recording/platform.py).
PLATFORM_RECORD = 'platform'
# In a record of parameters, when they were read (the logger's clock): a node may be started again with others. Bags of
# earlier versions do not hold it.
READ_AT = 'log time (ns)'
