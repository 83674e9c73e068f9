"""A Crazyradio as USB sees it, and Crazyflies in the air around it, byte by byte.

The dongle by its protocol (docs/functional-areas/usb_radio_protocol.md of crazyradio-firmware), the vehicles by esb.c
of crazyflie2-nrf-firmware: safe link, answers in acknowledgements, and no acknowledgement of a broadcast.
"""

import array
from collections import deque
from itertools import count
from types import SimpleNamespace

from crtp_vehicle import Crazyflie

BROADCAST = bytes([0xFF, 0xE7, 0xE7, 0xE7, 0xE7])
CHANNEL, ADDRESS, RATE, RETRIES, ACKNOWLEDGE = 1, 2, 3, 6, 16
NUMBERS = count()
"""Of dongles: cflib takes up one that it closed a moment ago where the next has its number."""
RATES = {"250K": 0, "1M": 1, "2M": 2}


class RadioVehicle(Crazyflie):
    """A vehicle with an address on a channel; ``deaf`` is how many broadcasts it misses."""

    def __init__(self, channel, rate, last, deaf=0, at=(0.0, 0.0, 0.0)):
        super().__init__(at=at)
        self.place = f"{channel}/{rate}/E7E7E7E7{last:02X}"
        self.channel, self.rate, self.address = channel, RATES[rate], bytes([0xE7] * 4 + [last])
        self.deaf, self.broadcasts = deaf, 0
        self._safe, self._up, self._down = False, 1, 1
        self._answers, self._last = deque(), b"\xff"

    def hear(self, packet):
        """Take a packet to the own address, and return what its acknowledgement holds."""
        if packet[0] & 0xF3 == 0xF3 and packet[1:2] == b"\x05":
            self._safe, self._up, self._down = bool(packet[2]), 1, 1
            return packet
        if not self._safe or packet[0] & 8 != self._up << 3:
            self._up = 1 - self._up
            self.take(packet)
        if not self._safe or packet[0] & 4 != self._down << 2:
            self._down = 1 - self._down
            if (said := self.log()) is not None:
                self._answers.append(said)
            answer = self._answers.popleft() if self._answers else b"\xf3"
            self._last = bytes([answer[0] & 0xF3 | self._down << 2]) + answer[1:]
        return self._last

    def take(self, packet):
        """Do what a packet says."""
        if packet[0] & 0xF3 != 0xF3:
            answer = self.answer(packet[0] >> 4, packet[0] & 3, packet[1:])
            self._answers.append(bytes([packet[0] & 0xF3]) + answer)


class Dongle:
    """What pyusb shows of a Crazyradio PA, with vehicles in reach."""

    bcdDevice = 0x0053  # noqa: N815 (the name of pyusb)

    def __init__(self, *vehicles):
        self.vehicles, self.sent, self.number = vehicles, [], next(NUMBERS)
        for vehicle in vehicles:
            vehicle.uri = f"radio://{self.number}/{vehicle.place}"
        self._state = {CHANNEL: 2, ADDRESS: bytes([0xE7] * 5), RATE: 2, RETRIES: 3, ACKNOWLEDGE: 1}
        self._answer = None
        self._ctx = SimpleNamespace(dispose=lambda device: None)

    def set_configuration(self, number):
        assert number == 1

    def reset(self):
        self._answer = None

    def ctrl_transfer(self, kind, request, wValue, wIndex, timeout, data_or_wLength):  # noqa: N803
        assert (kind, wIndex) == (0x40, 0)
        self._state[request] = bytes(data_or_wLength) if request == ADDRESS else wValue

    def write(self, endpoint, data, timeout):
        """Send a packet until it is acknowledged, as often as is set."""
        packet, address = bytes(data), self._state[ADDRESS]
        assert endpoint == 1 and 1 <= len(packet) <= 32
        near = [one for one in self.vehicles if [one.channel, one.rate] == [self._state[CHANNEL], self._state[RATE]]]
        if address == BROADCAST:
            assert self._state[ACKNOWLEDGE], "cflib would wait a second for the dongle's answer"
            self.sent.append((self._state[CHANNEL], packet))
            for _ in range(1 + self._state[RETRIES]):
                for vehicle in near:
                    vehicle.broadcasts += 1
                    if vehicle.broadcasts > vehicle.deaf:
                        vehicle.take(packet)
            self._answer = bytes([0])
            return
        heard = next((one for one in near if one.address == address), None)
        self._answer = bytes([0]) if heard is None else b"\x01" + heard.hear(packet)

    def read(self, endpoint, size, timeout):
        assert endpoint == 0x81 and self._answer is not None
        return array.array("B", self._answer)
