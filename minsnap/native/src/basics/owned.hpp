// Values on the heap that are freed with their owner; null where there is no memory.
#pragma once

#include <cstddef>
#include <memory>
#include <new>

namespace minsnap {

template <class Value, class... Given>
std::unique_ptr<Value> owned(Given... given) {
    return std::unique_ptr<Value>(new (std::nothrow) Value(given...));
}

template <class Value>
std::unique_ptr<Value[]> owned_array(std::size_t count) {
    return std::unique_ptr<Value[]>(new (std::nothrow) Value[count]);
}

}  // namespace minsnap
