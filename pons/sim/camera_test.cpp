#define ZX_USE_UTF8 1
#include <ZXing/ReadBarcode.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>
#include <thread>

#include "pons/sim/simulation.hpp"
#include "pons/sim/truth.hpp"

namespace pons::sim {
namespace {

world::World load_cell() {
  auto world = world::load("worlds", "parcel_cell");
  if (!world) throw std::runtime_error(world.error().line());
  return *world;
}

world::Manifest one_box() {
  world::ManifestRow row;
  row.parcel_id = "P000001";
  row.destination = "chute_2";
  row.size_m = Vector3(0.30, 0.20, 0.15);
  row.mass_kg = 1;
  return {row};
}

std::unique_ptr<Simulation> create(const world::World& world) {
  auto simulation = Simulation::create(world, one_box(), 5);
  if (!simulation) throw std::runtime_error(simulation.error().line());
  (*simulation)->run_belt();
  return std::move(*simulation);
}

RgbdFrame shoot(Simulation& simulation, std::size_t camera, Time now) {
  RgbdFrame frame;
  simulation.cameras()[camera]->begin(now);
  auto finished = simulation.cameras()[camera]->finish(frame);
  if (!finished) throw std::runtime_error(finished.error().line());
  return frame;
}

// Pixel that sees the point, rounded; -1 outside.
int pixel_of(const RgbdFrame& frame, const Vector3& point) {
  const Vector3 p = frame.world_from_optical.inverse() * point;
  const int u = static_cast<int>(std::lround(frame.intrinsics.fx * p.x() / p.z() + frame.intrinsics.cx));
  const int v = static_cast<int>(std::lround(frame.intrinsics.fy * p.y() / p.z() + frame.intrinsics.cy));
  if (u < 0 || v < 0 || u >= frame.intrinsics.width || v >= frame.intrinsics.height) return -1;
  return v * frame.intrinsics.width + u;
}

TEST(Camera, MeasuresTheTopOfAParcelWithinItsNoise) {
  const world::World world = load_cell();
  auto simulation = create(world);
  const Truth truth(*simulation);
  Time now;
  while (now < Time(from_s(10)) && !(truth.top(0) && truth.top(0)->translation().x() > -0.85)) {
    now += from_s(0.02);
    simulation->advance_to(now);
  }
  const RgbdFrame frame = shoot(*simulation, 0, now);
  ASSERT_EQ(frame.depth_m.size(), static_cast<std::size_t>(frame.intrinsics.width * frame.intrinsics.height));
  const Pose top = *truth.top(0);
  double sum = 0, squares = 0;
  int readings = 0, asked = 0;
  for (double x = -0.13; x <= 0.13; x += 0.004) {
    for (double y = -0.08; y <= 0.08; y += 0.004) {
      const Vector3 point = top * Vector3(x, y, 0);
      const int pixel = pixel_of(frame, point);
      if (pixel < 0) continue;
      ++asked;
      const double measured = static_cast<double>(frame.depth_m[static_cast<std::size_t>(pixel)]);
      if (measured == 0) continue;
      const double error = measured - (frame.world_from_optical.inverse() * point).z();
      sum += error;
      squares += error * error;
      ++readings;
    }
  }
  ASSERT_GT(readings, 1000);
  const double z = frame.world_from_optical.translation().z() - top.translation().z();
  const double sigma = world.cameras[0].depth_noise_m * z * z;
  EXPECT_NEAR(sum / readings, 0, 0.15 * sigma + 0.0002);
  EXPECT_NEAR(std::sqrt(squares / readings), sigma, 0.2 * sigma);
  const double dropped = 1.0 - static_cast<double>(readings) / asked;
  EXPECT_NEAR(dropped, world.cameras[0].depth_dropout, 0.6 * world.cameras[0].depth_dropout);
}

TEST(Camera, ParcelEdgesLieWhereTheIntrinsicsPutThem) {
  auto simulation = create(load_cell());
  const Truth truth(*simulation);
  Time now;
  while (now < Time(from_s(10)) && !(truth.top(0) && truth.top(0)->translation().x() > -0.7)) {
    now += from_s(0.02);
    simulation->advance_to(now);
  }
  const RgbdFrame frame = shoot(*simulation, 1, now);
  const Pose top = *truth.top(0);
  const auto height_at = [&](const Vector3& point) {
    const int pixel = pixel_of(frame, point);
    const double z = pixel < 0 ? 0 : static_cast<double>(frame.depth_m[static_cast<std::size_t>(pixel)]);
    return z == 0 ? -1.0 : frame.world_from_optical.translation().z() - z;
  };
  int inside = 0, outside = 0, seen = 0;
  for (double along = -0.06; along <= 0.06; along += 0.002) {
    for (const double side : {-1.0, 1.0}) {
      const double in = height_at(top * Vector3(side * 0.147, along, 0));
      const double out = height_at(top * Vector3(side * 0.153, along, 0));
      if (in < 0 || out < 0) continue;
      ++seen;
      inside += in > top.translation().z() - 0.02 ? 1 : 0;
      outside += out < top.translation().z() - 0.02 ? 1 : 0;
    }
  }
  ASSERT_GT(seen, 60);
  EXPECT_EQ(inside, seen) << "3 mm inside the edge is the top";
  EXPECT_EQ(outside, seen) << "3 mm outside is not";
}

// What the label camera reads in half a minute without the arm moving, and the ids of parcels that have passed it.
struct Reading {
  std::set<std::string> codes, passed;
};

Reading read_labels(const world::World& world, std::uint64_t seed) {
  auto manifest = world::draw_manifest(world, 20, seed);
  if (!manifest) throw std::runtime_error(manifest.error().line());
  auto simulation = Simulation::create(world, *manifest, seed);
  if (!simulation) throw std::runtime_error(simulation.error().line());
  (*simulation)->run_belt();
  const Truth truth(**simulation);
  const auto hints = ZXing::DecodeHints().setFormats(ZXing::BarcodeFormat::QRCode);
  Reading reading;
  for (Time now(from_s(2)); now < Time(from_s(30)); now += from_s(0.8)) {
    (*simulation)->advance_to(now);
    const RgbdFrame frame = shoot(**simulation, 1, now);
    const ZXing::ImageView image(frame.rgb.data(), frame.intrinsics.width, frame.intrinsics.height,
                                 ZXing::ImageFormat::RGB);
    for (const ZXing::Result& code : ZXing::ReadBarcodes(image, hints)) {
      if (code.isValid()) reading.codes.insert(code.text());
    }
  }
  for (std::size_t i = 0; i < truth.parcels().size(); ++i) {
    const auto top = truth.top(i);
    const bool offered = truth.parcels()[i].where != Whereabouts::kNotOffered;
    if (offered && (!top || top->translation().x() > 0.2)) reading.passed.insert(truth.parcels()[i].parcel_id);
  }
  return reading;
}

TEST(Camera, EveryReadableLabelThatPassesIsRead) {
  world::World world = load_cell();
  world.arrivals.unreadable = 0;
  const Reading reading = read_labels(world, 11);
  EXPECT_GT(reading.passed.size(), 5U);
  for (const std::string& id : reading.passed) EXPECT_TRUE(reading.codes.contains(id)) << id;
}

TEST(Camera, NoUnreadableLabelGivesItsParcelAway) {
  world::World world = load_cell();
  world.arrivals.unreadable = 1;
  const Reading reading = read_labels(world, 11);
  EXPECT_GT(reading.passed.size(), 5U);
  EXPECT_FALSE(reading.codes.empty()) << "some carry a code that no row has";
  for (const std::string& code : reading.codes) EXPECT_TRUE(code.starts_with("X")) << code;
}

TEST(Camera, FinishesOnAnotherThreadWhatWasTakenOnThisOne) {
  auto simulation = create(load_cell());
  simulation->advance_to(Time(from_s(3)));
  const RgbdFrame here = shoot(*simulation, 0, Time(from_s(3)));
  RgbdFrame there;
  bool finished = false;
  simulation->cameras()[0]->begin(Time(from_s(3)));
  std::thread other([&] { finished = simulation->cameras()[0]->finish(there).has_value(); });
  simulation->advance_to(Time(from_s(3.5)));
  other.join();
  ASSERT_TRUE(finished);
  EXPECT_EQ(here.rgb, there.rgb);
  EXPECT_EQ(here.depth_m, there.depth_m);
}

TEST(Camera, HalvesOfAPictureMakeTheWholeWhoeverDoesThem) {
  auto simulation = create(load_cell());
  simulation->advance_to(Time(from_s(3)));
  const RgbdFrame alone = shoot(*simulation, 1, Time(from_s(3)));
  int lent = 0;
  simulation->lend([&](const auto& first, const auto& second) {
    ++lent;
    std::thread other(second);
    first();
    other.join();
  });
  const RgbdFrame helped = shoot(*simulation, 1, Time(from_s(3)));
  EXPECT_EQ(lent, 1);
  EXPECT_EQ(alone.rgb, helped.rgb);
  EXPECT_EQ(alone.depth_m, helped.depth_m);
}

TEST(Camera, FinishWithoutBeginIsAnError) {
  auto simulation = create(load_cell());
  RgbdFrame frame;
  EXPECT_FALSE(simulation->cameras()[0]->finish(frame));
}

TEST(Camera, MissingGraphicsLibraryIsNamed) {
  setenv("PONS_EGL", "libNoSuchEGL.so.1", 1);
  auto simulation = Simulation::create(load_cell(), one_box(), 5);
  unsetenv("PONS_EGL");
  ASSERT_FALSE(simulation);
  EXPECT_EQ(simulation.error().where, "libNoSuchEGL.so.1");
  EXPECT_NE(simulation.error().mend.find("libegl1"), std::string::npos);
}

TEST(Camera, PictureHasTheSizeAskedForAndIsNotEmpty) {
  auto simulation = create(load_cell());
  auto picture = simulation->picture(320, 200);
  ASSERT_TRUE(picture) << picture.error().line();
  ASSERT_EQ(picture->size(), 320UL * 200 * 3);
  const auto [darkest, brightest] = std::minmax_element(picture->begin(), picture->end());
  EXPECT_LT(*darkest, 80);
  EXPECT_GT(*brightest, 180);
}

}  // namespace
}  // namespace pons::sim
