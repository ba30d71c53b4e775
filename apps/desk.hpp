// Where visitors are answered: requests from the local socket, or wherever visitors come from, meet bridge, journal and
// arm.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pons/bridge/bridge.hpp"
#include "pons/bridge/journal/journal.hpp"
#include "pons/gate/local_socket.hpp"
#include "pons/gate/request.hpp"
#include "pons/link/message.hpp"
#include "pons/runner/arming.hpp"
#include "pons/runner/bridge_side.hpp"
#include "pons/runner/health.hpp"
#include "pons/task/policy.hpp"

namespace pons::apps {

class Desk {
 public:
  // The stream of chunks that goes on, or null.
  using Stream = std::function<task::ChunkStream*()>;
  // All but the visitors must outlive it. `arming` is that of each robot: a stop is for all of them, a reset and an
  // arming for those that wait for a person.
  Desk(std::unique_ptr<gate::Visitors> visitors, bridge::Bridge& bridge, bridge::Journal& journal,
       std::vector<runner::Arming*> arming, const runner::Health& health, Stream stream);
  // Of which it may be asked that it rests, goes on or ends, which is refused without; it outlives this.
  void serve(runner::BridgeSide& run) { run_ = &run; }
  // What may be asked of a base; without, it is refused.
  struct Base {
    std::function<bridge::Json(Time)> describe;  // as gate/request.hpp has it
    // The id of the task that drives. Error: why nothing comes of it.
    std::function<Expected<std::string>(double ahead_m_s, double turn_rad_s, Time)> drive;
  };
  void serve(Base base) { base_ = std::move(base); }
  // What may be asked of an arm; without, it is refused.
  struct Axes {
    std::vector<std::string> names;
    std::function<const link::State&()> state;
    // The id of the task that goes there. Error: why nothing comes of it.
    std::function<Expected<std::string>(const AxisVector& position, Time)> servo;
  };
  void serve(Axes axes) { axes_ = std::move(axes); }
  // On the bridge's thread, once a period: answers what has come. Waits for the disk where it tells of tasks, else for
  // nothing.
  void attend(Time now);
  // Likewise, once there is no robot any more, and the journal says what has become of its tasks: who watches them
  // hears of it, and nothing else is done.
  void take_leave(Time now);

 private:
  [[nodiscard]] bridge::Json answer(const gate::Asked& asked, Time now);
  void note_refusal(const std::string& text, const Error& why, Time now);
  [[nodiscard]] bridge::Json submit(const std::string& task, Time now);
  // The bridge knows more of an open task than the journal's row.
  [[nodiscard]] bridge::Json with_state(const bridge::TaskRecord& record) const;
  [[nodiscard]] bridge::Json list(const gate::Asked& asked) const;
  [[nodiscard]] bridge::Json show(const std::string& id) const;
  [[nodiscard]] bridge::Json history(const std::string& order) const;
  [[nodiscard]] bridge::Json tell_task(const gate::Asked& asked, Time now);
  // What there is to tell to who watches; nothing while there is nothing new.
  [[nodiscard]] std::optional<bridge::Json> news(const gate::Asked& asked, std::int64_t after) const;
  void tell_watchers(Time now);
  [[nodiscard]] Expected<void> tell_arm(gate::Operation operation, Time now);
  [[nodiscard]] bridge::Json describe() const;
  [[nodiscard]] bridge::Json ask_axes(const gate::Asked& asked, Time now);
  [[nodiscard]] bridge::Json ask_base(const gate::Asked& asked, Time now);
  [[nodiscard]] bridge::Json tell_run(gate::Operation operation, Time now);
  [[nodiscard]] bridge::Json observe(Time now) const;
  [[nodiscard]] bridge::Json take(const gate::Asked& asked, Time now);

  std::unique_ptr<gate::Visitors> visitors_;
  bridge::Bridge& bridge_;
  bridge::Journal& journal_;
  std::vector<runner::Arming*> arming_;
  const runner::Health& health_;
  Stream stream_;
  runner::BridgeSide* run_ = nullptr;
  std::optional<Base> base_;
  std::optional<Axes> axes_;
  struct Watcher {
    gate::Request request;
    gate::Asked asked;
    Time until;
    std::int64_t looked = -1;  // what was durable when there was nothing to tell
  };
  std::vector<Watcher> watchers_;
};

}  // namespace pons::apps
