// A thread for what takes a while and nobody waits for.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace pons::runner {

class Aside {
 public:
  // So many jobs wait at most, besides the one that is being done.
  explicit Aside(std::size_t waiting_most);
  // What waits then is not done.
  ~Aside();
  Aside(const Aside&) = delete;
  Aside& operator=(const Aside&) = delete;

  // Any thread. Jobs are done one after the other, in the order in which they came. False: it finds no room.
  bool put(std::function<void()> job);

 private:
  void work(const std::stop_token& stop);

  const std::size_t waiting_most_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<std::function<void()>> waiting_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace pons::runner
