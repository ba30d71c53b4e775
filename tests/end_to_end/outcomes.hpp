// What became of each parcel of a run, by the journal that it left.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>

#include "pons/bridge/journal/journal.hpp"

namespace pons::tests {

// What no run may do, whatever happens to parcels on the way.
inline void expect_accounted_for(const nlohmann::json& report) {
  EXPECT_EQ(report["parcels"]["lost"], 0) << report.dump(2);
  EXPECT_EQ(report["parcels"]["duplicated"], 0) << report.dump(2);
}

// Parcel to its last task's outcome, as the journal holds it; and the codes that were let ride, with the reason.
inline std::map<std::string, std::string> outcomes(const std::filesystem::path& file) {
  std::map<std::string, std::string> found;
  const auto journal = bridge::Journal::open_to_read(file);
  EXPECT_TRUE(journal) << (journal ? "" : journal.error().line());
  if (!journal) return found;
  const auto tasks = (*journal)->tasks();
  EXPECT_TRUE(tasks);
  for (const bridge::TaskRecord& record : *tasks) {
    const std::string parcel = record.task.id.substr(0, record.task.id.find('.'));
    found[parcel] = record.outcome ? std::string(task::name(record.outcome->outcome)) : "none";
  }
  const auto events = (*journal)->notes();
  EXPECT_TRUE(events);
  for (const bridge::Event& event : *events) {
    if (event.kind != "ride") continue;
    found.try_emplace(event.detail.value("code", ""), "ride: " + event.detail.value("reason", ""));
  }
  return found;
}

}  // namespace pons::tests
