"""The promises of docs/safety.md, each as trials that break something; tools/promises.py runs them."""
