// For this folder's tests.
#pragma once

#include <gtest/gtest.h>

#include <utility>

#include "pons/world/world.hpp"

namespace pons::skills {

// The real one, from the checkout's root.
inline world::World parcel_cell() {
  auto world = world::load("worlds", "parcel_cell");
  EXPECT_TRUE(world) << world.error().line();
  return std::move(*world);
}

}  // namespace pons::skills
