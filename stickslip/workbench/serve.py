"""The server of the workbench: on this machine only unless told otherwise, and for those who have its address only."""

from __future__ import annotations

import atexit
import hmac
import logging
import queue
import secrets
import signal
import socket
import threading
import webbrowser
from collections.abc import Callable, Sequence
from typing import Any

from tornado.httputil import HTTPServerRequest
from tornado.ioloop import IOLoop
from tornado.routing import Router
from tornado.web import Application, RequestHandler, StaticFileHandler

from ..errors import InputError
from . import own_effects
from .app import ready, view
from .background_work import close_all
from .session import LOOKING, Session
from .worker import Worker, end_all

LOOPBACK = "127.0.0.1"
NAMES = ("127.0.0.1", "localhost")
PATIENCE = 3.0  # s that the first window may take to come, before which nothing is fitted
CLOSED = "stickslip workbench: closed"
LOCAL = (
    "stickslip workbench: {url} (for a browser on the machine of the kernel; from another one through "
    "jupyter-server-proxy: ss.workbench(campaign, proxy=...))"
)


class Refuse(RequestHandler):
    """The answer to a request without the token."""

    def prepare(self) -> None:
        """Refuse whatever the method is."""
        self.set_status(403)
        self.finish("403: the address that the server printed has a token, and this request has none\n")


class Door(Router):
    """Lets a request through to the workbench if its path begins with the token.

    Args:
        inside: what answers then. token: of this server.
    """

    def __init__(self, inside: Application, token: str) -> None:
        self._inside, self._token = inside, token
        self._outside = Application([(r".*", Refuse)], log_function=lambda handler: None)

    def find_handler(self, request: HTTPServerRequest, **kwargs: Any) -> Any:
        """The workbench's own, or a refusal."""
        first = request.path.split("/")[1] if "/" in request.path else ""
        known = hmac.compare_digest(first.encode("utf-8", "replace"), self._token.encode())
        return (self._inside if known else self._outside).find_handler(request, **kwargs)


def serve(
    session: Session, *, port: int = 0, address: str = LOOPBACK, browser: bool = True,
    tell: Callable[[str], None] = print, keep: bool = True, origins: Sequence[str] = (),
) -> None:  # fmt: skip
    """Serve a session until interrupted.

    Args:
        session: what all windows share.
        port: 0 for any that is free.
        address: of this machine, under which the server is reached.
        browser: open it.
        tell: told the address.
        keep: the history beside the campaign's file.
        origins: hosts whose pages may talk to it; default: its own, or any where ``address`` is not this machine's.

    Raises:
        InputError: the port is taken, or the address is none of this machine.
    """
    import panel as pn
    from panel.io.resources import DIST_DIR
    from panel.io.server import get_server

    for name in ("bokeh", "panel", "tornado"):
        logging.getLogger(name).setLevel(logging.ERROR)
    ready()
    token = secrets.token_urlsafe(16)
    port = _free(address, port)
    session.worker, session.aside = workers = Worker(), Worker()
    origins = list(origins) or (["*"] if address not in NAMES else [f"{name}:{port}" for name in NAMES])
    waiting = session.campaign is not None

    def begin() -> None:
        nonlocal waiting
        if waiting:
            waiting = False
            session.begin(keep)

    def page() -> Any:
        made = view(session)
        pn.state.onload(begin)
        return made

    server: Any = get_server(
        {"/": page}, port=port, address=address, prefix=f"/{token}", websocket_origin=origins,
        title="stickslip", start=False, show=False, loop=IOLoop.current(),
        extra_patterns=[(r"/(favicon\.ico)", StaticFileHandler, {"path": DIST_DIR / "images"})],
    )  # fmt: skip
    server._http.request_callback = Door(server._tornado, token)
    server.start()
    alone = threading.current_thread() is threading.main_thread()
    if alone:
        signal.signal(signal.SIGTERM, lambda *_: server.io_loop.add_callback_from_signal(server.io_loop.stop))
    url = f"http://{f'[{address}]' if ':' in address else address}:{port}/{token}/"
    tell(url)
    watcher = own_effects.watch(session, session.effect_files) if session.effect_files else None
    if waiting:  # a fit would keep the first window waiting
        session.busy = LOOKING
        server.io_loop.call_later(PATIENCE, begin)
    if browser:
        server.io_loop.add_callback(webbrowser.open, url)
    try:
        server.io_loop.start()
    finally:
        if watcher is not None:
            watcher.set()
        session.close()
        server.stop()
        for worker in workers:
            worker.close()
        close_all(session)
        if alone:
            end_all()


class Window:
    """A workbench in a notebook: a frame onto a server of its own, in a thread of the notebook's kernel.

    Attributes:
        url: its address, on the kernel's machine and with its token; a path of Jupyter where that forwards it.
        tall: pixels of the frame.

    Args:
        session: what it shows.
        tall: of the frame.
        proxy: path of Jupyter under which ports are forwarded, such as ``/user/me/proxy``; "" for none. Who sends the
            requests is then known to the proxy only, so the token alone says who may come in.

    Raises:
        InputError: the server cannot listen.
    """

    def __init__(self, session: Session, tall: int = 1000, proxy: str = "") -> None:
        self.tall = tall
        self._proxy, self._loop = proxy.rstrip("/"), IOLoop(make_current=False)
        told: queue.SimpleQueue[str | Exception] = queue.SimpleQueue()

        def run() -> None:
            self._loop.make_current()
            try:
                serve(session, browser=False, tell=told.put, keep=False, origins=("*",) if proxy else ())
            except Exception as error:  # whoever waits is told
                told.put(error)

        self._thread = threading.Thread(target=run, name="stickslip workbench", daemon=True)
        self._thread.start()
        found = told.get()
        if isinstance(found, Exception):
            raise found
        atexit.register(self.close)  # else its processes would be waited for
        port, token = found.rstrip("/").rsplit(":", 1)[1].split("/")
        self.url = f"{self._proxy}/{port}/{token}/" if proxy else found

    def close(self) -> None:
        """End the server and all that goes on in it; once more does nothing."""
        if self._thread.is_alive():
            self._loop.add_callback(self._loop.stop)
            self._thread.join()
            self._loop.close(all_fds=True)  # else windows that are open would wait for an answer
        atexit.unregister(self.close)

    def __enter__(self) -> Window:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _repr_html_(self) -> str:
        if not self._thread.is_alive():
            return CLOSED
        frame = f'<iframe src="{self.url}" style="width: 100%; height: {self.tall}px; border: 0"></iframe>'
        return frame if self._proxy else f"{frame}<p>{LOCAL.format(url=self.url)}</p>"

    def __repr__(self) -> str:
        if not self._thread.is_alive():
            return CLOSED
        return f"stickslip workbench: {self.url}" if self._proxy else LOCAL.format(url=self.url)


def _free(address: str, port: int) -> int:
    """The port, or one that is free."""
    try:
        with socket.socket(socket.AF_INET6 if ":" in address else socket.AF_INET) as asked:
            asked.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            asked.bind((address, port))
            return int(asked.getsockname()[1])
    except (OSError, OverflowError) as error:
        raise InputError(
            f"the server cannot listen there ({getattr(error, 'strerror', None) or error})",
            key="--port", value=f"{address}:{port}", hint="leave --port out for any that is free",
        ) from None  # fmt: skip
