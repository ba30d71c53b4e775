#include "pons/runner/helper.hpp"

namespace pons::runner {

Helper::Helper() : thread_([this](const std::stop_token& stop) { help(stop); }) {}

Helper::~Helper() = default;

void Helper::both(const std::function<void()>& first, const std::function<void()>& second) {
  {
    const std::lock_guard lock(mutex_);
    work_ = &second;
  }
  changed_.notify_all();
  first();
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return work_ == nullptr; });
}

void Helper::help(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return work_ != nullptr; })) {
    const std::function<void()>& work = *work_;
    lock.unlock();
    work();
    lock.lock();
    work_ = nullptr;
    changed_.notify_all();
  }
}

}  // namespace pons::runner
