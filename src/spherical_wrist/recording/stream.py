"""Rerun's recording streams, as far as they go without leaving anything behind.

Rerun keeps the threads and the memory of a stream that is not disconnected and swept away explicitly, see
https://github.com/rerun-io/rerun/issues/2116: a campaign that records thousands of runs would run out of both.
"""

from collections.abc import Callable

import rerun as rr
import rerun.blueprint as rrb
import rerun_bindings
from rerun.error_utils import catch_and_log_exceptions

from spherical_wrist.errors import RecordingError
from spherical_wrist.recording.layout import APPLICATION


def recorded(fill: Callable[[rr.RecordingStream], None], blueprint: rrb.Blueprint) -> bytes:
    """The bytes of a recording.

    Args:
        fill: sends the contents. What Rerun cannot store raises, instead of being dropped with a warning.
        blueprint: how the viewer shows it.

    Raises:
        RecordingError: the environment switches Rerun off.
    """
    try:
        with catch_and_log_exceptions(strict=True):
            content = _recorded(fill, blueprint)
    finally:
        rerun_bindings.flush_and_cleanup_orphaned_recordings()
    return content


def _recorded(fill: Callable[[rr.RecordingStream], None], blueprint: rrb.Blueprint) -> bytes:
    stream = rr.RecordingStream(APPLICATION)
    memory = stream.memory_recording()
    try:
        if not rr.is_enabled(stream):
            raise RecordingError("the environment switches Rerun off: unset the variable RERUN to record")
        send_blueprint(stream, blueprint)
        fill(stream)
        return memory.drain_as_bytes()
    finally:
        stream.disconnect()


def send_blueprint(stream: rr.RecordingStream, blueprint: rrb.Blueprint) -> None:
    """What ``stream.send_blueprint`` does, but disconnecting the blueprint's own stream.

    It is made active, as Rerun itself does. If it were the default only, the web viewer, which may begin to draw before
    it has all, would keep the layout that it has guessed until then; and a viewer that has shown another run would show
    this one as that.
    """
    native = rerun_bindings.new_blueprint(APPLICATION, make_default=False, make_thread_default=False)
    own = rr.RecordingStream._from_native(native)
    memory = own.memory_recording()
    try:
        own.set_time("blueprint", sequence=0)
        blueprint._log_to_stream(own)
        rerun_bindings.send_blueprint(memory.storage, make_active=True, make_default=True, recording=stream.to_native())
    finally:
        own.disconnect()
