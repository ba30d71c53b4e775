// Several sources of requests as one.
#pragma once

#include <memory>
#include <vector>

#include "pons/gate/local_socket.hpp"

namespace pons::apps {

// `own` may be null; the others outlive what is given back.
[[nodiscard]] std::unique_ptr<gate::Visitors> together(std::unique_ptr<gate::Visitors> own,
                                                       std::vector<gate::Visitors*> others);

}  // namespace pons::apps
