// What perception believes to lie about, each time that it has taken in a frame.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "apps/views/outlets.hpp"
#include "pons/core/belief.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/runner/observer.hpp"
#include "pons/wire/types/pons_msgs/msg/object_belief_array.hpp"

namespace pons::apps {

class BeliefsView final : public View {
 public:
  // `seen`: what it said last, as of this period. Errors: those of the outlets.
  [[nodiscard]] static Expected<std::unique_ptr<BeliefsView>> open(Outlets& outlets,
                                                                   std::function<const runner::Snapshot&()> seen);
  void show(Time now) override;

 private:
  using Beliefs = wire::pons_msgs::msg::ObjectBeliefArray;
  BeliefsView(Outlet<Beliefs> beliefs, std::function<const runner::Snapshot&()> seen)
      : beliefs_(beliefs), seen_(std::move(seen)) {}

  Outlet<Beliefs> beliefs_;
  std::function<const runner::Snapshot&()> seen_;
  Time stamp_, due_;  // of what was shown last
  Beliefs message_;
};

}  // namespace pons::apps
