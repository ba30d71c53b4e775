// Where visitors are answered: requests from the local socket meet bridge and journal.
#pragma once

#include <memory>
#include <string>

#include "pons/bridge/bridge.hpp"
#include "pons/bridge/journal/journal.hpp"
#include "pons/gate/local_socket.hpp"

namespace pons::apps {

class Desk {
 public:
  // Bridge and journal must outlive it.
  Desk(std::unique_ptr<gate::LocalSocket> socket, bridge::Bridge& bridge, const bridge::Journal& journal);
  // On the bridge's thread, once a period: answers what has come. Never waits.
  void attend(Time now);

 private:
  [[nodiscard]] bridge::Json answer(const std::string& text, Time now);

  std::unique_ptr<gate::LocalSocket> socket_;
  bridge::Bridge& bridge_;
  const bridge::Journal& journal_;
};

}  // namespace pons::apps
