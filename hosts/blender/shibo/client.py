"""The process `shibo bridge` and its lines. Nothing here uses Blender.

Threads write requests and read answers, so no call waits for the process. `poll` hands out the answers, on the thread that calls it.
"""
import json
import os
import queue
import shutil
import subprocess
import tempfile
import threading
import time

PROTOCOL = 1
# Longest line of an answer in bytes. Pictures are files, so only lists of graphs and of errors are long.
MOST_BYTES = 64 << 20
# Longest wait in seconds for the end of a process after its input was closed.
PATIENCE = 2.0


class Missing(Exception):
    """The program is not there, or cannot be started."""


def find(preferred="", bundled=""):
    """The path of the program: the preferred one, the one inside the extension, or one in PATH.

    Raises `Missing` with a remedy.
    """
    if preferred:
        if os.path.isfile(preferred):
            return preferred
        raise Missing(f"there is no file {preferred}; change the path in the preferences of the extension")
    if bundled and os.path.isfile(bundled):
        if not os.access(bundled, os.X_OK):
            # Archives are unpacked without the right to run files.
            os.chmod(bundled, 0o755)
        return bundled
    found = shutil.which("shibo")
    if not found:
        raise Missing("the program shibo is not in PATH; install it, or set its path in the preferences of the extension")
    return found


class Client:
    """A running `shibo bridge`."""

    def __init__(self, program):
        """Starts the program. Raises `Missing` if it cannot be started."""
        self.program = program
        self.hello = None
        # Reason why the process has ended; None while it runs.
        self.ended = None
        self._number = 0
        self._asked = {}
        # The render that runs, and after it those in the queue. The bridge of 0.1.0 can block when it runs two renders at once.
        self._renders = []
        self._arrived = queue.Queue()
        self._sending = queue.Queue()
        # The messages of the program are kept for the report of a crash. A file never blocks the process.
        self._said = tempfile.TemporaryFile()
        hidden = {"creationflags": subprocess.CREATE_NO_WINDOW} if os.name == "nt" else {}
        try:
            self.process = subprocess.Popen(
                [program, "bridge"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said, **hidden)
        except OSError as error:
            self._said.close()
            raise Missing(f"{program} cannot be started: {error.strerror or error}") from error
        self._threads = [threading.Thread(target=work, daemon=True) for work in (self._read, self._write)]
        for thread in self._threads:
            thread.start()
        self.ask("hello", self._greet, protocol=PROTOCOL, client="blender")

    def ask(self, op, then=None, event=None, **fields):
        """Sends a request; returns its id.

        `then` gets the last answer: a dictionary with `ok` or `error`. `event` gets the events before it. Both are called by `poll`.
        Renders run one after the other; a newer one of the same slot stops those before it.
        """
        self._number += 1
        self._asked[self._number] = (then, event)
        request = {"id": self._number, "op": op, **fields}
        if op != "render":
            self._sending.put(request)
            return self._number
        slot = fields.get("slot")
        for other in [other for other in self._renders if slot is not None and other.get("slot") == slot]:
            self._stop(other)
        self._renders.append(request)
        if len(self._renders) == 1:
            self._sending.put(request)
        return self._number

    def _stop(self, request):
        """Cancels a render. One that waits is answered at once."""
        if request is self._renders[0]:
            self.ask("cancel", of=request["id"])
        else:
            self._renders.remove(request)
            self._arrived.put({"id": request["id"], "error": {"code": "cancelled", "message": "the work was cancelled"}})

    def poll(self, seconds=0.0):
        """Hands out all that has arrived; waits for the first message up to `seconds`.

        Returns events that belong to no request. After the end of the process all open requests get the error `ended`.
        """
        others = []
        wait = seconds > 0
        while True:
            try:
                message = self._arrived.get(timeout=seconds) if wait else self._arrived.get_nowait()
            except queue.Empty:
                return others
            wait = False
            if message is None:
                self._finish()
                return others
            if "event" in message:
                _, event = self._asked.get(message.get("id"), (None, None))
                if event:
                    event(message)
                elif "id" not in message:
                    others.append(message)
                continue
            then, _ = self._asked.pop(message.get("id"), (None, None))
            if self._renders and self._renders[0]["id"] == message.get("id"):
                del self._renders[0]
                if self._renders:
                    self._sending.put(self._renders[0])
            if then:
                then(message)

    def has_requests(self):
        """True while a request has no last answer."""
        return bool(self._asked)

    def close(self):
        """Ends the process, and removes its folder if it leaves one."""
        self.ended = self.ended or "closed"
        self._sending.put(None)
        self._threads[1].join(PATIENCE)
        for end in (self.process.terminate, self.process.kill, None):
            try:
                self.process.wait(PATIENCE)
                break
            except subprocess.TimeoutExpired:
                if end:
                    end()
        self._threads[0].join(PATIENCE)
        for pipe in (self.process.stdin, self.process.stdout, self._said):
            try:
                pipe.close()
            except OSError:
                pass
        self._asked.clear()
        folder = (self.hello or {}).get("folder", "")
        if os.path.basename(folder).startswith("shibo-"):
            shutil.rmtree(folder, ignore_errors=True)

    def _greet(self, answer):
        self.hello = answer.get("ok") or {}
        protocol = self.hello.get("protocol")
        if protocol != PROTOCOL and "ok" in answer:
            self.ended = f"{self.program} has version {protocol} of the protocol; the extension needs {PROTOCOL}"
            self._sending.put(None)

    def _finish(self):
        """Tells all open requests that the process has ended."""
        if self.ended is None:
            self.ended = self._reason()
        asked, self._asked = self._asked, {}
        self._renders.clear()
        for then, _ in asked.values():
            if then:
                then({"error": {"code": "ended", "message": self.ended, "errors": []}})

    def _reason(self):
        try:
            code = self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            code = None
        self._said.seek(max(0, self._said.seek(0, os.SEEK_END) - 2000))
        said = self._said.read().decode("utf-8", "replace").strip().splitlines()
        how = f"signal {-code}" if code is not None and code < 0 else f"code {code}"
        return f"shibo ended with {how}" + (f": {said[-1]}" if said else "")

    def _read(self):
        for line in iter(lambda: self.process.stdout.readline(MOST_BYTES), b""):
            try:
                message = json.loads(line)
            except ValueError:
                message = None
            if not isinstance(message, dict):
                text = line[:80].decode("utf-8", "replace").strip()
                self.ended = self.ended or f"{self.program} is not shibo, or is broken; it said: {text}"
                self.process.kill()
                break
            self._arrived.put(message)
        self._arrived.put(None)

    def _write(self):
        try:
            for message in iter(self._sending.get, None):
                self.process.stdin.write(json.dumps(message).encode() + b"\n")
                self.process.stdin.flush()
        except (OSError, ValueError):
            # The process has ended; `_read` finds that out.
            pass
        try:
            self.process.stdin.close()
        except OSError:
            pass


class Keeper:
    """Starts the process when it is needed, and again after a crash."""

    # Starts after a crash.
    MOST = 3

    def __init__(self, locate):
        """`locate` returns the path of the program, or raises `Missing`."""
        self._locate = locate
        self._client = None
        self.crashes = 0
        # Reason why there is no process; an empty text if there may be one.
        self.trouble = ""

    @property
    def running(self):
        return self._client is not None and self._client.ended is None

    @property
    def hello(self):
        """The answer to `hello`; None before it has arrived."""
        return self._client.hello if self._client else None

    @property
    def ended(self):
        """The reason why the last process has ended; None while it runs, or without one."""
        return self._client.ended if self._client else None

    def client(self):
        """The running client, or None; `trouble` then has the reason."""
        if self._client is not None and self._client.ended:
            reason = self._client.ended
            self._client.close()
            self._client = None
            self.crashes += 1
            self.trouble = reason
        if self._client is None:
            if self.crashes > self.MOST or (self.trouble and not self.crashes):
                return None
            try:
                self._client = Client(self._locate())
            except Missing as missing:
                self.trouble = str(missing)
                self.crashes = 0
                return None
        return self._client

    def hope(self):
        """Lets the next `client` look again for a program that was missing."""
        if self._client is None and not self.crashes:
            self.trouble = ""

    def stop(self):
        """Ends the process, and forgets crashes and troubles: the next `client` starts a process."""
        if self._client is not None:
            self._client.close()
        self._client = None
        self.crashes = 0
        self.trouble = ""


def wait_until(condition, step, seconds):
    """Calls `step` until `condition` holds; False after `seconds`."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        step()
    return True
