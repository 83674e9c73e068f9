// A thread that sends prepared MAVLink 2 messages at their instants and does nothing else.
//
// Another thread keeps a ring of prepared slots filled ahead of time; this one waits for the next slot's instant, stamps
// the sequence number and the checksum, and sends.  All memory is taken when it is opened.  It asks for a real-time
// priority, and works without one.
#include <cstdint>

#include "basics/export.hpp"
#include "basics/owned.hpp"
#include "basics/status.hpp"

#if defined(__linux__)
#include <arpa/inet.h>
#include <netinet/in.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>

namespace minsnap {
namespace {

constexpr int ring_size = 256, longest = 280, record_count = 4096, priority = 10;
constexpr std::uint8_t magic = 0xFD;  // of MAVLink 2
constexpr int header = 10, sequence_at = 4;

struct Slot {
    std::int64_t number;  // -1: empty
    std::int32_t length;  // 0: a slot in which nothing is to be sent
    std::uint8_t flying;  // a setpoint of the flight, which must not follow a long gap
    std::uint8_t bytes[longest];
};

struct Record {
    std::int64_t slot;
    double time;
};

struct Sender {
    pthread_t thread;
    pthread_mutex_t mutex;
    double rate, start, max_gap, last_served;
    std::int64_t next, generation, recorded, drained;
    int port, granted;  // port: of datagrams, or a serial one
    bool running, served;
    std::uint8_t sequence, crc_extra;
    sockaddr_in target;  // port 0: none, on a serial port
    Slot ring[ring_size];
    Record records[record_count];
};

struct Lock {
    explicit Lock(Sender *sender) : mutex(&sender->mutex) { pthread_mutex_lock(mutex); }
    ~Lock() { pthread_mutex_unlock(mutex); }
    pthread_mutex_t *mutex;
};

double monotonic() {
    timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

void sleep_until(double instant) {
    timespec until;
    until.tv_sec = time_t(std::floor(instant));
    until.tv_nsec = long((instant - std::floor(instant)) * 1e9);
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {}
}

// CRC-16/MCRF4XX over all but the magic byte, then over the extra byte of the message type (MAVLink, "Packet serialization").
void stamp(std::uint8_t *bytes, int length, std::uint8_t sequence, std::uint8_t extra) {
    std::uint16_t crc = 0xFFFF;
    auto take = [&crc](std::uint8_t byte) {
        std::uint8_t mixed = byte ^ std::uint8_t(crc & 0xFF);
        mixed ^= std::uint8_t(mixed << 4);
        crc = std::uint16_t((crc >> 8) ^ (mixed << 8) ^ (mixed << 3) ^ (mixed >> 4));
    };
    bytes[sequence_at] = sequence;
    for (int i = 1; i < length - 2; ++i) take(bytes[i]);
    take(extra);
    bytes[length - 2] = std::uint8_t(crc & 0xFF), bytes[length - 1] = std::uint8_t(crc >> 8);
}

// 2: real-time priority; 1: a higher priority among ordinary threads; 0: none.
int ask_for_priority() {
    sched_param wanted{};
    wanted.sched_priority = priority;
    if (pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted) == 0) return 2;
    const auto self = id_t(syscall(SYS_gettid));
    const int granted = setpriority(PRIO_PROCESS, self, -20) == 0 ? 1 : 0;
#if defined(SYS_sched_setattr)
    struct {  // a short slice of time puts this thread first when it wakes up (Linux 6.12 and newer)
        std::uint32_t size, policy;
        std::uint64_t flags;
        std::int32_t nice;
        std::uint32_t priority;
        std::uint64_t runtime, deadline, period;
    } slice{48, SCHED_OTHER, 0, getpriority(PRIO_PROCESS, self), 0, 100000, 0, 0};
    syscall(SYS_sched_setattr, 0, &slice, 0);
#endif
    return granted;
}

// A message that the port does not take now is lost, as in the air.
void send(const Sender *sender, const Slot &slot) {
    const auto length = std::size_t(slot.length);
    if (sender->target.sin_port == 0) {
        if (write(sender->port, slot.bytes, length) < 0) return;
    } else {
        sendto(sender->port, slot.bytes, length, MSG_DONTWAIT, reinterpret_cast<const sockaddr *>(&sender->target), sizeof sender->target);
    }
}

void empty(Sender *sender) {
    for (Slot &slot : sender->ring) slot.number = -1;
}

// Serve the slot due now; what was due before is left out.
void serve(Sender *sender) {
    const double now = monotonic();
    const auto due = std::int64_t(std::floor((now - sender->start) * sender->rate + 1e-6));
    const std::int64_t number = due > sender->next ? due : sender->next;
    Slot &slot = sender->ring[number % ring_size];
    sender->next = number + 1;
    if (slot.number != number) return;
    if (slot.flying && sender->served && now - sender->last_served > sender->max_gap) {
        ++sender->generation;  // whoever fills the ring has to look at the gap first
        empty(sender);
        return;
    }
    if (slot.length > 0) {
        stamp(slot.bytes, slot.length, sender->sequence++, sender->crc_extra);
        send(sender, slot);
    }
    slot.number = -1;
    sender->last_served = now, sender->served = true;
    if (sender->recorded - sender->drained < record_count) sender->records[sender->recorded++ % record_count] = {number, now};
}

void *run(void *argument) {
    auto *sender = static_cast<Sender *>(argument);
    prctl(PR_SET_TIMERSLACK, 1);
    const int granted = ask_for_priority();
    double due;
    {
        Lock lock(sender);
        sender->granted = granted;
        due = sender->start;
    }
    for (;;) {
        sleep_until(due);
        Lock lock(sender);
        if (!sender->running) return nullptr;
        serve(sender);
        due = sender->start + double(sender->next) / sender->rate;
    }
}

bool make_mutex(Sender *sender) {
    pthread_mutexattr_t kind;
    pthread_mutexattr_init(&kind);
    pthread_mutexattr_setprotocol(&kind, PTHREAD_PRIO_INHERIT);
    return pthread_mutex_init(&sender->mutex, &kind) == 0;
}

std::int32_t code(Status status) { return static_cast<std::int32_t>(status); }

}  // namespace
}  // namespace minsnap

// Start a thread that serves slot k at start + k / rate on CLOCK_MONOTONIC [s] through a datagram socket or a serial port.
//
// A slot of the flight that comes more than max_gap seconds after the one before is not sent, and the ring is emptied.
MINSNAP_EXPORT std::int32_t minsnap_sender_open(std::int32_t port, double rate, double start, double max_gap, std::int32_t crc_extra,
                                                std::int32_t sequence, void **opened) {
    using namespace minsnap;
    if (!(rate > 0.0 && rate <= 1e4 && start >= 0.0 && start < 1e12 && max_gap > 0.0)) return code(Status::bad_number);
    auto sender = owned<Sender>();
    if (!sender) return code(Status::no_memory);
    mlock(sender.get(), sizeof(Sender));
    sender->port = port, sender->rate = rate, sender->start = start, sender->max_gap = max_gap;
    sender->crc_extra = std::uint8_t(crc_extra), sender->sequence = std::uint8_t(sequence);
    sender->running = true, sender->granted = -1;
    empty(sender.get());
    if (!make_mutex(sender.get()) || pthread_create(&sender->thread, nullptr, run, sender.get()) != 0) return code(Status::no_memory);
    *opened = sender.release();
    return code(Status::done);
}

// Put count slots from first on into the ring, each of 280 bytes, of which lengths[k] count; address as in network order,
// and port 0 for a serial port.
//
// Slots that were served already are left out; all are refused, as NO_PROGRESS, unless the generation is the present one.
MINSNAP_EXPORT std::int32_t minsnap_sender_supply(void *opened, std::int64_t generation, std::int64_t first, std::int32_t count,
                                                  const std::uint8_t *bytes, const std::int32_t *lengths, const std::uint8_t *flying,
                                                  std::uint32_t address, std::int32_t port) {
    using namespace minsnap;
    auto *sender = static_cast<Sender *>(opened);
    if (count < 0 || count > ring_size || first < 0) return code(Status::bad_size);
    for (std::int32_t k = 0; k < count; ++k) {
        if (lengths[k] < 0 || lengths[k] > longest) return code(Status::bad_size);
        if (lengths[k] > 0 && (lengths[k] < header + 2 || bytes[k * longest] != magic)) return code(Status::unsupported);
    }
    Lock lock(sender);
    if (generation != sender->generation) return code(Status::no_progress);
    sender->target.sin_family = AF_INET;
    sender->target.sin_addr.s_addr = address, sender->target.sin_port = htons(std::uint16_t(port));
    for (std::int32_t k = 0; k < count; ++k) {
        if (first + k < sender->next) continue;
        Slot &slot = sender->ring[(first + k) % ring_size];
        slot.number = first + k, slot.length = lengths[k], slot.flying = flying[k];
        std::memcpy(slot.bytes, bytes + k * longest, std::size_t(lengths[k]));
    }
    return code(Status::done);
}

// What was served since the last call; counts: how many, the generation, the next slot, the priority that was granted.
MINSNAP_EXPORT std::int32_t minsnap_sender_drain(void *opened, std::int32_t capacity, std::int64_t *slots, double *times,
                                                 std::int64_t *counts) {
    using namespace minsnap;
    auto *sender = static_cast<Sender *>(opened);
    Lock lock(sender);
    std::int32_t count = 0;
    for (; count < capacity && sender->drained < sender->recorded; ++count, ++sender->drained) {
        const Record &record = sender->records[sender->drained % record_count];
        slots[count] = record.slot, times[count] = record.time;
    }
    counts[0] = count, counts[1] = sender->generation, counts[2] = sender->next, counts[3] = sender->granted;
    return code(Status::done);
}

// The sequence number of another message of the same system, 0 to 255.
MINSNAP_EXPORT std::int32_t minsnap_sender_sequence(void *opened) {
    auto *sender = static_cast<minsnap::Sender *>(opened);
    minsnap::Lock lock(sender);
    return sender->sequence++;
}

// Stop sending at once and end the thread; what it served may still be drained.
MINSNAP_EXPORT std::int32_t minsnap_sender_stop(void *opened) {
    using namespace minsnap;
    auto *sender = static_cast<Sender *>(opened);
    {
        Lock lock(sender);
        sender->running = false;
    }
    pthread_join(sender->thread, nullptr);
    return code(Status::done);
}

// Free a sender whose thread has ended.
MINSNAP_EXPORT std::int32_t minsnap_sender_close(void *opened) {
    using namespace minsnap;
    const Owned<Sender> sender(static_cast<Sender *>(opened));
    pthread_mutex_destroy(&sender->mutex);
    munlock(sender.get(), sizeof(Sender));
    return code(Status::done);
}

#else  // other systems send from the interpreter

using minsnap::Status;

MINSNAP_EXPORT std::int32_t minsnap_sender_open(std::int32_t, double, double, double, std::int32_t, std::int32_t, void **) {
    return static_cast<std::int32_t>(Status::unsupported);
}
MINSNAP_EXPORT std::int32_t minsnap_sender_supply(void *, std::int64_t, std::int64_t, std::int32_t, const std::uint8_t *,
                                                  const std::int32_t *, const std::uint8_t *, std::uint32_t, std::int32_t) {
    return static_cast<std::int32_t>(Status::unsupported);
}
MINSNAP_EXPORT std::int32_t minsnap_sender_drain(void *, std::int32_t, std::int64_t *, double *, std::int64_t *) {
    return static_cast<std::int32_t>(Status::unsupported);
}
MINSNAP_EXPORT std::int32_t minsnap_sender_sequence(void *) { return 0; }
MINSNAP_EXPORT std::int32_t minsnap_sender_stop(void *) { return static_cast<std::int32_t>(Status::unsupported); }
MINSNAP_EXPORT std::int32_t minsnap_sender_close(void *) { return static_cast<std::int32_t>(Status::unsupported); }

#endif
