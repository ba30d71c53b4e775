#include "pons/world/manifest.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <set>

#include "pons/world/test_folder.hpp"

namespace pons::world {
namespace {

using ::testing::HasSubstr;

constexpr std::string_view kHeader = "parcel_id,destination,kind,length_m,width_m,height_m,mass_kg,priority\n";
constexpr std::string_view kRow = "P000001,chute_3,box,0.3,0.2,0.1,1.5,50\n";

class ManifestFile : public ::testing::Test {
 protected:
  void SetUp() override {
    auto loaded = load("worlds", "parcel_cell");
    ASSERT_TRUE(loaded) << loaded.error().line();
    world_ = *loaded;
  }
  Expected<Manifest> read(std::string_view text) { return read_manifest(folder_.write("orders.csv", text), world_); }
  std::string error(const std::string& text) {
    const auto manifest = read(text);
    return manifest ? "no error" : manifest.error().line();
  }
  // The error that one row makes under the right header.
  std::string row_error(const std::string& row) { return error(std::string(kHeader) + row); }

  World world_;
  TestFolder folder_;
};

TEST_F(ManifestFile, ReadsRows) {
  const auto manifest = read(std::string(kHeader) + std::string(kRow) + "A-1,chute_8,tube,0.4,0.08,0.08,0.05,100\r\n");
  ASSERT_TRUE(manifest) << manifest.error().line();
  ASSERT_EQ(manifest->size(), 2U);
  EXPECT_EQ((*manifest)[0].parcel_id, "P000001");
  EXPECT_EQ((*manifest)[0].destination, "chute_3");
  EXPECT_EQ((*manifest)[0].kind, ParcelKind::kBox);
  EXPECT_EQ((*manifest)[0].size_m, Vector3(0.3, 0.2, 0.1));
  EXPECT_EQ((*manifest)[0].mass_kg, 1.5);
  EXPECT_EQ((*manifest)[0].priority, 50);
  EXPECT_EQ((*manifest)[1].kind, ParcelKind::kTube);
  EXPECT_EQ((*manifest)[1].priority, 100);
}

TEST_F(ManifestFile, TakesColumnsInAnyOrder) {
  const auto manifest = read(
      "\xEF\xBB\xBFpriority,mass_kg,height_m,width_m,length_m,kind,destination,parcel_id\n"
      "7,2.5,0.1,0.2,0.3,bag,chute_1,X\n");
  ASSERT_TRUE(manifest) << manifest.error().line();
  EXPECT_EQ((*manifest)[0].parcel_id, "X");
  EXPECT_EQ((*manifest)[0].size_m, Vector3(0.3, 0.2, 0.1));
  EXPECT_EQ((*manifest)[0].mass_kg, 2.5);
  EXPECT_EQ((*manifest)[0].priority, 7);
}

TEST_F(ManifestFile, ReadsOverRowsWithoutAWord) {
  const auto manifest = read(std::string(kHeader) + "\n" + std::string(kRow) + ",,,,,,,\n  \n");
  ASSERT_TRUE(manifest) << manifest.error().line();
  EXPECT_EQ(manifest->size(), 1U);
}

TEST_F(ManifestFile, RefusesABrokenHeader) {
  EXPECT_THAT(error("parcel_id,destination,kind,length_m,width_m,height_m,priority\nA,chute_1,box,0.3,0.2,0.1,5\n"),
              HasSubstr("orders.csv:1: column 'mass_kg' is missing; the columns are parcel_id,destination,"));
  EXPECT_THAT(error("parcel_id,colour\n"), HasSubstr("orders.csv:1: unknown column 'colour'"));
  EXPECT_THAT(error("parcel_id;destination\n"), HasSubstr("orders.csv:1: the columns are separated by ';'; the colu"));
  EXPECT_THAT(error("parcel_id\tdestination\n"), HasSubstr("separated by tabs"));
  EXPECT_THAT(error(std::string("\xFF\xFEp\0a\0", 6)), HasSubstr("orders.csv: the text is UTF-16; save"));
  EXPECT_THAT(error("parcel_id,parcel_id\n"), HasSubstr("orders.csv:1: column 'parcel_id' is there twice"));
}

TEST_F(ManifestFile, RefusesAFileWithoutParcels) {
  EXPECT_THAT(error(""), HasSubstr("orders.csv: the file is empty; begin with parcel_id,destination"));
  EXPECT_THAT(error(std::string(kHeader)), HasSubstr("orders.csv: there is a header and no row"));
  EXPECT_THAT(read_manifest(folder_.path() / "none.csv", world_).error().line(), HasSubstr("there is no such file"));
}

TEST_F(ManifestFile, NamesBothLinesOfADuplicate) {
  EXPECT_THAT(row_error(std::string(kRow) + "B,chute_1,box,0.3,0.2,0.1,1,5\n" + std::string(kRow)),
              HasSubstr("orders.csv:4:parcel_id: parcel_id 'P000001' is also on line 2; give each"));
}

TEST_F(ManifestFile, RefusesImpossibleNumbers) {
  for (const std::string_view bad :
       {"-1", "0", "nan", "NaN", "inf", "-inf", "1e999", "abc", "", "1,5", "0x1", "1.0kg", " 1"}) {
    for (const int column : {3, 4, 5, 6}) {
      std::array<std::string, 8> fields{"A", "chute_1", "box", "0.3", "0.2", "0.1", "1", "5"};
      fields[static_cast<std::size_t>(column)] = fmt::format("\"{}\"", bad);
      const std::string line = row_error(fmt::format("{}\n", fmt::join(fields, ",")));
      const std::array names{"", "", "", "length_m", "width_m", "height_m", "mass_kg"};
      EXPECT_THAT(line, HasSubstr(fmt::format("orders.csv:2:{}: ", names[static_cast<std::size_t>(column)]))) << bad;
      EXPECT_THAT(line, HasSubstr("write a number from")) << bad;
    }
  }
  EXPECT_THAT(row_error("A,chute_1,box,0.3,0.05,0.1,1,5\n"), HasSubstr("orders.csv:2:width_m: 0.05 is out of range"));
}

TEST_F(ManifestFile, RefusesUnknownWordsWithTheChoices) {
  EXPECT_THAT(
      row_error("A,chute_9,box,0.3,0.2,0.1,1,5\n"),
      HasSubstr("orders.csv:2:destination: there is no chute 'chute_9' in parcel_cell; choose from chute_1, chute_2"));
  EXPECT_THAT(row_error("A,exception,box,0.3,0.2,0.1,1,5\n"), HasSubstr("there is no chute 'exception'"));
  EXPECT_THAT(row_error("A,chute_1,crate,0.3,0.2,0.1,1,5\n"),
              HasSubstr("orders.csv:2:kind: there is no kind 'crate'; choose from box, mailer, tube, bag"));
}

TEST_F(ManifestFile, RefusesPrioritiesAndIdsOutOfRange) {
  for (const std::string_view bad : {"-1", "101", "5.5", "high", "", "99999999999"}) {
    EXPECT_THAT(row_error(fmt::format("A,chute_1,box,0.3,0.2,0.1,1,{}\n", bad)), HasSubstr("orders.csv:2:priority: "))
        << bad;
  }
  for (const std::string_view bad : {"", "abc", "A B", "123456789012345", "Ä", "A_1"}) {
    EXPECT_THAT(row_error(fmt::format("{},chute_1,box,0.3,0.2,0.1,1,5\n", bad)), HasSubstr("orders.csv:2:parcel_id: "))
        << bad;
  }
}

TEST_F(ManifestFile, RefusesRowsOfAnotherLength) {
  EXPECT_THAT(row_error("A,chute_1,box,0.3,0.2,0.1,1\n"), HasSubstr("orders.csv:2: 7 fields instead of 8"));
  EXPECT_THAT(row_error("A,chute_1,box,0.3,0.2,0.1,1,5,\n"), HasSubstr("orders.csv:2: 9 fields instead of 8"));
}

TEST_F(ManifestFile, RefusesAnotherEncodingAndALongLine) {
  EXPECT_THAT(row_error("A,M\xFCnchen,box,0.3,0.2,0.1,1,5\n"), HasSubstr("orders.csv:2: the text is not UTF-8; save"));
  EXPECT_THAT(row_error(std::string(2 << 20, 'A')), HasSubstr("orders.csv:2: the line is longer than 1 MiB"));
}

TEST_F(ManifestFile, RefusesMoreThanAMillionRows) {
  std::string text(kHeader);
  for (std::size_t i = 0; i <= kMaxParcels; ++i) text += fmt::format("A{},chute_1,box,0.3,0.2,0.1,1,5\n", i);
  EXPECT_THAT(error(text), HasSubstr("orders.csv:1000002: more than 1000000 rows"));
}

class Draw : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    auto loaded = load("worlds", GetParam());
    ASSERT_TRUE(loaded) << loaded.error().line();
    world_ = *loaded;
  }
  Manifest draw(std::int64_t count, std::uint64_t seed) {
    auto drawn = draw_manifest(world_, count, seed);
    EXPECT_TRUE(drawn) << drawn.error().line();
    return drawn.value_or(Manifest{});
  }

  World world_;
};

std::string as_csv(const Manifest& manifest) {
  std::string text(kHeader);
  for (const ManifestRow& row : manifest) {
    text += fmt::format("{},{},{},{},{},{},{},{}\n", row.parcel_id, row.destination, name(row.kind), row.size_m.x(),
                        row.size_m.y(), row.size_m.z(), row.mass_kg, row.priority);
  }
  return text;
}

TEST_P(Draw, SameSeedSameRows) {
  const std::string first = as_csv(draw(500, 42));
  EXPECT_EQ(first, as_csv(draw(500, 42)));
  EXPECT_NE(first, as_csv(draw(500, 43)));
  EXPECT_TRUE(as_csv(draw(800, 42)).starts_with(first));
}

TEST_P(Draw, WhatIsDrawnCanBeReadBack) {
  const TestFolder folder;
  const std::string text = as_csv(draw(2000, 7));
  const auto read = read_manifest(folder.write("orders.csv", text), world_);
  ASSERT_TRUE(read) << read.error().line();
  EXPECT_EQ(as_csv(*read), text);
}

TEST_P(Draw, KeepsTheMix) {
  constexpr int kCount = 40000;
  std::map<ParcelKind, int> kinds;
  std::map<std::string, int> destinations;
  std::set<std::string> ids;
  int overweight = 0, oversize = 0, express = 0;
  for (const ManifestRow& row : draw(kCount, 1)) {
    ++kinds[row.kind];
    ++destinations[row.destination];
    ids.insert(row.parcel_id);
    overweight += row.mass_kg > world_.rules.max_mass_kg;
    oversize += row.size_m.maxCoeff() > world_.rules.max_size_m;
    express += row.priority >= 80;
  }
  // Four standard deviations of the count of a share.
  const auto expect_share = [](int count, double share, std::string_view what) {
    EXPECT_NEAR(count, kCount * share, 4 * std::sqrt(kCount * share * (1 - share))) << what;
  };
  const Arrivals& mix = world_.arrivals;
  const double box = mix.box + mix.overweight * (1 - mix.box);
  expect_share(kinds[ParcelKind::kBox], box, "boxes");
  expect_share(kinds[ParcelKind::kMailer], mix.mailer * (1 - mix.overweight), "mailers");
  expect_share(kinds[ParcelKind::kTube], mix.tube * (1 - mix.overweight), "tubes");
  expect_share(kinds[ParcelKind::kBag], mix.bag * (1 - mix.overweight), "bags");
  expect_share(overweight, mix.overweight, "overweight");
  expect_share(oversize, mix.oversize, "oversize");
  expect_share(express, mix.express, "express");
  const auto chutes = std::ranges::count(world_.places, PlaceKind::kChute, &Place::kind);
  EXPECT_EQ(static_cast<std::ptrdiff_t>(destinations.size()), chutes);
  for (const auto& [destination, count] : destinations)
    expect_share(count, 1.0 / static_cast<double>(chutes), destination);
  EXPECT_EQ(ids.size(), static_cast<std::size_t>(kCount));
}

TEST_P(Draw, ParcelsAreOfThisWorld) {
  const Arrivals& mix = world_.arrivals;
  for (const ManifestRow& row : draw(20000, 3)) {
    SCOPED_TRACE(fmt::format("{} {} {}x{}x{} {}", row.parcel_id, name(row.kind), row.size_m.x(), row.size_m.y(),
                             row.size_m.z(), row.mass_kg));
    const bool oversize = row.size_m.x() > world_.rules.max_size_m;
    ASSERT_GE(row.size_m.x(), mix.length_min_m);
    ASSERT_LE(row.size_m.x(), oversize ? 1.26 * world_.rules.max_size_m : mix.length_max_m);
    ASSERT_GE(row.size_m.y(), mix.length_min_m);
    ASSERT_LE(row.size_m.y(), row.size_m.x());
    ASSERT_GE(row.size_m.z(), 0.02);
    ASSERT_LE(row.size_m.z(), 1.2 * row.size_m.y()) << "would topple";
    ASSERT_GE(row.mass_kg, mix.mass_min_kg);
    ASSERT_LE(row.mass_kg, mix.max_mass_kg);
    const bool between = row.mass_kg > mix.mass_max_kg && row.mass_kg < 1.09 * world_.rules.max_mass_kg;
    ASSERT_FALSE(between) << "neither light enough nor plainly overweight";
    if (row.kind == ParcelKind::kTube) {
      ASSERT_EQ(row.size_m.y(), row.size_m.z());
    }
  }
}

TEST_P(Draw, RefusesImpossibleCounts) {
  for (const std::int64_t count :
       {std::int64_t{0}, std::int64_t{-1}, std::int64_t{1'000'001}, std::int64_t{1'000'000'000}}) {
    const auto drawn = draw_manifest(world_, count, 1);
    ASSERT_FALSE(drawn);
    EXPECT_EQ(drawn.error().line(), fmt::format("parcels: {} parcels cannot be drawn; ask for 1 to 1000000", count));
  }
  EXPECT_EQ(draw(1, 1).size(), 1U);
}

INSTANTIATE_TEST_SUITE_P(Worlds, Draw, ::testing::Values("parcel_cell", "small_cell"),
                         [](const auto& instance) { return instance.param; });

}  // namespace
}  // namespace pons::world
