// A block of memory, aligned for vectors, whose allocation may fail without an exception: the caller asks and returns Status::no_memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <utility>
#if defined(_WIN32)
#include <malloc.h>
#endif

namespace minsnap {

template <class Value>
class Buffer {
public:
    Buffer() = default;
    Buffer(const Buffer &) = delete;
    Buffer &operator=(const Buffer &) = delete;
    ~Buffer() { release(values_); }

    // Make room for count values (not initialised); what was held before is lost. False if there is no memory.
    [[nodiscard]] bool allocate(std::size_t count) {
        if (count <= count_) return true;
        if (count > SIZE_MAX / sizeof(Value)) return false;
        void *fresh = reserve(count * sizeof(Value));
        if (fresh == nullptr) return false;
        release(values_);
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
    static constexpr std::size_t alignment = 64;

    static void *reserve(std::size_t bytes) {
#if defined(_WIN32)
        return _aligned_malloc(bytes, alignment);
#else
        void *found = nullptr;
        return posix_memalign(&found, alignment, bytes) == 0 ? found : nullptr;
#endif
    }

    static void release(void *block) {
#if defined(_WIN32)
        _aligned_free(block);
#else
        std::free(block);
#endif
    }

    Value *values_ = nullptr;
    std::size_t count_ = 0;
};

}  // namespace minsnap
