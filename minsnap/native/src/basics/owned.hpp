// A value on the heap that is freed with its owner; null where there is no memory.
#pragma once

#include <memory>
#include <new>

namespace minsnap {

template <class Value, class... Given>
std::unique_ptr<Value> owned(Given... given) {
    return std::unique_ptr<Value>(new (std::nothrow) Value(given...));
}

}  // namespace minsnap
