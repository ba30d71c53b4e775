#include "pons/runner/aside.hpp"

#include <utility>

namespace pons::runner {

Aside::Aside(std::size_t waiting_most)
    : waiting_most_(waiting_most), thread_([this](const std::stop_token& stop) { work(stop); }) {}

Aside::~Aside() = default;

bool Aside::put(std::function<void()> job) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= waiting_most_) return false;
    waiting_.push_back(std::move(job));
  }
  changed_.notify_all();
  return true;
}

void Aside::work(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return !waiting_.empty(); }) && !stop.stop_requested()) {
    const std::function<void()> job = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    job();
    lock.lock();
  }
}

}  // namespace pons::runner
