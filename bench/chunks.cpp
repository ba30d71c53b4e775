// What it costs to splice a chunk of actions into the motion, which happens within a bridge tick of 10 ms.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "pons/core/random.hpp"
#include "pons/motion/chunks.hpp"

namespace {

using namespace pons;
using std::chrono::milliseconds;

constexpr Eigen::Index kAxes = 7;
constexpr int kStreams = 200, kChunks = 50;

// A policy of 20 actions, 50 ms apart, asked every 200 ms; `jump_rad` (1 σ) lies between one chunk and the next.
void measure(double jump_rad) {
  AxisLimits limits;
  limits.position_min = AxisVector::Constant(kAxes, -3);
  limits.position_max = AxisVector::Constant(kAxes, 3);
  limits.speed_rad_s = AxisVector::Constant(kAxes, 2);
  limits.acceleration_rad_s2 = AxisVector::Constant(kAxes, 10);
  limits.jerk_rad_s3 = AxisVector::Constant(kAxes, 200);
  Random random(1);
  std::vector<double> us;
  int refused = 0;
  for (int stream = 0; stream < kStreams; ++stream) {
    motion::ChunkPath path(AxisVector::Zero(kAxes), Time{}, 0);
    const double turn = random.uniform(0.5, 2);
    for (int i = 0; i < kChunks; ++i) {
      const Time now{milliseconds(200) * i};
      Chunk chunk{.observed = path.executed(now), .period = milliseconds(50)};
      const double jump = jump_rad * random.normal();
      for (std::int64_t j = 1; j <= 20; ++j) {
        const double phase = turn * 0.05 * (chunk.observed + static_cast<double>(j));
        chunk.actions.emplace_back(AxisVector::Constant(kAxes, 0.4 * std::sin(phase) + jump));
      }
      const auto begun = std::chrono::steady_clock::now();
      const auto way = path.splice(chunk, now, now + milliseconds(20), limits);
      us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begun).count());
      refused += way ? 0 : 1;
    }
  }
  std::ranges::sort(us);
  const auto at = [&](double share) {
    return us[static_cast<std::size_t>(share * static_cast<double>(us.size() - 1))];
  };
  fmt::print("jumps of {:.2f} rad: median {:.0f} µs, 99 % {:.0f}, worst {:.0f}; {} of {} not joined\n", jump_rad,
             at(0.5), at(0.99), at(1), refused, us.size());
}

}  // namespace

int main() {
  for (const double jump_rad : {0.0, 0.02, 0.1}) measure(jump_rad);
}
