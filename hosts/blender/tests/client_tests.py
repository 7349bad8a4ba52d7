"""Tests of the process and its lines, without Blender: SHIBO=path/to/shibo python3 client_tests.py"""
import os
import signal
import stat
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "shibo"))

from client import Client, Keeper, Missing, find, wait_until  # noqa: E402

SHIBO = os.path.abspath(os.environ["SHIBO"])


def script(test, text):
    """A program that is not shibo."""
    folder = tempfile.mkdtemp()
    path = os.path.join(folder, "shibo")
    with open(path, "w", encoding="utf-8") as file:
        file.write(f"#!{sys.executable}\n{text}")
    os.chmod(path, 0o755)
    test.addCleanup(lambda: (os.remove(path), os.rmdir(folder)))
    return path


def is_alive(pid):
    """True for a process that runs; one that only waits to be counted is over."""
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii", errors="replace") as file:
            return file.read().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


class Clients(unittest.TestCase):
    def client(self, program=SHIBO):
        client = Client(program)
        self.addCleanup(client.close)
        return client

    def until(self, client, condition, seconds=20):
        self.assertTrue(wait_until(condition, lambda: client.poll(0.05), seconds), client.ended)

    def test_a_graph_is_rendered(self):
        client, answers, events = self.client(), [], []

        def opened(answer):
            client.ask("render", answers.append, events.append, graph=answer["ok"]["graph"], slot="a", sizes=[16], rows="bottom",
                       components=4, output="material.base_color", **{"as": "u8"})

        client.ask("open", opened, graph="shibo:starter")
        self.until(client, lambda: answers)
        self.assertIn("ok", answers[0])
        pictures = [event for event in events if event["event"] == "picture"]
        self.assertEqual(os.path.getsize(pictures[0]["file"]), 16 * 16 * 4)
        self.assertFalse(client.has_requests())

    def test_a_newer_render_of_a_slot_stops_those_before(self):
        client, answers = self.client(), []
        graph = []
        client.ask("open", lambda answer: graph.append(answer["ok"]["graph"]), graph="shibo:calf")
        self.until(client, lambda: graph)
        for at, size in enumerate((1024, 512, 16)):
            client.ask("render", lambda answer, at=at: answers.append((at, "ok" in answer)), graph=graph[0], slot="a", sizes=[size])
        self.until(client, lambda: len(answers) == 3, 60)
        self.assertEqual(sorted(answers), [(0, False), (1, False), (2, True)])

    def test_renders_of_slots_all_end(self):
        client, answers = self.client(), []
        graph = []
        client.ask("open", lambda answer: graph.append(answer["ok"]["graph"]), graph="shibo:starter")
        self.until(client, lambda: graph)
        for slot in "abcd":
            client.ask("render", answers.append, graph=graph[0], slot=slot, sizes=[16])
        self.until(client, lambda: len(answers) == 4, 60)
        self.assertTrue(all("ok" in answer for answer in answers))

    def test_a_killed_process_ends_all_requests(self):
        client, answers = self.client(), []
        self.until(client, lambda: client.hello)
        folder = client.hello["folder"]
        client.ask("open", answers.append, graph="shibo:calf")
        os.kill(client.process.pid, signal.SIGKILL)
        self.until(client, lambda: client.ended)
        client.poll()
        self.assertEqual(client.ended, "shibo ended with signal 9")
        client.close()
        self.assertFalse(os.path.exists(folder))

    def test_garbage_ends_the_process(self):
        client = self.client(script(self, "import time\nprint('Welcome to the shell', flush=True)\ntime.sleep(60)\n"))
        self.until(client, lambda: client.ended)
        self.assertIn("it said: Welcome to the shell", client.ended)
        self.assertEqual(client.process.wait(5), -signal.SIGKILL)

    def test_another_version_of_the_protocol_is_refused(self):
        client = self.client(script(self, "input()\nprint('{\"id\":1,\"ok\":{\"protocol\":7}}', flush=True)\ninput()\n"))
        self.until(client, lambda: client.ended)
        self.assertIn("version 7 of the protocol", client.ended)

    def test_the_last_line_of_a_failure_is_told(self):
        client = self.client(script(self, "import sys\nsys.exit('no room left')\n"))
        self.until(client, lambda: client.ended)
        self.assertEqual(client.ended, "shibo ended with code 1: no room left")

    def test_a_process_that_does_not_listen_is_ended(self):
        client = self.client(script(self, "import signal, time\nsignal.signal(signal.SIGTERM, signal.SIG_IGN)\ntime.sleep(60)\n"))
        begin = time.monotonic()
        client.close()
        self.assertIsNotNone(client.process.poll())
        self.assertLess(time.monotonic() - begin, 10)

    def test_close_leaves_no_process_and_no_folder(self):
        client = self.client()
        self.until(client, lambda: client.hello)
        folder = client.hello["folder"]
        self.assertTrue(os.path.isdir(folder))
        client.close()
        self.assertFalse(os.path.exists(folder))
        self.assertEqual(client.process.returncode, 0)

    def test_a_killed_host_leaves_no_process_and_no_folder(self):
        host = subprocess.Popen(
            [sys.executable, "-c", (
                "import sys, time; sys.path.insert(0, sys.argv[1]); import client\n"
                "c = client.Client(sys.argv[2]); client.wait_until(lambda: c.hello, lambda: c.poll(0.1), 20)\n"
                "print(c.process.pid, c.hello['folder'], flush=True); time.sleep(60)"),
             os.path.dirname(sys.modules["client"].__file__), SHIBO],
            stdout=subprocess.PIPE, text=True)
        pid, folder = host.stdout.readline().split()
        self.assertTrue(is_alive(pid) and os.path.isdir(folder))
        host.kill()
        host.wait()
        host.stdout.close()
        end = time.monotonic() + 10
        while (is_alive(pid) or os.path.exists(folder)) and time.monotonic() < end:
            time.sleep(0.05)
        self.assertFalse(is_alive(pid))
        self.assertFalse(os.path.exists(folder))


class Programs(unittest.TestCase):
    def test_the_preferred_program_comes_first(self):
        bundled = script(self, "")
        self.assertEqual(find(SHIBO, bundled), SHIBO)
        self.assertEqual(find("", bundled), bundled)
        with self.assertRaisesRegex(Missing, "there is no file /nowhere; change the path"):
            find("/nowhere", bundled)

    def test_a_bundled_program_gets_the_right_to_run(self):
        bundled = script(self, "")
        os.chmod(bundled, 0o644)
        find("", bundled)
        self.assertTrue(os.stat(bundled).st_mode & stat.S_IXUSR)

    def test_a_missing_program_has_a_remedy(self):
        path, os.environ["PATH"] = os.environ["PATH"], ""
        try:
            with self.assertRaisesRegex(Missing, "install it, or set its path"):
                find()
        finally:
            os.environ["PATH"] = path

    def test_the_process_is_started_again_three_times(self):
        keeper = Keeper(lambda: SHIBO)
        self.addCleanup(keeper.stop)
        for crash in range(4):
            client = keeper.client()
            self.assertIsNotNone(client)
            os.kill(client.process.pid, signal.SIGKILL)
            self.assertTrue(wait_until(lambda: client.ended, lambda: client.poll(0.05), 10))
        self.assertIsNone(keeper.client())
        self.assertEqual(keeper.trouble, "shibo ended with signal 9")
        keeper.stop()
        self.assertIsNotNone(keeper.client())

    def test_a_missing_program_is_not_looked_for_again_and_again(self):
        asked = []

        def locate():
            asked.append(1)
            raise Missing("gone")

        keeper = Keeper(locate)
        self.assertIsNone(keeper.client())
        self.assertIsNone(keeper.client())
        self.assertEqual((len(asked), keeper.trouble), (1, "gone"))
        keeper.hope()
        self.assertIsNone(keeper.client())
        self.assertEqual(len(asked), 2)


if __name__ == "__main__":
    unittest.main()
