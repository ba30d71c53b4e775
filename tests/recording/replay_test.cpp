// Whole runs that are recorded, made again, killed and spoilt.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <functional>
#include <map>
#include <set>
#include <tuple>

#include "pons/bridge/journal/journal.hpp"
#include "pons/record/mcap_check.hpp"
#include "pons/record/recorder.hpp"
#include "pons/record/test_recording.hpp"
#include "pons/wire/cdr.hpp"
#include "pons/wire/types/bridge_layer/msg/low_level_command.hpp"
#include "pons/wire/types/diagnostic_msgs/msg/diagnostic_array.hpp"
#include "pons/wire/types/pons_msgs/msg/link_command.hpp"
#include "pons/wire/types/pons_msgs/msg/object_belief_array.hpp"
#include "pons/wire/types/pons_msgs/msg/robot_state.hpp"
#include "pons/wire/types/pons_msgs/msg/task_event.hpp"
#include "pons/wire/types/pons_msgs/msg/task_status_array.hpp"
#include "pons/wire/types/sensor_msgs/msg/compressed_image.hpp"
#include "pons/wire/types/sensor_msgs/msg/joint_state.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

namespace fs = std::filesystem;
namespace mcap = record::mcap;
using record::McapReader;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using wire::sensor_msgs::msg::JointState;

using Words = std::vector<std::string>;

std::unique_ptr<McapReader> opened(const fs::path& file) {
  auto reader = McapReader::open(file);
  EXPECT_TRUE(reader) << (reader ? "" : reader.error().line());
  return reader ? std::move(*reader) : nullptr;
}

bool whole(const fs::path& file) {
  const auto source = record::open_file(file);
  const auto verdict = source ? record::check(**source) : Expected<record::Verdict>(std::unexpected(source.error()));
  EXPECT_TRUE(verdict) << (verdict ? "" : verdict.error().line());
  return verdict && verdict->whole();
}

std::map<std::string, std::uint64_t> counts_of(const fs::path& file) {
  std::map<std::string, std::uint64_t> counts;
  for (const auto& each : record::read_all(*opened(file)).messages) ++counts[each.topic];
  return counts;
}

// What stands in the metadata and the messages, changed on its way: a recording of something that never was.
struct Change {
  std::function<void(mcap::Metadata&)> note = [](mcap::Metadata&) {};
  // Number of the joint states that are to be others.
  std::uint32_t number = ~0U;
};

void copy(const fs::path& from, const fs::path& to, const Change& change) {
  const auto reader = opened(from);
  const auto created = record::McapWriter::create(to, {});
  ASSERT_TRUE(created) << created.error().line();
  record::McapWriter* const writer = created->get();
  for (const auto& index : reader->contents().metadata) {
    const auto read = reader->metadata(index);
    ASSERT_TRUE(read);
    mcap::Metadata metadata = *read;
    change.note(metadata);
    ASSERT_TRUE(writer->note(metadata));
  }
  std::map<std::uint16_t, std::uint16_t> ids;
  const auto copied = reader->each_message({}, [&](const mcap::Message& message, const mcap::Channel& channel) {
    if (!ids.contains(channel.id)) {
      const auto& schema = reader->contents().schemas.at(channel.schema);
      const auto id = writer->add_schema(schema.name, schema.encoding, schema.data);
      const auto made = writer->add_channel(*id, channel.topic, channel.message_encoding, channel.metadata);
      ids[channel.id] = *made;
    }
    mcap::Message changed = message;
    changed.channel = ids[channel.id];
    std::vector<std::byte> bytes(message.data.begin(), message.data.end());
    if (channel.topic == "/joint_states" && message.sequence == change.number) {
      JointState state;
      EXPECT_TRUE(wire::decode(bytes, state));
      state.velocity[3] += 0.125;
      EXPECT_TRUE(wire::encode(state, bytes));
    }
    changed.data = bytes;
    return writer->write(changed).has_value();
  });
  ASSERT_TRUE(copied && !*copied);
  ASSERT_TRUE(writer->finish());
}

class Replay : public ::testing::Test {
 protected:
  // Of a few parcels, but for what `more` says.
  [[nodiscard]] Finished record(const std::string& name, const Words& more = {"--parcels", "2"}) const {
    Words words{"run", "small_cell", "--quiet", "--record", file(name)};
    words.insert(words.end(), more.begin(), more.end());
    return run_pons(words);
  }
  [[nodiscard]] Finished replay(const std::string& name, const Words& more = {}) const {
    Words words{"replay", file(name)};
    words.insert(words.end(), more.begin(), more.end());
    return run_pons(words);
  }
  [[nodiscard]] std::string file(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] std::string bytes(const std::string& name) const { return record::read_bytes(folder_ / name); }

  Folder folder_;
};

TEST_F(Replay, RecordingsOfOneRunAndItsReplaysAreTheSameToTheByte) {
  for (const char* name : {"a.mcap", "b.mcap"}) {
    const Finished run = run_pons({"run", "parcel_cell", "--parcels", "20", "--quiet", "--record", file(name)});
    ASSERT_EQ(run.code, 0) << run.err;
    EXPECT_THAT(run.out, AllOf(HasSubstr(fmt::format("recording: {}: ", file(name))), HasSubstr(" messages, "),
                               testing::Not(HasSubstr("dropped"))));
  }
  EXPECT_TRUE(bytes("a.mcap") == bytes("b.mcap"));
  const Finished again = replay("a.mcap", {"--record", file("c.mcap")});
  EXPECT_EQ(again.code, 0) << again.out << again.err;
  EXPECT_EQ(again.err, "");
  EXPECT_THAT(again.out, testing::StartsWith("equal: "));
  EXPECT_TRUE(bytes("a.mcap") == bytes("c.mcap"));
  EXPECT_TRUE(whole(folder_ / "a.mcap"));
}

TEST_F(Replay, ARecordingHoldsWhatTheRunShows) {
  ASSERT_EQ(record("a.mcap").code, 0);
  const auto told = nlohmann::json::parse(run_pons({"recording", "info", file("a.mcap"), "--json"}).out);
  const nlohmann::json run{
      {"world", "small_cell"}, {"seed", 1}, {"pace", "in virtual time"}, {"parcels", 2}, {"ended", "complete"}};
  EXPECT_EQ(told["run"], run);
  EXPECT_THAT(run_pons({"recording", "info", file("a.mcap")}).out,
              HasSubstr("\nrun of small_cell, seed 1, 2 parcels, in virtual time: complete\n"));
  const auto reader = opened(folder_ / "a.mcap");
  const auto counts = counts_of(folder_ / "a.mcap");
  std::set<std::string> topics;
  for (const auto& [topic, count] : counts) topics.insert(topic);
  EXPECT_THAT(topics, IsSupersetOf({"/joint_states", "/tf", "/tf_static", "/robot_description", "/rosout",
                                    "/diagnostics", "/pons/beliefs", "/pons/commands", "/pons/state"}));
  EXPECT_FALSE(topics.contains("/clock")) << "each message has its time";
  // From the first tick to the last.
  const double ran_s = 1e-9 * static_cast<double>(reader->contents().statistics.end);
  EXPECT_NEAR(static_cast<double>(counts.at("/joint_states")), 100 * ran_s, 5);
  EXPECT_NEAR(static_cast<double>(counts.at("/pons/state")), 100 * ran_s, 5);
  EXPECT_EQ(counts.at("/tf_static"), 1U);
  bool believed = false, grasped = false, pressed = false;
  (void)reader->each_message({}, [&](const mcap::Message& message, const mcap::Channel& channel) {
    wire::pons_msgs::msg::ObjectBeliefArray beliefs;
    wire::pons_msgs::msg::LinkCommand command;
    wire::pons_msgs::msg::RobotState state;
    if (channel.topic == "/pons/beliefs" && wire::decode(message.data, beliefs))
      believed = believed || std::ranges::any_of(beliefs.objects, [](const auto& each) { return !each.code.empty(); });
    if (channel.topic == "/pons/commands" && wire::decode(message.data, command))
      grasped = grasped || (command.kind == command.KIND_VACUUM && command.vacuum_on != 0);
    if (channel.topic == "/pons/state" && wire::decode(message.data, state))
      pressed = pressed || state.vacuum == state.VACUUM_SEALED;
    EXPECT_GE(message.log_time, message.publish_time);
    return true;
  });
  EXPECT_TRUE(believed && grasped && pressed);
  const auto& header = reader->contents().header;
  EXPECT_EQ(header.profile, "ros2");
  EXPECT_TRUE(
      std::ranges::all_of(reader->contents().chunks, [](const auto& each) { return each.compression == "zstd"; }));
}

TEST_F(Replay, ARecordingHoldsThePicturesOfEachCamera) {
  ASSERT_EQ(record("a.mcap").code, 0);
  const auto counts = counts_of(folder_ / "a.mcap");
  for (const std::string camera : {"/overhead", "/label", "/tray"}) {
    EXPECT_GT(counts.at(camera + "/image_raw/compressed"), 0U);
    EXPECT_EQ(counts.at(camera + "/image_raw/compressed"), counts.at(camera + "/camera_info"));
    for (const char* live : {"/image_raw", "/depth/image_rect_raw", "/depth/camera_info"})
      EXPECT_FALSE(counts.contains(camera + live)) << live;
  }
  bool pictures = true, counted = false;
  (void)opened(folder_ / "a.mcap")->each_message({}, [&](const mcap::Message& message, const mcap::Channel& channel) {
    wire::sensor_msgs::msg::CompressedImage picture;
    wire::diagnostic_msgs::msg::DiagnosticArray health;
    if (channel.topic.ends_with("/compressed"))
      pictures = pictures && wire::decode(message.data, picture) && picture.data.size() > 100;
    if (channel.topic == "/diagnostics" && wire::decode(message.data, health))
      counted =
          counted || std::ranges::any_of(health.status, [](const auto& each) { return each.name == "pons: pictures"; });
    return true;
  });
  EXPECT_TRUE(pictures);
  EXPECT_TRUE(counted);
}

TEST_F(Replay, ARecordingHoldsDepthWhereItIsAskedFor) {
  ASSERT_EQ(record("a.mcap", {"--parcels", "2", "--record-depth"}).code, 0);
  const auto counts = counts_of(folder_ / "a.mcap");
  for (const std::string camera : {"/overhead", "/label", "/tray"}) {
    const auto pictures = counts.at(camera + "/image_raw/compressed");
    EXPECT_EQ(counts.at(camera + "/depth/image_rect_raw/compressedDepth"), pictures);
    EXPECT_EQ(counts.at(camera + "/depth/camera_info"), pictures);
  }
  const Finished again = replay("a.mcap", {"--record", file("b.mcap")});
  EXPECT_THAT(again.out, testing::StartsWith("equal: "));
  EXPECT_TRUE(bytes("a.mcap") == bytes("b.mcap"));
}

// Of one run: the journal tells the same of its tasks.
TEST_F(Replay, ARecordingHoldsWhatTheJournalTellsOfTasks) {
  ASSERT_EQ(record("a.mcap", {"--parcels", "2", "--journal", file("j.db")}).code, 0);
  using Told = std::tuple<std::int64_t, std::string, std::string>;  // sequence, task, kind
  std::vector<Told> recorded, journaled;
  std::map<std::string, std::uint8_t> outcomes;
  std::size_t motions = 0;
  (void)opened(folder_ / "a.mcap")->each_message({}, [&](const mcap::Message& message, const mcap::Channel& channel) {
    wire::pons_msgs::msg::TaskEvent event;
    wire::pons_msgs::msg::TaskStatusArray statuses;
    wire::bridge_layer::msg::LowLevelCommand command;
    if (channel.topic == "/pons/task_events" && wire::decode(message.data, event) && !event.task.empty())
      recorded.emplace_back(event.sequence, event.task, event.kind);
    if (channel.topic == "/pons/task_status" && wire::decode(message.data, statuses)) {
      for (const auto& each : statuses.tasks) outcomes[each.id] = each.outcome;
    }
    if (channel.topic == "/low_level_command") motions += wire::decode(message.data, command) ? 1U : 0U;
    return true;
  });
  const auto journal = bridge::Journal::open_to_read(file("j.db"));
  ASSERT_TRUE(journal) << journal.error().line();
  const auto tasks = (*journal)->tasks();
  ASSERT_TRUE(tasks && !tasks->empty());
  for (const bridge::TaskRecord& task : *tasks) {
    const auto events = (*journal)->history(task.task.id);
    ASSERT_TRUE(events);
    for (const bridge::Event& event : *events) {
      if (event.task == task.task.id) journaled.emplace_back(event.sequence, event.task, event.kind);
    }
    EXPECT_EQ(outcomes.at(task.task.id), wire::pons_msgs::msg::TaskStatus::OUTCOME_SUCCEEDED) << task.task.id;
  }
  std::ranges::sort(journaled);
  EXPECT_EQ(recorded, journaled);
  EXPECT_GT(motions, tasks->size()) << "several a task";
}

TEST_F(Replay, WhatIsAnotherIsFoundAndNamed) {
  ASSERT_EQ(record("a.mcap").code, 0);
  copy(folder_ / "a.mcap", folder_ / "planted.mcap", {.number = 777});
  const Finished planted = replay("planted.mcap");
  EXPECT_EQ(planted.code, 1);
  EXPECT_THAT(planted.out, AllOf(testing::StartsWith("differs after "),
                                 HasSubstr("number 777 of /joint_states (sensor_msgs/msg/JointState) at "),
                                 HasSubstr("velocity[3]: recorded ")));
  EXPECT_EQ(planted.err, "");
  copy(folder_ / "a.mcap", folder_ / "seed.mcap", {.note = [](mcap::Metadata& note) {
         if (note.texts.contains("seed")) note.texts["seed"] = "2";
       }});
  const Finished seed = replay("seed.mcap");
  EXPECT_EQ(seed.code, 1);
  EXPECT_THAT(seed.out, HasSubstr("differs after "));
  // Said before, and no reason to refuse: what comes of it is what is asked.
  copy(folder_ / "a.mcap", folder_ / "world.mcap", {.note = [](mcap::Metadata& note) {
         if (note.name != "pons.made_of") return;
         note.texts["pons"] = "0.0.1";
         note.texts["small_cell/world.yaml"] = "0123456789abcdef";
         note.texts["small_cell/gone.yaml"] = "0123456789abcdef";
       }});
  const Finished world = replay("world.mcap");
  EXPECT_EQ(world.code, 0) << world.out;
  EXPECT_THAT(world.err, AllOf(HasSubstr("not as recorded: it was recorded by pons 0.0.1; this is "),
                               HasSubstr("not as recorded: worlds/small_cell/world.yaml was another"),
                               HasSubstr("not as recorded: worlds/small_cell/gone.yaml is not there any more")));
  EXPECT_EQ(replay("world.mcap", {"--quiet"}).err, "");
}

// With all that options say of a run, a file's plan and a file's orders among it, which need not be there any more.
TEST_F(Replay, WhatIsKilledIsKilledAgain) {
  write_text(folder_ / "plan.yaml",
             "bridge_crash: {an_hour: 900, lasts_s: [0.3, 1]}\nloop_crash: {an_hour: 150, lasts_s: [0.3, 1]}\n");
  fs::copy_file("tests/end_to_end/any_size.csv", folder_ / "orders.csv");
  const Words options{"--faults",  file("plan.yaml"), "--visit",    "aisle@3+2",        "--seed",   "3",
                      "--journal", file("j.db"),      "--manifest", file("orders.csv"), "--report", file("r.json")};
  Words words{"run", "parcel_cell", "--quiet", "--parcels", "6", "--record", file("a.mcap")};
  words.insert(words.end(), options.begin(), options.end());
  const Finished run = run_pons(words);
  ASSERT_EQ(run.code, 0) << run.err << run.out;
  EXPECT_GE(read_json(folder_ / "r.json")["faults"]["bridge_crash"], 2);
  EXPECT_GE(read_json(folder_ / "r.json")["faults"]["loop_crash"], 1);
  EXPECT_GE(counts_of(folder_ / "a.mcap").at("/robot_description"), 3U) << "each bridge says it anew";
  fs::remove(folder_ / "plan.yaml");
  fs::remove(folder_ / "orders.csv");
  const Finished again = replay("a.mcap", {"--record", file("b.mcap")});
  EXPECT_EQ(again.code, 0) << again.out << again.err;
  EXPECT_TRUE(bytes("a.mcap") == bytes("b.mcap"));
}

TEST_F(Replay, FurtherFilesBeginWithWhatStandsAndAreFollowed) {
  const Finished run = record("a.mcap", {"--record-file", "1", "--parcels", "4"});
  ASSERT_EQ(run.code, 0) << run.err;
  ASSERT_TRUE(fs::exists(folder_ / "a_1.mcap")) << run.out;
  EXPECT_LE(fs::file_size(folder_ / "a.mcap"), 1U << 20U);
  const auto kept = record::read_all(*opened(folder_ / "a_1.mcap")).messages;
  std::set<std::string> first;
  for (std::size_t i = 0; i < 2; ++i) first.insert(kept.at(i).topic);
  EXPECT_EQ(first, (std::set<std::string>{"/robot_description", "/tf_static"}));
  EXPECT_TRUE(whole(folder_ / "a.mcap") && whole(folder_ / "a_1.mcap"));
  const Finished again = replay("a.mcap");
  EXPECT_EQ(again.code, 0) << again.out;
  const Finished middle = replay("a_1.mcap");
  EXPECT_EQ(middle.code, 2) << middle.out;
  EXPECT_THAT(middle.err, HasSubstr("a_1.mcap: nothing of it can be replayed: begins in the middle of its run"));
}

TEST_F(Replay, TheOldestFilesGoByTheQuota) {
  const Finished run = record("a.mcap", {"--record-file", "1", "--record-quota", "2", "--parcels", "6"});
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("older ones removed"));
  EXPECT_FALSE(fs::exists(folder_ / "a.mcap"));
  std::uintmax_t all = 0;
  for (const auto& each : fs::directory_iterator(folder_.path())) all += each.file_size();
  EXPECT_LE(all, 2U << 20U);
}

TEST_F(Replay, ARunThatIsKilledLeavesEachFinishedChunk) {
  Running run(folder_.path(), "run", {"run", "small_cell", "--parcels", "200", "--quiet", "--record", file("a.mcap")});
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  const auto size = [&] { return fs::exists(folder_ / "a.mcap") ? fs::file_size(folder_ / "a.mcap") : 0; };
  while (size() < 200'000 && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
  run.signal(SIGKILL);
  EXPECT_EQ(run.wait().code, -SIGKILL);
  const auto reader = opened(folder_ / "a.mcap");
  EXPECT_FALSE(reader->contents().finished);
  const auto kept = record::read_all(*reader).messages;
  EXPECT_GT(kept.size(), 500U);
  const Finished again = replay("a.mcap");
  EXPECT_EQ(again.code, 0) << again.out;
  const std::string so_far = fmt::format("equal as far as it goes: {} messages, {:.3f} s; ", kept.size(),
                                         1e-9 * static_cast<double>(kept.back().log_time));
  EXPECT_THAT(again.out, AllOf(HasSubstr(so_far), HasSubstr("a.mcap: ")));
  // What has become a whole file is as little of its run.
  ASSERT_EQ(run_pons({"recording", "repair", file("a.mcap")}).code, 0);
  EXPECT_THAT(run_pons({"recording", "info", file("a_repaired.mcap")}).out,
              HasSubstr("200 parcels, in virtual time: its end is not in this file\n"));
  const Finished repaired = replay("a_repaired.mcap");
  EXPECT_EQ(repaired.code, 0) << repaired.out;
  EXPECT_THAT(repaired.out, AllOf(HasSubstr(so_far), HasSubstr("a_repaired.mcap: its run did not end there")));
}

class ReplayOfABreak : public Replay, public testing::WithParamInterface<std::vector<std::string>> {};

// The one sorts, and goes on with nothing to do; the other has no parcels at all.
INSTANTIATE_TEST_SUITE_P(, ReplayOfABreak,
                         testing::Values(Words{"--parcels", "200"}, Words{"--stay", "--parcels", "2"},
                                         Words{"--stay"}));

TEST_P(ReplayOfABreak, CtrlCComesAgainAtItsTime) {
  Words words{"run", "small_cell", "--quiet", "--record", file("a.mcap")};
  words.insert(words.end(), GetParam().begin(), GetParam().end());
  Running run(folder_.path(), "run", words);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  const auto size = [&] { return fs::exists(folder_ / "a.mcap") ? fs::file_size(folder_ / "a.mcap") : 0; };
  while (size() < 200'000 && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
  run.signal(SIGINT);
  EXPECT_EQ(run.wait().code, 130);
  EXPECT_TRUE(whole(folder_ / "a.mcap"));
  const std::string parcels = GetParam().size() > 1 ? fmt::format(", {} parcels", GetParam().back()) : "";
  EXPECT_THAT(run_pons({"recording", "info", file("a.mcap")}).out,
              HasSubstr(fmt::format("\nrun of small_cell, seed 1{}, in virtual time: ", parcels)));
  const Finished again = replay("a.mcap", {"--record", file("b.mcap")});
  EXPECT_EQ(again.code, 0) << again.out;
  EXPECT_THAT(again.out, testing::StartsWith("equal: "));
  EXPECT_TRUE(bytes("a.mcap") == bytes("b.mcap"));
}

TEST_F(Replay, ABaseMakesItsRoundsAgain) {
  const Words words{"run", "rounds", "--quiet", "--record"};
  for (const char* name : {"a.mcap", "b.mcap"}) {
    Words all = words;
    all.push_back(file(name));
    const Finished run = run_pons(all);
    ASSERT_EQ(run.code, 0) << run.err;
  }
  EXPECT_TRUE(bytes("a.mcap") == bytes("b.mcap"));
  EXPECT_THAT(run_pons({"recording", "info", file("a.mcap")}).out,
              HasSubstr("\nrun of rounds, seed 1, in virtual time: complete\n"));
  const auto counts = counts_of(folder_ / "a.mcap");
  EXPECT_GT(counts.at("/pons/pose"), 10U);
  EXPECT_GT(counts.at("/pons/commands"), 10U);
  const Finished again = replay("a.mcap", {"--record", file("c.mcap")});
  EXPECT_EQ(again.code, 0) << again.out << again.err;
  EXPECT_TRUE(bytes("a.mcap") == bytes("c.mcap"));
}

}  // namespace
}  // namespace pons::tests
