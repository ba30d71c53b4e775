// What inverse kinematics returns: joint vectors, each with the branch it lies on.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>

#include "pons/core/axes.hpp"

namespace pons::model {

// The side of each singularity that parts a six-axis arm's solutions, -1 or +1, and 0 on it: shoulder (the wrist over
// axis 1), elbow (stretched or folded), wrist (two of its axes aligned). The signs of the factors of the Jacobian's
// determinant, so an arm that stays on its branch is never singular. Which sign is "left" or "up" depends on the arm.
struct Branch {
  std::int8_t shoulder = 0, elbow = 0, wrist = 0;

  friend bool operator==(const Branch&, const Branch&) = default;
};

// Which of a pose's solutions will do.
enum class Among {
  kBranchOfSeed,  // those the arm gets to from the seed without passing a singularity
  kAllBranches,
};

struct BranchSolution {
  AxisVector q;   // rad (m where an axis slides), in the robot file's order
  Branch branch;  // of q
};

// A bounded list of solutions, in no particular order. It lives on the stack: no allocation. A six-axis arm has 16 at
// most (Primrose 1986), one with a closed form 8; the rest is room for choices that a singular pose leaves.
class BranchSolutions {
 public:
  static constexpr std::size_t kMost = 16;

  void clear() { count_ = 0; }
  // What is beyond kMost is dropped.
  void add(const BranchSolution& solution) {
    if (count_ < kMost) all_[count_++] = solution;
  }
  // The last one takes its place.
  void remove(std::size_t i) {
    assert(i < count_);
    all_[i] = all_[--count_];
  }
  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] bool empty() const { return count_ == 0; }
  [[nodiscard]] BranchSolution& operator[](std::size_t i) { return all_[i]; }
  [[nodiscard]] const BranchSolution& operator[](std::size_t i) const { return all_[i]; }
  [[nodiscard]] const BranchSolution* begin() const { return all_.data(); }
  [[nodiscard]] const BranchSolution* end() const { return all_.data() + count_; }

 private:
  std::array<BranchSolution, kMost> all_;
  std::size_t count_ = 0;
};

}  // namespace pons::model
