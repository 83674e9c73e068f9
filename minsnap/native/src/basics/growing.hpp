// A list that grows, of plain values, whose growth may fail without an exception.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <type_traits>

namespace minsnap {

template <class Value>
class Growing {
    static_assert(std::is_trivially_copyable<Value>::value, "values are moved as bytes");

public:
    Growing() = default;
    Growing(const Growing &) = delete;
    Growing &operator=(const Growing &) = delete;
    ~Growing() { std::free(values_); }

    [[nodiscard]] bool add(const Value &value) {
        if (count_ == room_ && !widen()) return false;
        values_[count_++] = value;
        return true;
    }
    void clear() { count_ = 0; }

    std::size_t size() const { return count_; }
    Value &operator[](std::size_t index) { return values_[index]; }
    const Value &operator[](std::size_t index) const { return values_[index]; }
    const Value *begin() const { return values_; }
    const Value *end() const { return values_ + count_; }

private:
    bool widen() {
        const std::size_t room = room_ == 0 ? 64 : 2 * room_;
        void *fresh = std::realloc(static_cast<void *>(values_), room * sizeof(Value));
        if (fresh == nullptr) return false;
        values_ = static_cast<Value *>(fresh);
        room_ = room;
        return true;
    }

    Value *values_ = nullptr;
    std::size_t count_ = 0, room_ = 0;
};

}  // namespace minsnap
