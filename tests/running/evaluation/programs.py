"""A trial that takes a second, and programs that work it well, badly, and not at all."""

TRIAL = """
options: {spawn_extra_models: true}
models_to_spawn:
  "agv1::kit_tray_1::kit_tray_1::tray":
    models:
      one: {type: gear_part, pose: {xyz: [0.1, 0.1, 0.006]}}
      two: {type: gear_part, pose: {xyz: [-0.1, 0.1, 0.006]}}
orders:
  order_0:
    announcement_condition: time
    announcement_condition_value: 0
    parts:
      one: {type: gear_part, pose: {xyz: [0.1, 0.1, 0]}}
      two: {type: gear_part, pose: {xyz: [-0.1, 0.1, 0]}}
"""

# A program that must outlast its test sleeps, so that it leaves the processor alone.
PROGRAMS = '''
import logging
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

log = logging.getLogger(__name__)


class Deliver:
    def run(self, client):
        print("stdin:", sys.stdin.read())
        client.start_competition()
        client.sleep(1.1)
        log.info("sending the kit")
        client.control_agv(1, "order_0_kit_0")


class Noted(Deliver):
    """Leaves a note of each run. Once there is one, others wait while there is a file `hold`."""

    def run(self, client):
        while Path("hold").exists() and Path("notes.txt").exists():
            time.sleep(0.01)
        super().run(client)
        with open("notes.txt", "a") as notes:
            notes.write("run\\n")


class Learn(Deliver):
    """Takes longer in its second run, as a program does that depends on more than its seed."""

    def run(self, client):
        client.sleep(0.5 if Path("learned.txt").exists() else 0.0)
        Path("learned.txt").write_text("it works\\n")
        super().run(client)


class GiveUp:
    def run(self, client):
        client.start_competition()


class Crash:
    def run(self, client):
        client.start_competition()
        client.sleep(0.1)
        raise LookupError("the part <gone> & away \\x07")


class Hang:
    def run(self, client):
        client.start_competition()
        client.sleep(0.1)
        while True:
            time.sleep(0.01)


class NeverStarts:
    def run(self, client):
        while True:
            client.sleep(0.2)


class Unmade:
    def __init__(self):
        raise ValueError("no arm")

    def run(self, client):
        pass


class Eat:
    def run(self, client):
        kept = []
        while True:
            kept.append(bytearray(10_000_000))


class EatInChildren:
    """None of its processes has more than it may."""

    def run(self, client):
        eat = "kept = b'x' * 300_000_000; import time; time.sleep(60)"
        children = [subprocess.Popen([sys.executable, "-c", eat]) for _ in range(2)]
        for child in children:
            child.wait()


class Chatter:
    def run(self, client):
        while True:
            print("so " * 10_000)


class Exit:
    def run(self, client):
        sys.exit(3)


class Quit:
    def run(self, client):
        print("last words", flush=True)
        os._exit(0)


class Kill:
    def run(self, client):
        os.kill(os.getpid(), signal.SIGKILL)


class LeaveBehind(Deliver):
    """Leaves a thread that never ends, a fork and a process of its own behind."""

    def run(self, client):
        threading.Thread(target=time.sleep, args=(60,)).start()
        child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
        fork = os.fork()
        if not fork:
            time.sleep(60)
        Path("left.txt").write_text(f"{child.pid} {fork}")
        super().run(client)


class ForkAndDie:
    def run(self, client):
        if not os.fork():
            time.sleep(60)
        os._exit(7)


class CannotBeMade:
    def __init__(self):
        raise OSError("no map found")

    def run(self, client):
        pass


class DiesWhenMade:
    def __init__(self):
        os._exit(9)

    def run(self, client):
        pass
'''
