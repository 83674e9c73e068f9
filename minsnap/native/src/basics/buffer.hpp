// A block of memory, aligned for vectors, whose allocation may fail without an exception: the caller asks and returns Status::no_memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "basics/pool.hpp"

namespace minsnap {

template <class Value>
class Buffer {
public:
    Buffer() = default;
    Buffer(const Buffer &) = delete;
    Buffer &operator=(const Buffer &) = delete;
    ~Buffer() { Pool::release(values_); }

    // Make room for count values (not initialised); what was held before is lost. False if there is no memory.
    [[nodiscard]] bool allocate(std::size_t count) {
        if (count <= count_) return true;
        if (count > SIZE_MAX / sizeof(Value)) return false;
        void *fresh = Pool::reserve(count * sizeof(Value));
        if (fresh == nullptr) return false;
        Pool::release(values_);
        values_ = static_cast<Value *>(fresh);
        count_ = count;
        return true;
    }

    void swap(Buffer &other) {
        std::swap(values_, other.values_);
        std::swap(count_, other.count_);
    }

    Value *data() { return values_; }
    const Value *data() const { return values_; }
    std::size_t capacity() const { return count_; }
    Value &operator[](std::size_t index) { return values_[index]; }
    const Value &operator[](std::size_t index) const { return values_[index]; }

private:
    Value *values_ = nullptr;
    std::size_t count_ = 0;
};

}  // namespace minsnap
