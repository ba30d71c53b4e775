#include "apps/visitors.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace pons::apps {
namespace {

class Together final : public gate::Visitors {
 public:
  Together(std::unique_ptr<gate::Visitors> own, std::vector<gate::Visitors*> others)
      : own_(std::move(own)), others_(std::move(others)) {}
  [[nodiscard]] std::vector<gate::Request> poll() override {
    auto requests = own_ ? own_->poll() : std::vector<gate::Request>{};
    for (gate::Visitors* const each : others_) std::ranges::move(each->poll(), std::back_inserter(requests));
    return requests;
  }

 private:
  std::unique_ptr<gate::Visitors> own_;
  std::vector<gate::Visitors*> others_;
};

}  // namespace

std::unique_ptr<gate::Visitors> together(std::unique_ptr<gate::Visitors> own, std::vector<gate::Visitors*> others) {
  if (others.empty()) return own;
  return std::make_unique<Together>(std::move(own), std::move(others));
}

}  // namespace pons::apps
