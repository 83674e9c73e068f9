"""A bad network between two UDP endpoints: datagrams that are dropped, delayed and, if asked, cut off."""

import heapq
import random
import socket
import threading

from clocks import enter, leave


class Proxy:
    """Forwards what comes to its port to another, and the answers back; its delays are those of a clock."""

    def __init__(self, port, clock, drop=0.0, delay=0.0, jitter=0.0, seed=1):
        self.target = ("127.0.0.1", port)
        self.drop, self.delay, self.jitter = drop, delay, jitter
        self.cut, self.clock = False, clock
        self._random = random.Random(seed)
        self._front, self._back = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        for end in (self._front, self._back):
            end.bind(("127.0.0.1", 0))
            end.setblocking(False)
        self.port = self._front.getsockname()[1]
        self._client = None
        self._queue = []
        self._count = 0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self):
        enter(self.clock)
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stop.set()
        while self._thread.is_alive():
            self.clock.wait(self.clock.now() + 0.01, [])
        self._front.close()
        self._back.close()

    def _run(self):
        try:
            self._forward()
        finally:
            leave(self.clock)

    def _forward(self):
        while not self._stop.is_set():
            self._take(self._front, self._back, lambda sender: self.target)
            self._take(self._back, self._front, lambda sender: self._client)
            while self._queue and self._queue[0][0] <= self.clock.now():
                _, _, end, data, where = heapq.heappop(self._queue)
                if where is not None:
                    end.sendto(data, where)
            due = min([self.clock.now() + 0.01, *(first[0] for first in self._queue[:1])])
            self.clock.wait(due, [self._front, self._back])

    def _take(self, source, end, destination):
        while True:
            try:
                data, sender = source.recvfrom(65535)
            except OSError:
                return
            self._client = sender if source is self._front else self._client
            if self.cut or self._random.random() < self.drop:
                continue
            self._count += 1
            due = self.clock.now() + self.delay + self._random.uniform(0, self.jitter)
            heapq.heappush(self._queue, (due, self._count, end, data, destination(sender)))
