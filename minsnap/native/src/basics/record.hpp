// How a struct of the border is declared: once, and with its own text beside it, by which Python lays it out.
#pragma once

#include <cstdint>

namespace minsnap {

// What the library tells of a struct; comments are no part of the text.
struct RecordText {
    const char *name, *fields;
    std::int64_t size;
};

}  // namespace minsnap

#define MINSNAP_RECORD(name, ...) \
    struct name __VA_ARGS__; \
    constexpr minsnap::RecordText name##_text = {#name, #__VA_ARGS__, sizeof(name)}
