"""A Crazyflie as far as trajectories go: memories, log, the high-level commander; over UDP: lost packets, an end."""

import socket
import struct
import threading
import time

from crazyflie_planner import Planner

LOGGED = (
    "pm.vbat",
    "stateEstimate.x",
    "stateEstimate.y",
    "pm.state",
    "stateEstimate.z",
    "supervisor.info",
    "radio.rssi",
)
"""Variables of the firmware's log, in the order of its table."""

SENT = {7: "f", 4: "b", 2: "H"}
"""Types in which the log sends them."""


class Crazyflie:
    """What a vehicle holds and answers, whatever link it hangs on.

    ``corrupt`` flips a bit of the byte written at that address. It stands ``at`` a place, and flies its setpoints.
    """

    def __init__(self, corrupt=None, at=(0.0, 0.0, 0.0)):
        self.memory = bytearray(4096)
        self.commands, self.corrupt = [], corrupt
        self.planner, self.power, self.supervisor = Planner(at), 0, 0
        self.planner.memory = self.memory
        self._block, self._period, self._due = [], None, 0.0

    def answer(self, port, channel, body):
        if (port, channel) == (4, 0):
            if body[0] == 1:
                return bytes([1, 2])
            kind, size = ((0x01, 112), (0x12, 4096))[body[1]]
            return bytes([2, body[1], kind]) + struct.pack("<IQ", size, 0)
        if (port, channel) == (4, 1):
            number, start, count = struct.unpack("<BIB", body)
            assert number == 1 and count <= 24
            return body[:5] + b"\x00" + bytes(self.memory[start : start + count])
        if (port, channel) == (4, 2):
            number, start = struct.unpack_from("<BI", body)
            assert number == 1 and len(body) <= 30
            self.memory[start : start + len(body) - 5] = body[5:]
            if self.corrupt is not None and start <= self.corrupt < start + len(body) - 5:
                self.memory[self.corrupt] ^= 1
            return body[:5] + b"\x00"
        if port == 5:
            return self._logs(channel, body)
        assert (port, channel) == (8, 0)
        self.commands.append((time.monotonic(), bytes(body)))
        return (body + bytes(3))[:3] + bytes([self.planner.take(bytes(body), time.monotonic())])

    def _logs(self, channel, body):
        """The table of variables, and the one block that is sent."""
        if channel == 0 and body[0] == 3:
            return struct.pack("<BHIBB", 3, len(LOGGED), 0x1234, 16, 128)
        if channel == 0:
            return body[:3] + b"\x27" + b"\0".join(part.encode() for part in LOGGED[body[1]].split(".")) + b"\0"
        assert channel == 1
        if body[0] == 5:
            self._block, self._period = [], None
        elif body[0] == 6:
            self._block = [struct.unpack_from("<BH", body, start) for start in range(2, len(body), 3)]
        elif body[0] == 3:
            self._period, self._due = 0.01 * body[2], time.monotonic()
        return (body + b"\0")[:2] + b"\0"

    def log(self):
        """Return the packet of the log that is due, or None."""
        now = time.monotonic()
        if self._period is None or now < self._due:
            return None
        self._due = now + self._period
        said = dict(zip(("stateEstimate.x", "stateEstimate.y", "stateEstimate.z"), self.planner(now), strict=True))
        said |= {"pm.state": self.power, "supervisor.info": self.supervisor}
        values = b"".join(struct.pack("<" + SENT[kind], said[LOGGED[number]]) for kind, number in self._block)
        return b"\x52\x01" + int(1e3 * now).to_bytes(8, "little")[:3] + values


class CrtpVehicle(Crazyflie):
    """One UDP port that answers CRTP packets, one a datagram.

    ``lossy`` drops every third packet in either direction; ``lasts`` ends it after so many packets.
    """

    def __init__(self, lossy=False, lasts=None, corrupt=None, at=(0.0, 0.0, 0.0)):
        super().__init__(corrupt, at)
        self.lossy, self.lasts = lossy, lasts
        self.seen = 0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(0.02)
        self.uri = f"udp://127.0.0.1:{self._socket.getsockname()[1]}"
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ends.set()
        self._thread.join()
        self._socket.close()

    def _run(self):
        count, place = 0, None
        while not self._ends.is_set():
            if (
                place is not None
                and (self.lasts is None or self.seen <= self.lasts)
                and (said := self.log()) is not None
            ):
                count += 1
                if not (self.lossy and count % 3 == 0):
                    self._socket.sendto(said, place)
            try:
                packet, place = self._socket.recvfrom(64)
            except TimeoutError:
                continue
            self.seen += 1
            count += 1
            if (self.lasts is not None and self.seen > self.lasts) or (self.lossy and count % 3 == 0):
                continue
            answer = self.answer(packet[0] >> 4, packet[0] & 3, packet[1:])
            count += 1
            if answer is not None and not (self.lossy and count % 3 == 0):
                self._socket.sendto(bytes([packet[0] & 0xF3]) + answer, place)
