"""Run as Rerun recordings: written whole or not at all, and read back bit for bit."""

from spherical_wrist.recording.reader import Recording, read_recording
from spherical_wrist.recording.writer import write_recording

__all__ = ["Recording", "read_recording", "write_recording"]
