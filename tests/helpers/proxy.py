"""A bad network between two UDP endpoints: datagrams that are dropped, delayed and, if asked, cut off."""

import heapq
import random
import socket
import threading
import time


class Proxy:
    """Forwards what comes to its port to another, and the answers back."""

    def __init__(self, port, drop=0.0, delay=0.0, jitter=0.0, seed=1):
        self.target = ("127.0.0.1", port)
        self.drop, self.delay, self.jitter = drop, delay, jitter
        self.cut = False
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
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stop.set()
        self._thread.join()
        self._front.close()
        self._back.close()

    def _run(self):
        while not self._stop.is_set():
            self._take(self._front, self._back, lambda sender: self.target)
            self._take(self._back, self._front, lambda sender: self._client)
            while self._queue and self._queue[0][0] <= time.monotonic():
                _, _, end, data, where = heapq.heappop(self._queue)
                if where is not None:
                    end.sendto(data, where)
            time.sleep(0.0005)

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
            due = time.monotonic() + self.delay + self._random.uniform(0, self.jitter)
            heapq.heappush(self._queue, (due, self._count, end, data, destination(sender)))
