// A computer's wall clock that jumps is nobody's concern here: runs, journals, recordings and ROS 2 go by the one that
// goes on.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "pons/gate/ros/test_nodes.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::tests {
namespace {

class JumpingClock : public ::testing::Test {
 protected:
  // A whole run of everything that tells of its times; its report.
  nlohmann::json run(const std::string& name, std::vector<std::string> more, bool jumps) {
    std::vector<std::string> arguments{"run",
                                       "small_cell",
                                       "--parcels",
                                       "3",
                                       "--seed",
                                       "1",
                                       "--ros",
                                       "--record",
                                       file(name + ".mcap"),
                                       "--journal",
                                       file(name + ".db"),
                                       "--report",
                                       file(name + ".json")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    std::vector<std::string> environment{"ROS_DOMAIN_ID=" + std::to_string(gate::ros::test_domain())};
    if (jumps) environment.emplace_back("LD_PRELOAD=" PONS_JUMPING_CLOCK);
    const Finished ran = run_pons(arguments, environment);
    EXPECT_EQ(ran.code, 0) << ran.out << ran.err;
    for (const char* const of : {"journal", "recording"}) {
      const Finished checked = run_pons({of, "check", file(name + (*of == 'j' ? ".db" : ".mcap"))}, environment);
      EXPECT_EQ(checked.code, 0) << checked.out << checked.err;
    }
    return read_json(file(name + ".json"));
  }
  [[nodiscard]] std::string file(const std::string& name) const { return folder_ / name; }

  Folder folder_;
};

TEST_F(JumpingClock, ChangesNothingOfARun) {
  const auto steady = run("steady", {}, false), jumping = run("jumping", {}, true);
  EXPECT_EQ(jumping.at("state_hash"), steady.at("state_hash"));
}

TEST_F(JumpingClock, IsNoneOfARealRobots) {
  const auto report = run("real", {"--realtime"}, true);
  EXPECT_EQ(report.at("parcels").at("sorted"), 3) << report.at("parcels").dump();
}

}  // namespace
}  // namespace pons::tests
