// Values in blocks of memory that are freed with their owner; null where there is no memory.
#pragma once

#include <cstddef>
#include <memory>
#include <new>

#include "basics/pool.hpp"

namespace minsnap {

struct Release {
    template <class Value>
    void operator()(Value *value) const {
        value->~Value();
        Pool::release(value);
    }
};

template <class Value>
using Owned = std::unique_ptr<Value, Release>;

template <class Value, class... Given>
Owned<Value> owned(Given... given) {
    static_assert(alignof(Value) <= Pool::alignment, "blocks are aligned for vectors");
    void *const block = Pool::reserve(sizeof(Value));
    return Owned<Value>(block == nullptr ? nullptr : new (block) Value(given...));
}

template <class Value>
std::unique_ptr<Value[]> owned_array(std::size_t count) {
    return std::unique_ptr<Value[]>(new (std::nothrow) Value[count]);
}

}  // namespace minsnap
