// A brain that asks for what somebody has written down, each task at its time, whatever it sees.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "pons/brain/brain.hpp"

namespace pons::brain {

struct Errand {
  Json task;
  Time at;
};

class Errands final : public Brain {
 public:
  // Those of one time go in their order here.
  explicit Errands(std::vector<Errand> errands);

  [[nodiscard]] const std::vector<Errand>& all() const { return errands_; }

  [[nodiscard]] Decisions observe(const std::vector<ObjectBelief>& beliefs, Time now,
                                  const std::set<std::string>& set_aside) override;
  bool heard(std::string_view id, task::Outcome outcome) override;
  void recall(const task::Task& task, std::optional<task::Outcome> outcome) override;
  void recall_ride(std::string_view) override {}
  [[nodiscard]] std::vector<std::string> unseen() const override { return {}; }
  [[nodiscard]] bool waits() const override { return next_ < errands_.size(); }

 private:
  std::vector<Errand> errands_;  // by time
  std::size_t next_ = 0;
  std::set<std::string, std::less<>> asked_;  // ids
};

}  // namespace pons::brain
