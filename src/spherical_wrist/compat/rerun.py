"""Private and unstable parts of Rerun's SDK."""

from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any, cast

import rerun as rr
import rerun.blueprint as rrb
import rerun_bindings

from spherical_wrist.compat import MissingPartError, private

if TYPE_CHECKING:
    from rerun.experimental import ViewerClient as ViewerClient  # noqa: PLC0414 exported
    from rerun.experimental import ViewerState as ViewerState  # noqa: PLC0414

LIBRARY = "rerun-sdk"


def strict_errors() -> AbstractContextManager[Any]:
    """Raise an error for data that Rerun cannot store, in this thread, instead of dropping them with a warning.

    The public ``rr.set_strict_mode`` changes the mode of the whole process.
    """
    import rerun.error_utils

    make = private(LIBRARY, rerun.error_utils, "catch_and_log_exceptions")
    return cast(AbstractContextManager[Any], make(strict=True))


def free_streams() -> None:
    """Free threads and memory of streams that nothing refers to any more.

    Rerun keeps them otherwise (https://github.com/rerun-io/rerun/issues/2116). The only public way, ``rr.init``, also
    replaces the global recording.
    """
    private(LIBRARY, rerun_bindings, "flush_and_cleanup_orphaned_recordings")()


def send_blueprint(stream: rr.RecordingStream, application: str, blueprint: rrb.Blueprint) -> None:
    """Send a blueprint to a stream, and make it active and the default.

    The public ``RecordingStream.send_blueprint`` does the same but never disconnects the blueprint's own stream, which
    leaves two threads and 0.5 MB behind each time.

    Active, as Rerun itself does: if it were the default only, the web viewer, which may begin to draw before it has
    all data, would keep the layout that it guessed until then, and a viewer that showed another run would keep its
    layout.

    Args:
        stream: of the data.
        application: application id of the stream.
        blueprint: layout of the viewer.
    """
    native = private(LIBRARY, rerun_bindings, "new_blueprint")(
        application, make_default=False, make_thread_default=False
    )
    own = private(LIBRARY, rr.RecordingStream, "_from_native")(native)
    memory = own.memory_recording()
    try:
        own.set_time("blueprint", sequence=0)
        private(LIBRARY, blueprint, "_log_to_stream")(own)
        send = private(LIBRARY, rerun_bindings, "send_blueprint")
        send(memory.storage, make_active=True, make_default=True, recording=stream.to_native())
    finally:
        own.disconnect()


def connect_viewer(url: str) -> "ViewerClient":
    """Connect to a viewer to read its state and take screenshots, which Rerun offers as experimental only.

    Raises:
        ConnectionError: no viewer answers there.
        MissingPartError: the library lacks the experimental client.
    """
    try:
        from rerun.experimental import ViewerClient
    except ImportError:
        raise MissingPartError(LIBRARY, "rerun.experimental.ViewerClient") from None
    return ViewerClient.connect(url)
