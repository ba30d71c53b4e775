// Two pieces of work at once, for parts that start no thread: whoever owns threads lends one.
#pragma once

#include <functional>

namespace pons {

// Does both, in any order or at the same time, and returns when both are done. Neither may throw.
using Both = std::function<void(const std::function<void()>& first, const std::function<void()>& second)>;

inline void one_after_the_other(const std::function<void()>& first, const std::function<void()>& second) {
  first();
  second();
}

}  // namespace pons
