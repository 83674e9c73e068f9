// What every entry point of the library has in common.
#pragma once

#if defined(_WIN32)
#define MINSNAP_EXPORT extern "C" __declspec(dllexport)
#else
#define MINSNAP_EXPORT extern "C" __attribute__((visibility("default")))
#endif
