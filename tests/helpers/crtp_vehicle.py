"""A Crazyflie as far as trajectories go: memories, the high-level commander; over UDP: lost packets, an end."""

import socket
import struct
import threading
import time


class Crazyflie:
    """What a vehicle holds and answers, whatever link it hangs on.

    ``corrupt`` flips a bit of the byte written at that address.
    """

    def __init__(self, corrupt=None):
        self.memory = bytearray(4096)
        self.commands, self.corrupt = [], corrupt

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
        assert (port, channel) == (8, 0)
        self.commands.append((time.monotonic(), bytes(body)))
        return (body + bytes(3))[:3] + b"\x00"


class CrtpVehicle(Crazyflie):
    """One UDP port that answers CRTP packets, one a datagram.

    ``lossy`` drops every third packet in either direction; ``lasts`` ends it after so many packets.
    """

    def __init__(self, lossy=False, lasts=None, corrupt=None):
        super().__init__(corrupt)
        self.lossy, self.lasts = lossy, lasts
        self.seen = 0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(0.05)
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
        count = 0
        while not self._ends.is_set():
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
