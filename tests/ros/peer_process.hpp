// A peer of another make, in a process of its own: what it prints, and its end.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pons/gate/unix_address.hpp"

namespace pons::test {

class PeerProcess {
 public:
  // `program` DOMAIN NODE ROLE, with `environment` (NAME=VALUE) besides its parent's.
  PeerProcess(const std::string& program, std::uint32_t domain, const std::string& node, const std::string& role,
              const std::vector<std::string>& environment = {});
  ~PeerProcess();
  PeerProcess(const PeerProcess&) = delete;
  PeerProcess& operator=(const PeerProcess&) = delete;

  // All that it has printed so far, a line each.
  [[nodiscard]] const std::vector<std::string>& lines();
  [[nodiscard]] bool said(const std::string& start);
  // By SIGKILL.
  void kill();

 private:
  int id_ = -1;
  gate::Descriptor input_, output_;  // ours: its input ends with us
  std::string rest_;
  std::vector<std::string> lines_;
};

}  // namespace pons::test
