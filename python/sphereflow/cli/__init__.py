"""The command ``sphereflow``: one verb a file, each thin over the Python interface."""

from sphereflow.cli.app import app, main

__all__ = ["app", "main"]
