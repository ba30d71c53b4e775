#include "pons/runner/helper.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <thread>

namespace pons::runner {
namespace {

TEST(Helper, DoesBothOnTwoThreadsAndReturnsWhenBothAreDone) {
  Helper helper;
  std::int64_t first = 0, second = 0;  // plain: the helper's own locks must be all that it takes
  std::thread::id first_by, second_by;
  for (int i = 0; i < 1000; ++i) {
    helper.both([&] { ++first, first_by = std::this_thread::get_id(); },
                [&] { ++second, second_by = std::this_thread::get_id(); });
    ASSERT_EQ(first, i + 1);
    ASSERT_EQ(second, i + 1);
  }
  EXPECT_EQ(first_by, std::this_thread::get_id());
  EXPECT_NE(second_by, first_by);
}

TEST(Helper, EndsWithoutWork) { const Helper helper; }

}  // namespace
}  // namespace pons::runner
