// A thread that takes the other half of somebody's work.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace pons::runner {

class Helper {
 public:
  Helper();
  ~Helper();
  Helper(const Helper&) = delete;
  Helper& operator=(const Helper&) = delete;

  // pons::Both: `first` on the calling thread, `second` on this one's. One caller at a time.
  void both(const std::function<void()>& first, const std::function<void()>& second);

 private:
  void help(const std::stop_token& stop);

  std::mutex mutex_;
  std::condition_variable_any changed_;
  const std::function<void()>* work_ = nullptr;  // null: done
  std::jthread thread_;                          // last: it uses the others
};

}  // namespace pons::runner
