// Marks what may run inside a tick: no allocation, lock, system call, exception, log or unbounded loop. Compilers that
// know the attribute check it (RealtimeSanitizer); the others ignore it.
#pragma once

#if defined(__clang__) && defined(__has_cpp_attribute)
#if __has_cpp_attribute(clang::nonblocking)
#define PONS_NONBLOCKING [[clang::nonblocking]]
#endif
#endif
#ifndef PONS_NONBLOCKING
#define PONS_NONBLOCKING
#endif
