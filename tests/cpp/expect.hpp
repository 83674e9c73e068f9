// What a test of the public header expects; how often it was wrong is its exit status.
#pragma once

#include <cstdio>

inline int wrong = 0;

#define EXPECT(condition) \
    do { \
        if (!(condition)) ++wrong, std::printf("%s:%d: %s\n", __FILE__, __LINE__, #condition); \
    } while (false)
