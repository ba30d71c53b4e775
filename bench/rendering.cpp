// What a frame costs: colour and depth of the parcel cell with parcels on the belt, median of many, by size.

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <vector>

#include "apps/paths.hpp"
#include "pons/sim/simulation.hpp"
#include "pons/world/manifest.hpp"
#include "pons/world/world.hpp"

namespace {

using namespace pons;
using Clock = std::chrono::steady_clock;

template <typename T>
T must(Expected<T> result) {
  if (result) return std::move(*result);
  fmt::print(stderr, "rendering: {}\n", result.error().line());
  std::exit(2);
}

}  // namespace

int main() {
  world::World world = must(world::load(apps::worlds_folder(), "parcel_cell"));
  const world::CameraSpec overhead = world.cameras.front();
  world.cameras.clear();
  for (const auto& [width, height] : {std::pair{320, 240}, {640, 480}, {1280, 960}}) {
    world::CameraSpec camera = overhead;
    camera.name = fmt::format("{}x{}", width, height);
    camera.width = width;
    camera.height = height;
    world.cameras.push_back(camera);
  }
  const auto manifest = must(world::draw_manifest(world, 20, 1));
  const auto simulation = must(sim::Simulation::create(world, manifest, 1));
  simulation->run_belt();
  simulation->advance_to(Time(from_s(4)));
  RgbdFrame frame;
  for (std::size_t i = 0; i < world.cameras.size(); ++i) {
    std::vector<double> ms;
    for (int round = 0; round < 40; ++round) {
      const auto begin = Clock::now();
      simulation->cameras()[i]->begin(Time(from_s(4)));
      if (!simulation->cameras()[i]->finish(frame)) return 2;
      ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
    }
    std::sort(ms.begin(), ms.end());
    fmt::print("{:<10} median {:.1f} ms, 95 % {:.1f} ms\n", world.cameras[i].name, ms[ms.size() / 2],
               ms[ms.size() * 95 / 100]);
  }
}
