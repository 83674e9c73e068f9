// Blocks of memory, aligned for vectors. What is freed while a planner works stays with it, for what it needs next: once it is warm,
// nothing is allocated.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#if defined(_WIN32)
#include <malloc.h>
#endif

namespace minsnap {

class Pool {
public:
    static constexpr std::size_t alignment = 64;

    Pool() = default;
    Pool(const Pool &) = delete;
    Pool &operator=(const Pool &) = delete;
    ~Pool() {
        for (Block *kept : kept_)
            while (kept != nullptr) {
                Block *const next = kept->next;
                to_system(kept);
                kept = next;
            }
    }

    // While it lives, what this thread reserves comes from a pool, and what it releases goes there.
    class Use {
    public:
        explicit Use(Pool &pool) : before_(current) { current = &pool, pool.refused_ = false; }
        Use(const Use &) = delete;
        Use &operator=(const Use &) = delete;
        ~Use() { current = before_; }

    private:
        Pool *const before_;
    };

    // Whether the system had no memory since the pool was last put to use.
    bool refused() const { return refused_; }

    // Memory for so many bytes, which are not initialised; null where there is none.
    static void *reserve(std::size_t bytes) {
        if (bytes > SIZE_MAX / 4) return nullptr;
        if (current == nullptr) return from_system(bytes, kinds);
        const std::size_t kind = round(bytes);
        Block *const block = current->kept_[kind];
        if (block == nullptr) {
            void *const found = from_system(bytes, kind);
            if (found == nullptr) current->refused_ = true;
            return found;
        }
        current->kept_[kind] = block->next;
        return reinterpret_cast<char *>(block) + alignment;
    }

    static void release(void *values) {
        if (values == nullptr) return;
        Block *const block = reinterpret_cast<Block *>(static_cast<char *>(values) - alignment);
        if (current == nullptr || block->kind == kinds) return to_system(block);
        block->next = current->kept_[block->kind];
        current->kept_[block->kind] = block;
    }

private:
    // What stands before the memory that is given out.
    struct Block {
        Block *next;
        std::size_t kind;  // of its size in a pool; `kinds` where it was reserved without one
    };
    static constexpr std::size_t kinds = 4 * (8 * sizeof(std::size_t) - 8), smallest = 256;

    // Round a size up to one of four for each doubling, and say which one it is.
    static std::size_t round(std::size_t &bytes) {
        std::size_t kind = 0, size = smallest, step = smallest / 4;
        for (; size < bytes; ++kind, size += step)
            if (kind > 0 && kind % 4 == 0) step *= 2;
        bytes = size;
        return kind;
    }

    static void *from_system(std::size_t bytes, std::size_t kind) {
        void *found = nullptr;
#if defined(_WIN32)
        found = _aligned_malloc(bytes + alignment, alignment);
#else
        if (posix_memalign(&found, alignment, bytes + alignment) != 0) found = nullptr;
#endif
        if (found == nullptr) return nullptr;
        *static_cast<Block *>(found) = {nullptr, kind};
        return static_cast<char *>(found) + alignment;
    }

    static void to_system(Block *block) {
#if defined(_WIN32)
        _aligned_free(block);
#else
        std::free(block);
#endif
    }

    static inline thread_local Pool *current = nullptr;
    Block *kept_[kinds] = {};
    bool refused_ = false;
};

}  // namespace minsnap
