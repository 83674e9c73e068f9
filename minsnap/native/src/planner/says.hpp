// The last message of a planner: one sentence.
#pragma once

#include <cstdarg>
#include <cstdio>

#include "basics/status.hpp"

namespace minsnap {

class Says {
public:
    const char *text() const { return text_; }
    void nothing() { text_[0] = 0; }

    // Keep a sentence, and return the status that it is about.
#if defined(__GNUC__)
    __attribute__((format(printf, 3, 4)))
#endif
    Status operator()(Status status, const char *sentence, ...) {
        va_list values;
        va_start(values, sentence);
        std::vsnprintf(text_, sizeof text_, sentence, values);
        va_end(values);
        return status;
    }

private:
    char text_[400] = "";
};

}  // namespace minsnap
